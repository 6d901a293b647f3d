//! Where the numbers come from: scene, plan, versions, machines, hours, seeds; and what was left out.
//!
//! Owns how these are listed. May use the footer, `plan.yaml` and the crate. It deliberately asks neither the
//! clock nor the machine: the same folder gives the same page.

use super::super::calendar::moment;
use super::super::sweep::SweepDescription;
use super::html::{paragraph, table, verbatim};
use super::quantity::with_unit;
use super::study::Study;
use crate::table::Footer;
use serde::Deserialize;
use std::fmt::Display;

/// Letters of the scene that a page holds.
const MOST_TEXT: usize = 200_000;

/// The parts of `plan.yaml` that a report shows; everything else may change its shape.
#[derive(Debug, Default, Deserialize)]
pub struct PlanText {
    #[serde(default)]
    pub left_out: Vec<LeftOut>,
    #[serde(default)]
    settings: Vec<Setting>,
}

#[derive(Debug, Deserialize)]
pub struct LeftOut {
    what: String,
    why: String,
}

#[derive(Debug, Deserialize)]
struct Setting {
    name: String,
    value: String,
}

impl PlanText {
    /// Nothing of a text that is no plan.
    pub fn read(text: &str) -> Self {
        serde_yaml::from_str(text).unwrap_or_default()
    }
}

pub fn omissions(plan: &PlanText) -> String {
    if plan.left_out.is_empty() {
        return paragraph("Nothing was left out.");
    }
    let rows: Vec<_> =
        plan.left_out.iter().map(|entry| vec![entry.what.clone(), entry.why.clone()]).collect();
    table(&["left out", "because"], &rows)
}

/// What the files of a folder tell beside its tables.
pub struct Origin<'a> {
    pub footer: &'a Footer,
    pub sweep: Option<&'a SweepDescription>,
    pub plan: &'a PlanText,
    /// Of machine, compiler and repository, as they stand in the crate.
    pub facts: &'a [(String, String)],
}

pub fn provenance(study: &Study, origin: &Origin) -> String {
    let Origin { footer, sweep, plan, .. } = *origin;
    let mut rows: Vec<Vec<String>> = Vec::new();
    let mut row = |name: &str, value: String| {
        if !value.is_empty() {
            rows.push(vec![name.to_owned(), value]);
        }
    };
    let facts = &study.circumstances;
    row("scene", footer.scene.name.clone());
    row("sweep", sweep.map(|sweep| sweep.name.clone()).unwrap_or_default());
    row("plan hash", footer.plan.hash.clone());
    row("Lamella", joined(&facts.versions));
    row("numerics", joined(&facts.numerics));
    row("host", joined(&facts.hosts));
    row("threads", joined(&facts.threads));
    for (name, values) in distinct(origin.facts) {
        row(name, values.join("; "));
    }
    row("first started", facts.first_started.map(moment).unwrap_or_default());
    row("last finished", facts.last_finished.map(moment).unwrap_or_default());
    let common = if sweep.is_some_and(|sweep| sweep.has_common_random_numbers) {
        ", common random numbers for all points"
    } else {
        ""
    };
    row("root seed", format!("{}{common}", sweep.map_or(footer.seed, |sweep| sweep.seed)));
    if sweep.is_some() {
        let more = facts.n_seeds.saturating_sub(facts.seeds.len() as u64);
        let more = if more > 0 { format!(" and {more} more in points.parquet") } else { String::new() };
        row("seeds", format!("{}{more}", facts.seeds.join(", ")));
    }
    for setting in &plan.settings {
        row("setting", format!("{} = {}", setting.name, setting.value));
    }
    for citation in &footer.scene.citations {
        row("cites", citation.clone());
    }
    let mut html = table(&["", ""], &rows);
    if !footer.parameters.is_empty() {
        html += "<h3>Parameters of the scene</h3>\n";
        let one = |parameter: &crate::table::FooterParameter| {
            vec![
                parameter.name.clone(),
                with_unit(parameter.value, &parameter.unit),
                parameter.doc.clone().unwrap_or_default(),
            ]
        };
        let rows: Vec<_> = footer.parameters.iter().map(one).collect();
        html += &table(&["name", "value", "meaning"], &rows);
    }
    html + "<h3>The scene</h3>\n" + &verbatim(&footer.scene.text, MOST_TEXT)
}

/// Facts by name with their different values, both as they first come; host and threads stand in the
/// table of points, too, and are told from there.
fn distinct(facts: &[(String, String)]) -> Vec<(&str, Vec<&str>)> {
    let mut list: Vec<(&str, Vec<&str>)> = Vec::new();
    for (name, value) in facts.iter().filter(|(name, _)| !["host", "threads"].contains(&name.as_str())) {
        match list.iter_mut().find(|(other, _)| other == name) {
            Some((_, values)) if values.contains(&value.as_str()) => {}
            Some((_, values)) => values.push(value),
            None => list.push((name, vec![value])),
        }
    }
    list
}

fn joined<T: Display>(values: &std::collections::BTreeSet<T>) -> String {
    values.iter().map(T::to_string).collect::<Vec<_>>().join(", ")
}
