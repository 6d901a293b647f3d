//! The mass budget: the largest relative defect of any component, per point.
//!
//! Owns one figure and one table. May use `study`. It deliberately sets no bar: what is small depends
//! on the question, and a scene may say it in an `expect`.

use super::super::color::SERIES;
use super::super::figure::sheet;
use super::super::panel::{Look, Mark, Panel};
use super::super::scale::{Scale, Spacing};
use super::csv::{Csv, number};
use super::html::{figure, paragraph};
use super::quantity;
use super::study::Study;

/// Of more points the worst of each of this many neighbours' groups is drawn.
const MOST_DOTS: usize = 1500;

pub fn budget(study: &Study) -> (String, Vec<(String, String)>) {
    let all: Vec<(u32, f64)> =
        study.points.iter().filter_map(|(number, point)| Some((*number, point.worst_defect?))).collect();
    let Some(worst) = study.worst_defect else {
        return (paragraph("No point tells of its mass."), Vec::new());
    };
    let mut heads: Vec<String> = vec!["point".to_owned()];
    heads.extend(study.axes.iter().map(|axis| axis.name.clone()));
    heads.push("worst_mass_defect".to_owned());
    let mut csv = Csv::new(&heads);
    for (point_number, point) in &study.points {
        let mut cells = vec![point_number.to_string()];
        cells.extend(point.axes.iter().map(|value| number(*value)));
        cells.push(number(point.worst_defect));
        csv.row(cells);
    }
    let place = match (study.points.len(), worst.value > 0.0) {
        (2.., true) => format!(" (point {}, replicate {})", worst.point, worst.replicate),
        _ => String::new(),
    };
    let value = quantity::number(worst.value);
    let text = format!("The largest relative mass defect of any component is {value}{place}.");
    let mut body = paragraph(&text);
    if all.len() > 1 {
        let n_zero = all.iter().filter(|(_, defect)| *defect == 0.0).count();
        let zero = match n_zero {
            0 => String::new(),
            n => format!(" {n} of {} points have none at all, and no mark.", all.len()),
        };
        if n_zero < all.len() {
            let caption = format!("The worst of the replicates of each point.{zero}");
            body += &figure(&drawing(&all), &caption);
        }
    }
    (body, vec![("mass_budget.csv".to_owned(), csv.text)])
}

fn drawing(all: &[(u32, f64)]) -> String {
    let every = all.len().div_ceil(MOST_DOTS).max(1);
    let worst = |group: &[(u32, f64)]| group.iter().copied().max_by(|a, b| a.1.total_cmp(&b.1));
    let dots: Vec<(f64, f64)> =
        all.chunks(every).filter_map(worst).map(|(point, defect)| (f64::from(point), defect)).collect();
    let last = all.last().map_or(1.0, |(point, _)| f64::from(*point));
    let panel = Panel {
        title: String::new(),
        x_label: "point (number)".to_owned(),
        y_label: "worst mass defect (–)".to_owned(),
        x: Scale { low: -0.03 * last - 0.2, high: 1.03 * last + 0.2, spacing: Spacing::Linear },
        y: Scale::covering(dots.iter().map(|dot| dot.1), Spacing::Log),
        marks: vec![Mark { points: dots, color: SERIES[0], look: Look::Dots }],
        heat: None,
        key: Vec::new(),
        notes: Vec::new(),
    };
    sheet(None, Vec::new(), &[panel], (760.0, 260.0), 1)
}
