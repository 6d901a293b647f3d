//! `ro-crate-metadata.json`: where the results come from, in words that archives and workflow portals
//! read.
//!
//! Owns the shape: a Workflow Run Crate 0.5 over RO-Crate 1.1. May use `sweep` and the edition of the
//! language. It deliberately asks neither the clock nor the machine: whoever calls tells what is known, and
//! but for hours and hosts equal runs give equal bytes.
//!
//! Source: Leo et al., Recording provenance of workflow runs with RO-Crate, PLoS ONE 19 (2024) e0309210

use super::calendar::iso_moment;
use super::sweep::{SWEEP_FILE, SweepDescription};
use crate::syntax::EDITION;
use serde::Deserialize;
use serde_json::{Value, json};

/// Its name in the folder of results.
pub const CRATE_FILE: &str = "ro-crate-metadata.json";

const RO_CRATE: &str = "https://w3id.org/ro/crate/1.1";
const WORKFLOW: &str = "https://w3id.org/workflowhub/workflow-ro-crate/1.0";
/// Identifier, name and version of the profiles of the root.
const PROFILES: [(&str, &str, &str); 3] = [
    ("https://w3id.org/ro/wfrun/process/0.5", "Process Run Crate", "0.5"),
    ("https://w3id.org/ro/wfrun/workflow/0.5", "Workflow Run Crate", "0.5"),
    (WORKFLOW, "Workflow RO-Crate", "1.0"),
];
const BIOSCHEMAS_WORKFLOW: &str = "https://bioschemas.org/profiles/ComputationalWorkflow/1.0-RELEASE";
const BIOSCHEMAS_PARAMETER: &str = "https://bioschemas.org/profiles/FormalParameter/1.0-RELEASE";
const SCENE: &str = "scene.lam";
const PLAN: &str = "plan.yaml";
const RUN: &str = "#run";
const LICENSE: &str = "#license";
const LANGUAGE: &str = "#lamella-language";

/// Starts of the program that know the same of their surroundings.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Start {
    /// Version of Lamella.
    pub version: String,
    /// Of the first of them, microseconds since 1970, UTC.
    pub started: i64,
    /// What was known of machine, compiler and repository, by name.
    pub facts: Vec<(String, String)>,
}

impl Start {
    /// Starts that differ in nothing but the hour become one; the order is that of their hours.
    pub fn merged(mut list: Vec<Self>) -> Vec<Self> {
        list.sort_by_key(|start| start.started);
        let mut merged: Vec<Self> = Vec::new();
        for start in list {
            let is_known = |other: &Self| other.version == start.version && other.facts == start.facts;
            if !merged.iter().any(is_known) {
                merged.push(start);
            }
        }
        merged
    }
}

/// All that a crate tells.
pub struct Provenance<'a> {
    pub scene_name: &'a str,
    pub title: Option<&'a str>,
    pub citations: &'a [String],
    pub plan_hash: &'a str,
    /// Nothing for a single run.
    pub sweep: Option<&'a SweepDescription>,
    /// `--set name=value`, as typed.
    pub settings: &'a [(String, String)],
    pub seed: u64,
    pub starts: &'a [Start],
    /// Of the replicates in the tables, microseconds since 1970, UTC.
    pub started: Option<i64>,
    pub finished: Option<i64>,
    /// Why the results are not what the scene asks for, if they are not.
    pub failure: Option<String>,
    /// Further files of the results, relative to their folder; a name that ends in `/` is a folder.
    pub files: Vec<String>,
}

