//! Where a measure is least along an axis, and how that place moves.
//!
//! Owns the search for it. May use `study`, `stats`, `series`. It deliberately fits no law: three points around the
//! least one are all it looks at.

use super::super::color::INK;
use super::super::figure::sheet;
use super::super::panel::{Look, Mark, Shape};
use super::super::sweep::SweepReport;
use super::along::{self, Drawn, places};
use super::csv::{Csv, number};
use super::html::{escape, figure, paragraph, table};
use super::quantity::{label, shown, with_unit};
use super::series::{self, Series, color, key_entry, log_panel, marker};
use super::stats::Moments;
use super::study::Study;
use crate::maths::scalar::{exp, ln};

/// Series whose minima are listed on the page.
const MOST_ROWS: usize = 40;

/// Standard errors of a difference within which two means are as good as one another.
const AS_GOOD: f64 = 2.0;

/// The least mean of a series.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Least {
    /// The place of the point, SI.
    at: f64,
    /// The vertex between the points around it; none at an end of the range.
    between: Option<f64>,
    value: Moments,
    /// Places of the first and the last point that are as good.
    from_to: (f64, f64),
}

/// Values of other axes, and the minima over one more.
type Course = (Vec<(usize, Option<f64>)>, Vec<(f64, Least)>);

/// A measure along an axis.
struct Valley<'a> {
    study: &'a Study,
    measure: &'a str,
    column: usize,
    axis: usize,
    groups: Vec<Series<'a>>,
    least: Vec<Option<Least>>,
}

/// The body of a section, and its tables.
pub fn minimum(study: &Study, report: &SweepReport) -> (String, Vec<(String, String)>) {
    let by: Vec<usize> = report.by.iter().filter_map(|name| study.axis(name)).collect();
    along::against(study, report, "minimum", |column, axis| {
        let valley = Valley::new(study, &report.measure, column, axis);
        let (html, table) = (valley.html(&by), ("minima", valley.minima_csv()));
        Drawn { html, groups: valley.groups, table }
    })
}

impl<'a> Valley<'a> {
    fn new(study: &'a Study, measure: &'a str, column: usize, axis: usize) -> Self {
        let groups = along::courses(study, axis);
        let least =
            groups.iter().map(|group| least(&places(group, axis, column).collect::<Vec<_>>())).collect();
        Self { study, measure, column, axis, groups, least }
    }

    fn html(&self, by: &[usize]) -> String {
        let name = &self.study.axes[self.axis].name;
        let heading = format!("<h3>{} against {}</h3>\n", escape(self.measure), escape(name));
        if self.least.iter().all(Option::is_none) {
            return heading + &paragraph("No point has both numbers, each above zero.");
        }
        let caption = format!(
            "Mean of each point over its replicates with its standard error, on logarithmic axes; the least of each \
             series has a ring. Lines join the points of a series by {name} and are no fit."
        );
        let mut html = heading + &figure(&self.curves(), &caption) + &self.minima();
        if let Some(&moves) = by.first().filter(|axis| **axis != self.axis) {
            let along = &self.study.axes[moves].name;
            let caption = format!(
                "The {name} at which {} is least, over {along}. Bars reach over the values that are as good, within two \
                 standard errors of the difference.",
                self.measure
            );
            html += &figure(&self.moves(moves), &caption);
        }
        html
    }

    fn curves(&self) -> String {
        let axis = &self.study.axes[self.axis];
        let all = || self.groups.iter().flat_map(|group| places(group, self.axis, self.column));
        let x = shown(&axis.unit, all().map(|(x, _)| x).fold(0.0, f64::max));
        let y = shown(&self.study.columns[self.column].unit, all().map(|(_, y)| y.mean).fold(0.0, f64::max));
        let at = |x_at: f64, y_at: f64| (x_at / x.factor, y_at / y.factor);
        let (mut marks, mut key) = (Vec::new(), Vec::new());
        let slots = series::slots(self.groups.len());
        for (idx, group) in self.groups.iter().enumerate() {
            let Some(slot) = slots[idx] else { continue };
            let mine: Vec<_> = places(group, self.axis, self.column).collect();
            let means: Vec<(f64, f64)> = mine.iter().map(|(place, own)| at(*place, own.mean)).collect();
            let bars = mine.iter().filter_map(|(place, own)| {
                let error = own.standard_error()?;
                Some([at(*place, own.mean - error), at(*place, own.mean + error)])
            });
            let color = color(slot);
            marks.push(Mark { points: means.clone(), color, look: Look::Line(&[]) });
            marks.push(Mark { points: bars.flatten().collect(), color, look: Look::Bars });
            marks.push(Mark { points: means, color, look: marker(slot) });
            if let Some(least) = &self.least[idx] {
                let ring = vec![at(least.at, least.value.mean)];
                marks.push(Mark { points: ring, color: INK, look: Look::Marker(Shape::Ring) });
            }
            key.push(key_entry(slot, series::name(self.study, &group.shared)));
        }
        key.extend(series::further(&slots));
        let panel = log_panel(label(&axis.name, &x), label(self.measure, &y), marks);
        sheet(None, key, &[panel], (760.0, 440.0), 1)
    }

