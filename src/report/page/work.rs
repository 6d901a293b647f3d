//! Work–precision: a measure against what it costs, and the front that nothing beats.
//!
//! Owns the choice of marks and the table of points. May use `study`, `stats`, `series`. It
//! deliberately joins no points but those of the front.

use super::super::color::INK;
use super::super::figure::sheet;
use super::super::notes::Note;
use super::super::panel::{KeyEntry, Look, Mark};
use super::super::sweep::SweepReport;
use super::csv::{Csv, number};
use super::html::{escape, figure, paragraph, table};
use super::quantity::{self, label, shown};
use super::series::{self, Series, color, key_entry, log_panel, marker, slug};
use super::stats::{Moments, pareto};
use super::study::Study;

/// Points whose names are tried beside them; beyond this only the front is named.
const MOST_NOTES: usize = 40;
/// Rows of the front on the page.
const MOST_ROWS: usize = 30;

/// A point with what it costs and gives.
struct Place {
    point: u32,
    series: usize,
    cost: Moments,
    measure: Moments,
    /// By the axes that do not tell series apart, and by all.
    note: String,
    name: String,
    is_front: bool,
}

/// The body of a section, and its tables.
pub fn work_precision(study: &Study, report: &SweepReport) -> (String, Vec<(String, String)>) {
    let mut body = String::new();
    let mut files = Vec::new();
    let Some(measure) = study.column(&report.measure) else {
        let text = format!("points.parquet has no column `{}`.", report.measure);
        return (paragraph(&text), files);
    };
    for against in &report.against {
        match study.column(against) {
            Some(cost) => {
                let name = format!("work_precision-{}-{}.csv", slug(&report.measure), slug(against));
                let names = Names { measure: &report.measure, against };
                let (html, text) = one(study, measure, cost, &names, &report.by);
                body += &html;
                files.push((name, text));
            }
            None => body += &paragraph(&format!("points.parquet has no column `{against}`.")),
        }
    }
    (body, files)
}

struct Names<'a> {
    measure: &'a str,
    against: &'a str,
}

impl Names<'_> {
    /// The cost in words.
    fn cost(&self) -> &str {
        match self.against {
            "wall_time" => "wall time",
            "cpu_time" => "CPU time",
            other => other,
        }
    }
}

fn one(study: &Study, measure: usize, cost: usize, names: &Names, by: &[String]) -> (String, String) {
    let axes: Vec<usize> = by.iter().filter_map(|name| study.axis(name)).collect();
    let groups = series::series(study, &axes);
    let places = places(study, &groups, measure, cost, &axes);
    let csv = csv(study, &places, names);
    let heading = format!("<h3>{} against {}</h3>\n", escape(names.measure), escape(names.cost()));
    if places.is_empty() {
        return (heading + &paragraph("No point has both numbers, each above zero."), csv);
    }
    let units = [&study.columns[cost].unit, &study.columns[measure].unit];
    let svg = drawing(study, &groups, &places, units, names);
    let n_front = places.iter().filter(|place| place.is_front).count();
    let others = series::other_names(study, &axes);
    let caption = format!(
        "Each mark is the mean of a point over its replicates, with its standard error; down and to the left \
         is better. The line is the Pareto front: {n_front} of {} points for which no other is both cheaper \
         and better. {}",
        places.len(),
        if others.is_empty() { String::new() } else { format!("Marks are labelled by {others}.") }
    );
    (heading + &figure(&svg, &caption) + &front(&places, units, names), csv)
}

/// Points that log axes can show, with the front marked.
fn places(study: &Study, groups: &[Series], measure: usize, cost: usize, axes: &[usize]) -> Vec<Place> {
    let mut places: Vec<Place> = Vec::new();
    for (idx, group) in groups.iter().enumerate() {
        for (number, point) in &group.points {
            let (cost, measure) = (point.values[cost], point.values[measure]);
            if cost.mean > 0.0 && measure.mean > 0.0 {
                let note = series::other_values(study, point, axes);
                let name = series::full_name(study, point);
                places.push(Place {
                    point: *number,
                    series: idx,
                    cost,
                    measure,
                    note,
                    name,
                    is_front: false,
                });
            }
        }
    }
    let numbers: Vec<_> = places.iter().map(|place| (place.cost.mean, place.measure.mean)).collect();
    pareto(&numbers).into_iter().for_each(|idx| places[idx].is_front = true);
    places
}

