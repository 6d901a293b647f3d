//! Convergence: a measure against each axis, with the order of a power law.
//!
//! Owns the choice of series and fits. May use `study`, `stats`, `series`. It deliberately judges no
//! expectation: `sweep.json` brings the outcome.

use super::super::color::{FAINT, INK};
use super::super::figure::sheet;
use super::super::panel::{KeyEntry, Look, Mark};
use super::super::sweep::{ExpectedOrder, SweepDescription, SweepReport};
use super::along::{self, Drawn, places};
use super::csv::{Csv, number};
use super::html::{escape, figure, paragraph, table};
use super::quantity::{self, interval, label, shown};
use super::series::{self, Series, color, key_entry, log_panel, marker};
use super::stats::{Slope, fit};
use super::study::Study;
use crate::maths::scalar::{exp, ln};

/// Series whose orders are listed on the page.
const MOST_ROWS: usize = 30;

/// A measure against an axis.
struct Course<'a> {
    study: &'a Study,
    measure: &'a str,
    column: usize,
    axis: usize,
    groups: Vec<Series<'a>>,
    /// Of each series, and of all with one slope.
    fits: Vec<Option<Slope>>,
    common: Option<Slope>,
    expected: Option<&'a ExpectedOrder>,
}

/// The body of a section, and its tables.
pub fn convergence(
    study: &Study,
    sweep: &SweepDescription,
    report: &SweepReport,
) -> (String, Vec<(String, String)>) {
    along::against(study, report, "convergence", |column, axis| {
        let orders = sweep.expectations.iter().filter_map(|expectation| expectation.order.as_ref());
        let name = &study.axes[axis].name;
        let is_mine = |order: &&ExpectedOrder| order.measure == report.measure && order.axis == *name;
        let course = Course::new(study, &report.measure, column, axis, orders.into_iter().find(is_mine));
        let (html, table) = (course.html(), ("orders", course.orders_csv()));
        Drawn { html, groups: course.groups, table }
    })
}

impl<'a> Course<'a> {
    fn new(
        study: &'a Study,
        measure: &'a str,
        column: usize,
        axis: usize,
        expected: Option<&'a ExpectedOrder>,
    ) -> Self {
        let groups = along::courses(study, axis);
        let logs: Vec<Vec<(f64, f64)>> = groups
            .iter()
            .map(|group| places(group, axis, column).map(|(x, y)| (ln(x), ln(y.mean))).collect())
            .collect();
        let fits = logs.iter().map(|points| fit(std::slice::from_ref(points))).collect();
        Self { study, measure, column, axis, groups, fits, common: fit(&logs), expected }
    }

    fn html(&self) -> String {
        let axis = &self.study.axes[self.axis];
        let heading = format!("<h3>{} against {}</h3>\n", escape(self.measure), escape(&axis.name));
        if self.groups.iter().all(|group| places(group, self.axis, self.column).next().is_none()) {
            return heading + &paragraph("No point has both numbers, each above zero.");
        }
        let caption = format!(
            "Mean of each point over its replicates with its standard error, on logarithmic axes; lines are \
             power laws fitted to each series. The order is the slope of ln({}) by ln({}), ± its 95 % \
             confidence interval (Student t over the residuals of the fit).",
            self.measure, axis.name
        );
        heading + &figure(&self.drawing(), &caption) + &self.verdict() + &self.orders()
    }

    fn drawing(&self) -> String {
        let axis = &self.study.axes[self.axis];
        let all = || self.groups.iter().flat_map(|group| places(group, self.axis, self.column));
        let x = shown(&axis.unit, all().map(|(x, _)| x).fold(0.0, f64::max));
        let y = shown(&self.study.columns[self.column].unit, all().map(|(_, y)| y.mean).fold(0.0, f64::max));
        let (mut marks, mut key) = self.guide((x.factor, y.factor));
        let slots = series::slots(self.groups.len());
        let pale = self.groups.iter().zip(&slots).filter(|(_, slot)| slot.is_none());
        let pale = pale.flat_map(|(group, _)| places(group, self.axis, self.column));
        marks
            .push(series::faint_mark(pale.map(|(at, y_at)| (at / x.factor, y_at.mean / y.factor)).collect()));
        for (idx, group) in self.groups.iter().enumerate() {
            let Some(slot) = slots[idx] else { continue };
            marks.extend(self.series_marks(idx, slot, (x.factor, y.factor)));
            let order = self.fits[idx].as_ref().map(|fit| interval(fit.slope, fit.half_width));
            let order = order.map(|order| format!("order {order}"));
            let name = Some(series::name(self.study, &group.shared)).filter(|name| !name.is_empty());
            let text: Vec<String> = name.into_iter().chain(order).collect();
            key.push(key_entry(slot, text.join(": ")));
        }
        key.extend(series::further(&slots));
        let panel = log_panel(label(&axis.name, &x), label(self.measure, &y), marks);
        sheet(None, key, &[panel], (760.0, 440.0), 1)
    }

    /// The fit, the error bars and the means of a series, in the units of the axes.
    fn series_marks(&self, idx: usize, slot: usize, factors: (f64, f64)) -> Vec<Mark> {
        let color = color(slot);
        let mine = || places(&self.groups[idx], self.axis, self.column);
        let at = |x: f64, y: f64| (x / factors.0, y / factors.1);
        let bars = mine().filter_map(|(x, moments)| {
            let error = moments.standard_error()?;
            Some([at(x, moments.mean - error), at(x, moments.mean + error)])
        });
        let means = mine().map(|(x, moments)| at(x, moments.mean));
        let fit = self.fits[idx].as_ref();
        let line = fit.map(|fit| line(fit, mine().map(|(x, _)| x), factors)).unwrap_or_default();
        vec![
            Mark { points: line, color, look: Look::Line(&[]) },
            Mark { points: bars.flatten().collect(), color, look: Look::Bars },
            Mark { points: means.collect(), color, look: marker(slot) },
        ]
    }

