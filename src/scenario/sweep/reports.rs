//! What is drawn of a sweep besides what is always drawn.

use super::super::Measure;
use super::super::check::Checker;
use super::super::collect::Statements;
use super::expectations::measure_name;
use super::{Report, ReportKind, Sweep};
use crate::source::Span;
use crate::syntax::tree;

/// All reports of a scene, and whether all of them are right.
pub(in crate::scenario) fn reports(
    checker: &mut Checker<'_>,
    statements: &Statements<'_>,
    measures: &[Measure],
    sweeps: &[Sweep],
) -> (Vec<Report>, bool) {
    let mut list = Vec::new();
    for (span, written) in &statements.reports {
        list.extend(report(checker, *span, written, measures, sweeps));
    }
    let is_right = list.len() == statements.reports.len();
    (list, is_right)
}

fn report(
    checker: &mut Checker<'_>,
    span: Span,
    written: &tree::Report,
    measures: &[Measure],
    sweeps: &[Sweep],
) -> Option<Report> {
    let kinds = [
        ("work_precision", ReportKind::WorkPrecision),
        ("convergence", ReportKind::Convergence),
        ("minimum", ReportKind::Minimum),
    ];
    let kind = checker.word(&written.kind, "a report", &kinds);
    let measure = measure_name(checker, &written.measure, measures);
    let axes: Vec<&str> =
        sweeps.iter().flat_map(|s| s.groups.iter().flatten()).map(|a| a.target.name()).collect();
    let axis_words: Vec<(&str, ())> = axes.iter().map(|name| (*name, ())).collect();
    let mut against_words = axis_words.clone();
    if kind == Some(ReportKind::WorkPrecision) {
        against_words = measures.iter().map(|measure| (measure.name.as_str(), ())).collect();
        against_words.extend([("wall_time", ()), ("cpu_time", ())]);
    }
    let against: Vec<Option<()>> = written
        .against
        .iter()
        .map(|name| checker.word(name, "what a report is drawn against", &against_words))
        .collect();
    for name in &written.against {
        if let Some(entry) = checker.scope.get_mut(&name.value) {
            entry.n_uses += 1;
        }
    }
    let by: Vec<Option<()>> =
        written.by.iter().map(|name| checker.word(name, "an axis of a sweep", &axis_words)).collect();
    let are_right = against.into_iter().chain(by).all(|word| word.is_some());
    let names = |names: &[tree::Name]| names.iter().map(|name| name.value.clone()).collect();
    let (kind, measure) = (kind?, measure?);
    are_right.then(|| Report {
        span,
        kind,
        measure,
        against: names(&written.against),
        by: names(&written.by),
    })
}