impl Provenance<'_> {
    /// With a line break at the end.
    pub fn to_json(&self) -> Result<String, String> {
        let crate_ = json!({ "@context": format!("{RO_CRATE}/context"), "@graph": self.graph() });
        let text = serde_json::to_string_pretty(&crate_);
        text.map(|text| text + "\n").map_err(|reason| format!("{CRATE_FILE} cannot be written: {reason}"))
    }

    fn graph(&self) -> Vec<Value> {
        let inputs = self.inputs();
        let results = self.results();
        let mut graph = vec![self.descriptor(), self.root(&results), self.workflow(&inputs)];
        graph.push(self.action(&inputs, &results));
        graph.extend(self.organizing());
        for (parameter, value) in inputs {
            graph.extend(parameter);
            graph.push(value);
        }
        let files = [PLAN].into_iter().chain(results.iter().map(String::as_str));
        graph.extend(files.map(file));
        graph.push(json!({
            "@id": LANGUAGE,
            "@type": "ComputerLanguage",
            "name": "Lamella scenario language",
            "version": EDITION.to_string(),
        }));
        graph.push(json!({
            "@id": LICENSE,
            "@type": "CreativeWork",
            "name": "No licence is stated",
            "description": "The scene states no licence for its results: whoever made them decides.",
        }));
        graph.extend(PROFILES.map(|(id, name, version)| {
            json!({ "@id": id, "@type": "CreativeWork", "name": name, "version": version })
        }));
        for (idx, text) in self.citations.iter().enumerate() {
            graph.push(json!({ "@id": citation(idx), "@type": "CreativeWork", "name": text }));
        }
        graph
    }

    fn descriptor(&self) -> Value {
        json!({
            "@id": CRATE_FILE,
            "@type": "CreativeWork",
            "about": reference("./"),
            "conformsTo": [reference(RO_CRATE), reference(WORKFLOW)],
        })
    }

    fn root(&self, results: &[String]) -> Value {
        let parts = [SCENE, PLAN].into_iter().chain(results.iter().map(String::as_str));
        let cited = (0..self.citations.len()).map(|idx| reference(&citation(idx)));
        let mut root = json!({
            "@id": "./",
            "@type": "Dataset",
            "name": self.name(),
            "description": format!("{}, run by Lamella.", self.what()),
            "datePublished": iso_moment(self.finished.unwrap_or_else(|| self.first_start())),
            "license": reference(LICENSE),
            "conformsTo": PROFILES.map(|(id, ..)| reference(id)),
            "hasPart": list(parts.map(reference)),
            "mainEntity": reference(SCENE),
            "mentions": reference(RUN),
        });
        if !self.citations.is_empty() {
            root["citation"] = list(cited);
        }
        root
    }

    fn name(&self) -> String {
        let scene = self.title.unwrap_or(self.scene_name);
        self.sweep.map_or_else(|| scene.to_owned(), |sweep| format!("{scene}: sweep {}", sweep.name))
    }

    fn what(&self) -> String {
        let scene = self.scene_name;
        match self.sweep {
            Some(sweep) => {
                format!("{} points of the sweep `{}` of the scene `{scene}`", sweep.n_points, sweep.name)
            }
            None => format!("The scene `{scene}`"),
        }
    }

    fn first_start(&self) -> i64 {
        self.starts.iter().map(|start| start.started).min().unwrap_or(0)
    }

    /// The scene is the workflow; its version is the hash of what it means.
    fn workflow(&self, inputs: &[(Option<Value>, Value)]) -> Value {
        let parameters = inputs.iter().filter_map(|(parameter, _)| parameter.as_ref());
        json!({
            "@id": SCENE,
            "@type": ["File", "SoftwareSourceCode", "ComputationalWorkflow"],
            "name": self.scene_name,
            "description": "the scene, letter by letter",
            "conformsTo": reference(BIOSCHEMAS_WORKFLOW),
            "encodingFormat": "text/plain",
            "programmingLanguage": reference(LANGUAGE),
            "version": self.plan_hash,
            "input": list(parameters.map(|parameter| json!({ "@id": parameter["@id"] }))),
        })
    }

    fn action(&self, inputs: &[(Option<Value>, Value)], results: &[String]) -> Value {
        let objects = inputs.iter().map(|(_, value)| json!({ "@id": value["@id"] }));
        let mut action = json!({
            "@id": RUN,
            "@type": "CreateAction",
            "name": format!("Run of {}", self.name()),
            "description": self.what(),
            "instrument": reference(SCENE),
            "object": list(objects.chain([reference(PLAN)])),
            "result": list(results.iter().map(|name| reference(name))),
            "startTime": iso_moment(self.started.unwrap_or_else(|| self.first_start())),
            "endTime": iso_moment(self.finished.unwrap_or_else(|| self.first_start())),
            "actionStatus": "http://schema.org/CompletedActionStatus",
        });
        if let Some(failure) = &self.failure {
            action["actionStatus"] = json!("http://schema.org/FailedActionStatus");
            action["error"] = json!(failure);
        }
        action
    }

    /// The program and what it knew of its surroundings when it was started.
    fn organizing(&self) -> Vec<Value> {
        let mut entities = Vec::new();
        for (idx, start) in self.starts.iter().enumerate() {
            let own = |name: &str| format!("#start-{idx}-{}", name.replace(' ', "-"));
            let program = format!("#lamella-{}", start.version);
            let facts = start.facts.iter().map(|(name, _)| reference(&own(name)));
            entities.push(json!({
                "@id": format!("#start-{idx}"),
                "@type": "OrganizeAction",
                "name": format!("Lamella {} started", start.version),
                "instrument": reference(&program),
                "result": reference(RUN),
                "startTime": iso_moment(start.started),
                "additionalProperty": list(facts),
            }));
            entities.extend(start.facts.iter().map(|(name, value)| {
                json!({ "@id": own(name), "@type": "PropertyValue", "name": name, "value": value })
            }));
            if self.starts[..idx].iter().all(|other| other.version != start.version) {
                entities.push(json!({
                    "@id": program,
                    "@type": "SoftwareApplication",
                    "name": "Lamella",
                    "softwareVersion": start.version,
                }));
            }
        }
        entities
    }

    /// What went into the run: each axis as a parameter of the workflow with its values, then settings
    /// and the seed, which the scene does not declare.
    fn inputs(&self) -> Vec<(Option<Value>, Value)> {
        let axes = self.sweep.iter().flat_map(|sweep| &sweep.axes).map(|axis| {
            let (parameter, value) = (format!("#axis-{}", axis.name), format!("#values-{}", axis.name));
            let formal = json!({
                "@id": parameter,
                "@type": "FormalParameter",
                "conformsTo": reference(BIOSCHEMAS_PARAMETER),
                "name": axis.name,
                "additionalType": "Number",
                "valueRequired": true,
                "workExample": reference(&value),
            });
            let values = json!({
                "@id": value,
                "@type": "PropertyValue",
                "name": axis.name,
                "value": list(axis.values.iter().map(|value| json!(value))),
                "unitText": axis.unit,
                "exampleOfWork": reference(&parameter),
            });
            (Some(formal), values)
        });
        let plain = |id: String, name: &str, value: &str| {
            (None, json!({ "@id": id, "@type": "PropertyValue", "name": name, "value": value }))
        };
        let settings = self.settings.iter().enumerate();
        let settings = settings.map(|(idx, (name, value))| plain(format!("#setting-{idx}"), name, value));
        // As text: readers of JSON keep 53 bits of a number.
        let seed = plain("#seed".to_owned(), "seed", &self.seed.to_string());
        axes.chain(settings).chain([seed]).collect()
    }

    fn results(&self) -> Vec<String> {
        let sweep = self.sweep.map(|_| SWEEP_FILE.to_owned());
        self.files.iter().cloned().chain(sweep).collect()
    }
}