    /// The expected slopes through the middle of the points: the wedge between the ends of the range, and
    /// its middle as a broken line.
    fn guide(&self, factors: (f64, f64)) -> (Vec<Mark>, Vec<KeyEntry>) {
        let logs: Vec<(f64, f64)> = self
            .groups
            .iter()
            .flat_map(|group| places(group, self.axis, self.column))
            .map(|(x, y)| (ln(x / factors.0), ln(y.mean / factors.1)))
            .collect();
        let (Some(expected), false) = (self.expected, logs.is_empty()) else { return Default::default() };
        let n = logs.len() as f64;
        let middle =
            (logs.iter().map(|log| log.0).sum::<f64>() / n, logs.iter().map(|log| log.1).sum::<f64>() / n);
        let first = logs.iter().map(|log| log.0).fold(f64::INFINITY, f64::min);
        let last = logs.iter().map(|log| log.0).fold(f64::NEG_INFINITY, f64::max);
        let at = |x: f64, slope: f64| (exp(x), exp(middle.1 + slope * (x - middle.0)));
        let ExpectedOrder { low, high, .. } = expected;
        let wedge = vec![
            at(first, *low),
            at(middle.0, *low),
            at(last, *low),
            at(last, *high),
            at(middle.0, *high),
            at(first, *high),
        ];
        let slope = 0.5 * (low + high);
        let look = Look::Line(&[6.0, 4.0]);
        let text = format!("expected order {} … {}", quantity::number(*low), quantity::number(*high));
        let marks = vec![
            Mark { points: wedge, color: FAINT, look: Look::Band },
            Mark { points: vec![at(first, slope), at(last, slope)], color: INK, look },
        ];
        (marks, vec![KeyEntry { text, color: INK, look }])
    }

    /// One sentence on the order of all series together.
    fn verdict(&self) -> String {
        let Some(common) = &self.common else {
            return paragraph("There are too few different values for an order.");
        };
        let mut text = format!("Common order of all series: {}", interval(common.slope, common.half_width));
        if let Some(expected) = self.expected {
            let half = common.half_width.unwrap_or(0.0);
            let (low, high) = (common.slope - half, common.slope + half);
            let how = if low >= expected.low && high <= expected.high {
                "lies in"
            } else if low <= expected.high && high >= expected.low {
                "reaches into"
            } else {
                "lies outside of"
            };
            let range = format!("{} … {}", quantity::number(expected.low), quantity::number(expected.high));
            text += &format!("; its interval {how} the expected {range}");
        }
        paragraph(&(text + "."))
    }

    fn orders(&self) -> String {
        if self.groups.len() < 2 {
            return String::new();
        }
        let row = |(group, fit): (&Series, &Option<Slope>)| {
            let order = fit.as_ref().map(|fit| interval(fit.slope, fit.half_width));
            let n = places(group, self.axis, self.column).count();
            vec![
                series::name(self.study, &group.shared),
                n.to_string(),
                order.unwrap_or_else(|| "too few points".to_owned()),
            ]
        };
        let rows: Vec<_> = self.groups.iter().zip(&self.fits).take(MOST_ROWS).map(row).collect();
        let more = match self.groups.len().saturating_sub(MOST_ROWS) {
            0 => String::new(),
            n => paragraph(&format!("{n} more series stand in the CSV file.")),
        };
        table(&["series", "points", "order ± 95 %"], &rows) + &more
    }

    /// A row per series and one for all; values of the series' axes are empty there.
    fn orders_csv(&self) -> String {
        let study = self.study;
        let shared: Vec<usize> =
            self.groups.first().map_or_else(Vec::new, |group| group.shared.iter().map(|s| s.0).collect());
        let mut heads: Vec<String> = vec!["series".to_owned()];
        heads.extend(shared.iter().map(|axis| study.axes[*axis].name.clone()));
        heads.extend(
            ["points", "order", "order_low", "order_high", "expected_low", "expected_high"]
                .map(str::to_owned),
        );
        let mut csv = Csv::new(&heads);
        let mut row = |series: String, values: Vec<Option<f64>>, fit: &Option<Slope>| {
            let ends =
                fit.as_ref().and_then(|fit| fit.half_width.map(|half| (fit.slope - half, fit.slope + half)));
            let mut cells = vec![series];
            cells.extend(values.into_iter().map(number));
            cells.push(fit.as_ref().map_or(0, |fit| fit.n).to_string());
            cells.push(number(fit.as_ref().map(|fit| fit.slope)));
            cells.extend([ends.map(|ends| ends.0), ends.map(|ends| ends.1)].map(number));
            let range = self.expected.map(|expected| (expected.low, expected.high));
            cells.extend([range.map(|range| range.0), range.map(|range| range.1)].map(number));
            csv.row(cells);
        };
        for (group, fit) in self.groups.iter().zip(&self.fits) {
            let values = group.shared.iter().map(|(_, value)| *value).collect();
            row(series::name(study, &group.shared), values, fit);
        }
        row("all".to_owned(), vec![None; shared.len()], &self.common);
        csv.text
    }
}

/// The two ends of a fitted line over the places of its points.
fn line(fit: &Slope, places: impl Iterator<Item = f64>, factors: (f64, f64)) -> Vec<(f64, f64)> {
    let Some(Some(intercept)) = fit.intercepts.first() else { return Vec::new() };
    let ends = places.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| (low.min(x), high.max(x)));
    let at = |x: f64| (x / factors.0, exp(intercept + fit.slope * ln(x)) / factors.1);
    vec![at(ends.0), at(ends.1)]
}