    /// Places of minima over another axis, a series for each combination of the others.
    fn moves(&self, over: usize) -> String {
        let (axis, along) = (&self.study.axes[self.axis], &self.study.axes[over]);
        let mut courses: Vec<Course> = Vec::new();
        for (group, least) in self.groups.iter().zip(&self.least) {
            let own = group.shared.iter().find(|(idx, _)| *idx == over).and_then(|(_, value)| *value);
            let (Some(own), Some(least)) = (own.filter(|own| *own > 0.0), least) else { continue };
            // Axes that go together with this one are not what tells courses apart.
            let is_apart = |(idx, _): &&(usize, _)| self.study.axes[*idx].group != along.group;
            let shared: Vec<_> = group.shared.iter().filter(is_apart).copied().collect();
            match courses.iter_mut().find(|(known, _)| *known == shared) {
                Some((_, course)) => course.push((own, *least)),
                None => courses.push((shared, vec![(own, *least)])),
            }
        }
        let all = || courses.iter().flat_map(|(_, course)| course);
        let x = shown(&along.unit, all().map(|(own, _)| *own).fold(0.0, f64::max));
        let y = shown(&axis.unit, all().map(|(_, least)| least.from_to.1).fold(0.0, f64::max));
        let at = |x_at: f64, y_at: f64| (x_at / x.factor, y_at / y.factor);
        let (mut marks, mut key) = (Vec::new(), Vec::new());
        let slots = series::slots(courses.len());
        for ((shared, course), slot) in courses.iter_mut().zip(&slots) {
            let Some(slot) = *slot else { continue };
            course.sort_by(|a, b| a.0.total_cmp(&b.0));
            let color = color(slot);
            let line: Vec<(f64, f64)> =
                course.iter().map(|(own, least)| at(*own, least.between.unwrap_or(least.at))).collect();
            let bars =
                course.iter().flat_map(|(own, least)| [at(*own, least.from_to.0), at(*own, least.from_to.1)]);
            marks.push(Mark { points: bars.collect(), color, look: Look::Bars });
            marks.push(Mark { points: line.clone(), color, look: Look::Line(&[]) });
            marks.push(Mark { points: line, color, look: marker(slot) });
            key.push(key_entry(slot, series::name(self.study, shared)));
        }
        let panel =
            log_panel(label(&along.name, &x), format!("{} where it is least", label(&axis.name, &y)), marks);
        sheet(None, key, &[panel], (760.0, 400.0), 1)
    }

    fn minima(&self) -> String {
        let unit = &self.study.axes[self.axis].unit;
        let row = |(group, least): (&Series, &Option<Least>)| {
            let mut cells = vec![series::name(self.study, &group.shared)];
            match least {
                Some(least) => {
                    let between = least.between.map(|place| with_unit(place, unit));
                    let ends = (with_unit(least.from_to.0, unit), with_unit(least.from_to.1, unit));
                    let error =
                        least.value.standard_error().map(|error| format!(" ± {}", with_unit(error, "1")));
                    cells.push(with_unit(least.at, unit));
                    cells.push(between.unwrap_or_else(|| "an end of the range".to_owned()));
                    cells.push(format!("{} … {}", ends.0, ends.1));
                    let measure = &self.study.columns[self.column].unit;
                    cells.push(with_unit(least.value.mean, measure) + &error.unwrap_or_default());
                }
                None => cells.extend(["–", "–", "–", "–"].map(str::to_owned)),
            }
            cells
        };
        let rows: Vec<_> = self.groups.iter().zip(&self.least).take(MOST_ROWS).map(row).collect();
        let more = match self.groups.len().saturating_sub(MOST_ROWS) {
            0 => String::new(),
            n => paragraph(&format!("{n} more series stand in the CSV file.")),
        };
        let at = format!("least at {}", self.study.axes[self.axis].name);
        table(&["series", &at, "between points", "as good", self.measure], &rows) + &more
    }