fn reference(id: &str) -> Value {
    json!({ "@id": id })
}

/// RO-Crate asks for a plain value instead of a list of one.
fn list(values: impl Iterator<Item = Value>) -> Value {
    let mut values: Vec<Value> = values.collect();
    if values.len() == 1 { values.remove(0) } else { Value::Array(values) }
}

fn citation(idx: usize) -> String {
    format!("#citation-{idx}")
}

/// A file or folder of the results.
fn file(name: &str) -> Value {
    let description = match name {
        PLAN => "what was run: SI, every default explicit, the hash of the plan, texts of used scenes",
        SWEEP_FILE => "axes, replicates, reports and expectations of the sweep",
        "points.parquet" => "a row for each point and replicate: seed, status, times, measures, errors",
        "columns.parquet" => "what every column means, with its unit",
        "manifest.json" => "size and BLAKE3 of every table when it was made",
        "report.html" => "figures and numbers on one page",
        "report/" => "the numbers of the figures",
        "journal/" => "all replicates as they ended; the tables are made from it",
        _ => "results in long format",
    };
    if name.ends_with('/') {
        return json!({ "@id": name, "@type": "Dataset", "name": name, "description": description });
    }
    let format = match name.rsplit('.').next() {
        Some("parquet") => "application/vnd.apache.parquet",
        Some("yaml") => "application/yaml",
        Some("json") => "application/json",
        Some("html") => "text/html",
        Some("svg") => "image/svg+xml",
        _ => "application/octet-stream",
    };
    json!({
        "@id": name,
        "@type": "File",
        "name": name,
        "description": description,
        "encodingFormat": format,
    })
}