fn drawing(study: &Study, groups: &[Series], places: &[Place], units: [&String; 2], names: &Names) -> String {
    let largest = |of: fn(&Place) -> f64| places.iter().map(of).fold(0.0, f64::max);
    let x = shown(units[0], largest(|place| place.cost.mean));
    let y = shown(units[1], largest(|place| place.measure.mean));
    let at = |place: &Place| (place.cost.mean / x.factor, place.measure.mean / y.factor);
    let mut front: Vec<&Place> = places.iter().filter(|place| place.is_front).collect();
    front.sort_by(|a, b| a.cost.mean.total_cmp(&b.cost.mean));
    let line = front.iter().map(|place| at(place)).collect();
    let mut marks = vec![Mark { points: line, color: INK, look: Look::Line(&[]) }];
    let mut key = vec![KeyEntry { text: "Pareto front".to_owned(), color: INK, look: Look::Line(&[]) }];
    let slots = series::slots(groups.len());
    let pale = places.iter().filter(|place| slots[place.series].is_none()).map(at);
    marks.insert(0, series::faint_mark(pale.collect()));
    for (idx, group) in groups.iter().enumerate() {
        let Some(slot) = slots[idx] else { continue };
        let mine = || places.iter().filter(|place| place.series == idx);
        let bars = mine().filter_map(|place| {
            let error = place.measure.standard_error()? / y.factor;
            let (x, y) = at(place);
            Some([(x, y - error), (x, y + error)])
        });
        marks.push(Mark { points: bars.flatten().collect(), color: color(slot), look: Look::Bars });
        marks.push(Mark { points: mine().map(at).collect(), color: color(slot), look: marker(slot) });
        if !group.shared.is_empty() {
            key.push(key_entry(slot, series::name(study, &group.shared)));
        }
    }
    key.extend(series::further(&slots));
    // The front is named first, so that its names find room.
    let note = |place: &&Place| Note { at: at(place), text: place.note.clone() };
    let others = places.iter().filter(|place| !place.is_front && places.len() <= MOST_NOTES);
    let notes = front.iter().copied().chain(others).filter(|place| !place.note.is_empty());
    let mut panel = log_panel(label(names.cost(), &x), label(names.measure, &y), marks);
    panel.notes = notes.map(|place| note(&place)).collect();
    sheet(None, key, &[panel], (760.0, 460.0), 1)
}

/// The front as a table: what to take for a given precision.
fn front(places: &[Place], units: [&String; 2], names: &Names) -> String {
    let mut front: Vec<&Place> = places.iter().filter(|place| place.is_front).collect();
    front.sort_by(|a, b| a.cost.mean.total_cmp(&b.cost.mean));
    let row = |place: &&Place| {
        let error = place
            .measure
            .standard_error()
            .map_or_else(String::new, |error| format!(" ± {}", quantity::digits(error, 2)));
        vec![
            place.point.to_string(),
            place.name.clone(),
            quantity::with_unit(place.cost.mean, units[0]),
            format!("{}{error}", quantity::with_unit(place.measure.mean, units[1])),
        ]
    };
    let rows: Vec<_> = front.iter().take(MOST_ROWS).map(row).collect();
    let more = match front.len().saturating_sub(MOST_ROWS) {
        0 => String::new(),
        n => paragraph(&format!("{n} more points of the front stand in the CSV file.")),
    };
    let heads = ["point", "values", names.cost(), names.measure];
    table(&heads, &rows) + &more
}

fn csv(study: &Study, places: &[Place], names: &Names) -> String {
    let mut heads: Vec<String> = vec!["point".to_owned()];
    heads.extend(study.axes.iter().map(|axis| axis.name.clone()));
    let endings = ["n", "mean", "standard_deviation", "standard_error"];
    for name in [names.against, names.measure] {
        heads.extend(endings.map(|ending| format!("{name}.{ending}")));
    }
    heads.push("is_pareto".to_owned());
    let mut csv = Csv::new(&heads);
    for place in places {
        let mut cells = vec![place.point.to_string()];
        let axes = study.points.get(&place.point).map(|point| point.axes.as_slice()).unwrap_or_default();
        cells.extend(axes.iter().map(|value| number(*value)));
        for moments in [&place.cost, &place.measure] {
            cells.push(moments.n.to_string());
            cells.extend([moments.mean(), moments.deviation(), moments.standard_error()].map(number));
        }
        cells.push(place.is_front.to_string());
        csv.row(cells);
    }
    csv.text
}