    fn minima_csv(&self) -> String {
        let study = self.study;
        let shared: Vec<usize> =
            self.groups.first().map_or_else(Vec::new, |group| group.shared.iter().map(|s| s.0).collect());
        let name = &study.axes[self.axis].name;
        let mut heads: Vec<String> = vec!["series".to_owned()];
        heads.extend(shared.iter().map(|axis| study.axes[*axis].name.clone()));
        heads.extend(["at", "between", "from", "to"].map(|ending| format!("{name}.{ending}")));
        heads.extend(["mean", "standard_error"].map(|ending| format!("{}.{ending}", self.measure)));
        heads.push("is_at_end".to_owned());
        let mut csv = Csv::new(&heads);
        for (group, least) in self.groups.iter().zip(&self.least) {
            let mut cells = vec![series::name(study, &group.shared)];
            cells.extend(group.shared.iter().map(|(_, value)| number(*value)));
            let of = |part: &dyn Fn(&Least) -> Option<f64>| number(least.as_ref().and_then(part));
            cells.push(of(&|least| Some(least.at)));
            cells.push(of(&|least| least.between));
            cells.push(of(&|least| Some(least.from_to.0)));
            cells.push(of(&|least| Some(least.from_to.1)));
            cells.push(of(&|least| least.value.mean()));
            cells.push(of(&|least| least.value.standard_error()));
            cells.push(least.map_or_else(String::new, |least| least.between.is_none().to_string()));
            csv.row(cells);
        }
        csv.text
    }
}

/// The least of points in the order of their places.
///
/// - Equation: the vertex of `y = a + b x + c x²` through three points, of `x = ln place`, `y = ln mean`.
/// - Symbols: the least point and its neighbours; as good are means with `Δ ≤ 2 √(e₁² + e₂²)`, e standard errors.
/// - Range: no vertex where the least point is the first or the last one.
/// - Source: quadratic interpolation, R. P. Brent 1973, "Algorithms for Minimization without Derivatives", ch. 5.
/// - Shape: one place and one value.
fn least(points: &[(f64, Moments)]) -> Option<Least> {
    let (idx, (at, value)) = points.iter().enumerate().min_by(|a, b| a.1.1.mean.total_cmp(&b.1.1.mean))?;
    let error = |moments: &Moments| moments.standard_error().unwrap_or(0.0);
    let is_as_good = |(_, other): &&(f64, Moments)| {
        let squares = error(value) * error(value) + error(other) * error(other);
        other.mean - value.mean <= AS_GOOD * squares.sqrt()
    };
    let good = points.iter().filter(is_as_good).map(|(place, _)| *place);
    let from_to = good.fold((*at, *at), |(low, high), place| (low.min(place), high.max(place)));
    let around = idx.checked_sub(1).and_then(|before| Some((points.get(before)?, points.get(idx + 1)?)));
    let between = around.and_then(|(before, after)| {
        let (x, y) = (ln(*at), ln(value.mean));
        let (left, right) = (x - ln(before.0), ln(after.0) - x);
        let (down, up) = (ln(before.1.mean) - y, ln(after.1.mean) - y);
        let bend = down * right + up * left;
        let shift = (down * right * right - up * left * left) / (2.0 * bend);
        (bend > 0.0).then(|| exp(x + shift))
    });
    Some(Least { at: *at, between, value: *value, from_to })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn moments(values: &[f64]) -> Moments {
        let mut moments = Moments::default();
        values.iter().for_each(|value| moments.add(*value));
        moments
    }

    /// y = 2 (x/3)^(ln(x/3)): a parabola in logarithms with its vertex at 3.
    #[test]
    fn the_vertex_of_a_parabola_is_found() {
        let y = |x: f64| 2.0 * exp(ln(x / 3.0) * ln(x / 3.0));
        let points: Vec<_> = [0.5, 1.0, 2.0, 5.0, 9.0].map(|x| (x, moments(&[y(x)]))).to_vec();
        let found = least(&points).unwrap();
        assert_eq!(found.at, 2.0);
        assert!((found.between.unwrap() - 3.0).abs() < 1e-12);
    }

    #[test]
    fn at_an_end_there_is_no_vertex() {
        let points: Vec<_> = [1.0, 2.0, 4.0].map(|x| (x, moments(&[x]))).to_vec();
        let found = least(&points).unwrap();
        assert_eq!((found.at, found.between), (1.0, None));
    }

    /// Means of 1.0 ± 0.1, 1.2 ± 0.1 and 3 ± 0.1: the second cannot be told from the first.
    #[test]
    fn what_cannot_be_told_apart_is_as_good() {
        let around = |mean: f64| moments(&[mean - 0.1, mean + 0.1]);
        let points = [(1.0, around(1.0)), (2.0, around(1.2)), (4.0, around(3.0))];
        assert_eq!(least(&points).unwrap().from_to, (1.0, 2.0));
    }
}
