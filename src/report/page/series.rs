//! Points of a sweep in groups, each with a look and a name.
//!
//! Owns how groups are formed and told apart. May use `study`, `panel`, `color`. It deliberately
//! decides on colour and shape together, so that a print without colour can be read.

use super::super::color::{PALE, Rgb, SERIES};
use super::super::panel::{KeyEntry, Look, Mark, Panel, Shape};
use super::super::scale::{Scale, Spacing};
use super::quantity::with_unit;
use super::study::{PointSummary, Study};

/// Groups with a look of their own; of more the others are faint dots.
const MOST_SERIES: usize = 8;

/// Points that agree in some axes.
pub struct Series<'a> {
    /// Places in [`Study::axes`] with the values that all points share.
    pub shared: Vec<(usize, Option<f64>)>,
    pub points: Vec<(u32, &'a PointSummary)>,
}

/// In the order of the values. Points of which nothing is done are left out.
pub fn series<'a>(study: &'a Study, axes: &[usize]) -> Vec<Series<'a>> {
    let mut list: Vec<Series> = Vec::new();
    for (number, point) in study.points.iter().filter(|(_, point)| point.n_done > 0) {
        let shared: Vec<_> =
            axes.iter().map(|axis| (*axis, point.axes.get(*axis).copied().flatten())).collect();
        match list.iter_mut().find(|series| series.shared == shared) {
            Some(series) => series.points.push((*number, point)),
            None => list.push(Series { shared, points: vec![(*number, point)] }),
        }
    }
    let key = |series: &Series| -> Vec<f64> {
        series.shared.iter().map(|(_, value)| value.unwrap_or(f64::INFINITY)).collect()
    };
    list.sort_by(|a, b| key(a).partial_cmp(&key(b)).unwrap_or(std::cmp::Ordering::Equal));
    list
}

/// `step 0.5 s, chi 1 1/s`; empty without axes.
pub fn name(study: &Study, shared: &[(usize, Option<f64>)]) -> String {
    let one = |(axis, value): &(usize, Option<f64>)| {
        let axis = &study.axes[*axis];
        let value = value.map_or_else(|| "–".to_owned(), |value| with_unit(value, &axis.unit));
        format!("{} {value}", axis.name)
    };
    shared.iter().map(one).collect::<Vec<_>>().join(", ")
}

/// The names of the axes that are not among `without`.
pub fn other_names(study: &Study, without: &[usize]) -> String {
    let others = study.axes.iter().enumerate().filter(|(idx, _)| !without.contains(idx));
    others.map(|(_, axis)| axis.name.as_str()).collect::<Vec<_>>().join(", ")
}

/// The values of these axes of a point: `1000, 0.5 s`.
pub fn other_values(study: &Study, point: &PointSummary, without: &[usize]) -> String {
    let others = study.axes.iter().zip(&point.axes).enumerate().filter(|(idx, _)| !without.contains(idx));
    let text = |value: &Option<f64>, unit: &str| {
        value.map_or_else(|| "–".to_owned(), |value| with_unit(value, unit))
    };
    others.map(|(_, (axis, value))| text(value, &axis.unit)).collect::<Vec<_>>().join(", ")
}

/// The values of all axes of a point with their names.
pub fn full_name(study: &Study, point: &PointSummary) -> String {
    let values: Vec<_> = point.axes.iter().copied().enumerate().collect();
    name(study, &values)
}

/// The look of each of `n` groups: those with one are evenly spread, the first and the last among them.
pub fn slots(n: usize) -> Vec<Option<usize>> {
    if n <= MOST_SERIES {
        return (0..n).map(Some).collect();
    }
    let mut slots = vec![None; n];
    (0..MOST_SERIES).for_each(|slot| slots[slot * (n - 1) / (MOST_SERIES - 1)] = Some(slot));
    slots
}

pub fn color(slot: usize) -> Rgb {
    SERIES[slot % SERIES.len()]
}

/// Seven colours and four shapes come together anew only after 28.
pub fn marker(slot: usize) -> Look {
    Look::Marker(Shape::ALL[slot % Shape::ALL.len()])
}

pub fn key_entry(slot: usize, text: String) -> KeyEntry {
    KeyEntry { text, color: color(slot), look: marker(slot) }
}

/// Groups without a look of their own, to lie below the others.
pub fn faint_mark(points: Vec<(f64, f64)>) -> Mark {
    Mark { points, color: PALE, look: Look::Dots }
}

/// An entry for the groups without a look of their own.
pub fn further(slots: &[Option<usize>]) -> Option<KeyEntry> {
    let n = slots.iter().filter(|slot| slot.is_none()).count();
    let text = format!("{n} more series");
    (n > 0).then_some(KeyEntry { text, color: PALE, look: Look::Dots })
}

/// A panel with marks only, on log axes that cover them.
pub fn log_panel(x_label: String, y_label: String, marks: Vec<Mark>) -> Panel {
    // A guide is drawn where the data are, and does not widen the view.
    let data =
        || marks.iter().filter(|mark| mark.look != Look::Band && !matches!(mark.look, Look::Line([_, ..])));
    let x = data().flat_map(|mark| &mark.points).map(|point| point.0);
    let y = data().flat_map(|mark| &mark.points).map(|point| point.1);
    let wider = |scale: Scale| match scale.spacing {
        Spacing::Log => {
            // Room for texts beside the outermost points.
            let share = crate::maths::scalar::pow(scale.high / scale.low, 0.06);
            Scale { low: scale.low / share, high: scale.high * share, spacing: Spacing::Log }
        }
        Spacing::Linear => scale,
    };
    Panel {
        title: String::new(),
        x_label,
        y_label,
        x: wider(Scale::covering(x, Spacing::Log)),
        y: wider(Scale::covering(y, Spacing::Log)),
        marks,
        heat: None,
        key: Vec::new(),
        notes: Vec::new(),
    }
}

/// A part of a file's name: letters, digits and a few signs.
pub fn slug(text: &str) -> String {
    let safe = |c: char| if c.is_alphanumeric() || "._-".contains(c) { c } else { '_' };
    let slug: String = text.chars().map(safe).collect();
    slug.trim_start_matches('.').to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn looks_are_spread_over_many_series() {
        assert_eq!(slots(3), [Some(0), Some(1), Some(2)]);
        let many = slots(50);
        let named: Vec<usize> = (0..50).filter(|idx| many[*idx].is_some()).collect();
        assert_eq!(named, [0, 7, 14, 21, 28, 35, 42, 49]);
        assert_eq!(further(&many).map(|entry| entry.text), Some("42 more series".to_owned()));
        assert_eq!(further(&slots(8)), None);
    }

    #[test]
    fn names_of_files_stay_in_their_folder() {
        assert_eq!(slug("../err or/ü"), "_err_or_ü");
    }
}
