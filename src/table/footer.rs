//! What every file says of itself: key `lamella`, JSON of `docs/schema/footer-1.json`.
//!
//! Owns the footer's shape and its version. May use `plan`. It deliberately holds nothing of the
//! machine, the path or the hour: a footer is a function of scene and plan.

use super::record::Record;
use super::schema::Column;
use super::unit::{exponent, si_text, value_dimension};
use crate::plan::{OutputKind, Plan, Quantity};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Keys in the file's metadata.
pub const KEY: &str = "lamella";
/// pandas shows this as `DataFrame.attrs`.
pub const PANDAS_KEY: &str = "PANDAS_ATTRS";
pub const VERSION: u32 = 1;

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Footer {
    /// Version of this shape.
    pub version: u32,
    /// Kind of table: `profile`, `points`, ….
    pub table: String,
    pub scene: Scene,
    pub plan: PlanIdentity,
    pub seed: u64,
    pub parameters: Vec<Parameter>,
    pub species: Vec<Species>,
    pub axes: Vec<Axis>,
    pub outputs: Vec<Output>,
    pub columns: Vec<ColumnText>,
    pub versions: Versions,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Scene {
    pub name: String,
    pub title: Option<String>,
    pub citations: Vec<String>,
    pub text: String,
    /// Files of numbers that the scene reads.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub data: Vec<Data>,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Data {
    /// From the folder of the scene.
    pub name: String,
    /// BLAKE3 of the bytes.
    pub hash: String,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PlanIdentity {
    pub hash: String,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Parameter {
    pub name: String,
    pub value: f64,
    pub unit: String,
    /// Exponents of m, kg, s, mol, K, A, cd.
    pub dimension: [f64; 7],
    pub doc: Option<String>,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Species {
    pub name: String,
    pub unit: String,
    pub doc: Option<String>,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Axis {
    pub name: String,
    pub low: f64,
    pub high: f64,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Output {
    pub kind: String,
    /// A species, or two for a pair.
    pub quantities: Vec<Vec<String>>,
    /// Bins per active axis.
    pub bins: Vec<usize>,
    pub n_times: usize,
    /// As the scene asks; absent is SI.
    pub unit: Option<String>,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ColumnText {
    pub name: String,
    pub unit: String,
    pub doc: String,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Versions {
    pub lamella: String,
    pub numerics: u32,
}

impl Footer {
    pub fn new(
        table: &str,
        plan: &Plan,
        record: &Record,
        columns: &[Column],
        row_unit: Option<&str>,
    ) -> Self {
        Self {
            version: VERSION,
            table: table.to_owned(),
            scene: Scene {
                name: record.scene_name.clone(),
                title: record.title.clone(),
                citations: record.citations.clone(),
                text: record.scene_text.clone(),
                data: record
                    .data
                    .iter()
                    .map(|(name, hash)| Data { name: name.clone(), hash: hash.clone() })
                    .collect(),
            },
            plan: PlanIdentity { hash: record.plan_hash.clone() },
            seed: plan.seed,
            parameters: parameters(record),
            species: species(plan, record),
            axes: axes(plan),
            outputs: outputs(plan),
            columns: columns
                .iter()
                .map(|column| ColumnText {
                    name: column.name.clone(),
                    unit: column.unit_text(row_unit),
                    doc: column.doc.clone(),
                })
                .collect(),
            versions: Versions { lamella: record.version.clone(), numerics: plan.numerics },
        }
    }

    /// The pairs to store, in the order they are stored.
    pub fn key_values(&self) -> Vec<(String, String)> {
        let units: BTreeMap<&str, &str> = self
            .columns
            .iter()
            .filter(|column| !column.unit.is_empty())
            .map(|column| (column.name.as_str(), column.unit.as_str()))
            .collect();
        let parameters: BTreeMap<&str, f64> =
            self.parameters.iter().map(|parameter| (parameter.name.as_str(), parameter.value)).collect();
        let attributes = serde_json::json!({
            "table": self.table,
            "scene": self.scene.name,
            "title": self.scene.title,
            "plan_hash": self.plan.hash,
            "seed": self.seed,
            "lamella": self.versions.lamella,
            "units": units,
            "parameters": parameters,
        });
        let own = serde_json::json!(self);
        vec![(KEY.to_owned(), own.to_string()), (PANDAS_KEY.to_owned(), attributes.to_string())]
    }
}

fn parameters(record: &Record) -> Vec<Parameter> {
    let one = |parameter: &super::record::Parameter| Parameter {
        name: parameter.name.clone(),
        value: parameter.value_si,
        unit: parameter.unit.clone(),
        dimension: parameter.dimension.0.map(exponent),
        doc: parameter.doc.clone(),
    };
    record.parameters.iter().map(one).collect()
}

fn species(plan: &Plan, record: &Record) -> Vec<Species> {
    let one = |(idx, species): (usize, &crate::plan::Species)| Species {
        name: species.name.clone(),
        unit: si_text(value_dimension(plan, OutputKind::Profile, Quantity::Species(idx), 0)),
        doc: doc_of(record, &species.name).map(str::to_owned),
    };
    plan.species.iter().enumerate().map(one).collect()
}

/// The quoted text of a species.
pub fn doc_of<'a>(record: &'a Record, species: &str) -> Option<&'a str> {
    record.species_docs.iter().find(|(name, _)| name == species).map(|(_, doc)| doc.as_str())
}

fn axes(plan: &Plan) -> Vec<Axis> {
    let name = |idx: usize| ["x", "y", "z"].get(idx).copied().unwrap_or("?").to_owned();
    plan.axes.iter().map(|axis| Axis { name: name(axis.index), low: axis.low, high: axis.high }).collect()
}

fn outputs(plan: &Plan) -> Vec<Output> {
    let one = |output: &crate::plan::Output| Output {
        kind: super::Kind::from(output.kind).name().to_owned(),
        quantities: output.quantities.iter().map(|quantity| names(plan, *quantity)).collect(),
        bins: output.bins.clone(),
        n_times: output.times.len(),
        unit: output.unit.as_ref().map(|unit| unit.text.clone()),
    };
    plan.outputs.iter().map(one).collect()
}

/// The species of a quantity by name: one, or two of a pair.
pub fn names(plan: &Plan, quantity: Quantity) -> Vec<String> {
    let name = |idx: usize| plan.species.get(idx).map_or_else(String::new, |species| species.name.clone());
    match quantity {
        Quantity::Species(s) => vec![name(s)],
        Quantity::Pair(a, b) => vec![name(a), name(b)],
    }
}