/// The parts of an entity that tell of a start; everything else may change its shape.
#[derive(Deserialize)]
struct Entity {
    #[serde(rename = "@id", default)]
    id: String,
    #[serde(default)]
    name: Value,
    #[serde(default)]
    value: Value,
}

/// Names and values of the facts of all starts, in the order of the text; nothing of a text that is no
/// crate.
pub fn facts(text: &str) -> Vec<(String, String)> {
    #[derive(Deserialize)]
    struct Crate {
        #[serde(rename = "@graph")]
        graph: Vec<Entity>,
    }
    let graph = serde_json::from_str::<Crate>(text).map(|found| found.graph).unwrap_or_default();
    let of_start = graph.into_iter().filter(|entity| entity.id.starts_with("#start-"));
    let fact = |entity: Entity| Some((entity.name.as_str()?.to_owned(), entity.value.as_str()?.to_owned()));
    of_start.filter_map(fact).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn start(hour: i64, host: &str) -> Start {
        let facts = vec![("host".to_owned(), host.to_owned()), ("compiler".to_owned(), "rustc 1".to_owned())];
        Start { version: "1.2.3".to_owned(), started: hour * 3_600_000_000, facts }
    }

    #[test]
    fn a_fact_that_is_written_is_read() {
        let starts = Start::merged(vec![start(3, "b"), start(2, "a"), start(1, "b")]);
        assert_eq!(starts, [start(1, "b"), start(2, "a")]);
        let provenance = Provenance {
            scene_name: "column",
            title: None,
            citations: &[],
            plan_hash: "ab",
            sweep: None,
            settings: &[],
            seed: u64::MAX,
            starts: &starts,
            started: Some(1),
            finished: Some(2),
            failure: None,
            files: vec!["points.parquet".to_owned()],
        };
        let text = provenance.to_json().unwrap();
        let expected = [("host", "b"), ("compiler", "rustc 1"), ("host", "a"), ("compiler", "rustc 1")];
        assert_eq!(facts(&text), expected.map(|(name, value)| (name.to_owned(), value.to_owned())));
        assert_eq!(facts("no crate"), []);
    }

    /// Every `@id` that an entity names is that of another entity, or a word of a vocabulary.
    #[test]
    fn references_lead_somewhere() {
        let starts = [start(1, "a")];
        let cited = ["one".to_owned(), "two".to_owned()];
        let set = [("v".to_owned(), "2 m/s".to_owned())];
        let provenance = Provenance {
            scene_name: "column",
            title: Some("A column"),
            citations: &cited,
            plan_hash: "ab",
            sweep: None,
            settings: &set,
            seed: 1,
            starts: &starts,
            started: None,
            finished: None,
            failure: Some("1 replicate failed".to_owned()),
            files: vec!["points.parquet".to_owned(), "report/".to_owned()],
        };
        let graph = provenance.graph();
        let ids: Vec<&str> = graph.iter().filter_map(|entity| entity["@id"].as_str()).collect();
        let mut named = Vec::new();
        graph.iter().for_each(|entity| named_ids(entity, true, &mut named));
        let words = [RO_CRATE, BIOSCHEMAS_WORKFLOW];
        let lost: Vec<_> = named.iter().filter(|id| !ids.contains(id) && !words.contains(id)).collect();
        assert!(lost.is_empty() && named.len() > 20, "{lost:?} of {}", named.len());
        let distinct: std::collections::BTreeSet<_> = ids.iter().collect();
        assert_eq!(distinct.len(), ids.len(), "{ids:?}");
    }

    fn named_ids<'a>(value: &'a Value, is_top: bool, found: &mut Vec<&'a str>) {
        match value {
            Value::Object(fields) => {
                found.extend(fields.get("@id").and_then(Value::as_str).filter(|_| !is_top));
                fields.values().for_each(|value| named_ids(value, false, found));
            }
            Value::Array(list) => list.iter().for_each(|value| named_ids(value, false, found)),
            _ => {}
        }
    }
}
