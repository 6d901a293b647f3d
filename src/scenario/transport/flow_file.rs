//! What a scene says of a flow in files of other programs.
//!
//! Owns the types, which a plan holds as they are. May use nothing of the scenario. It deliberately holds no number of
//! a file: hashes say which bytes are meant.

use serde::{Deserialize, Serialize};

/// Files, and what is in them.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FlowFile {
    pub form: FileForm,
    pub files: Vec<NamedFile>,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct NamedFile {
    /// As the scene writes it.
    pub name: String,
    /// BLAKE3 of its bytes.
    pub hash: String,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum FileForm {
    /// One file of rows.
    Table(Box<TableForm>),
    /// One NPY array at the middles of cells, or one for the faces normal to each axis.
    Arrays(Velocity),
    /// Budget, binary grid file, and heads if there is a third file.
    Modflow(ModflowForm),
}

/// What the numbers of a flow are.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Velocity {
    /// Water per area of the medium; else its velocity in the pores.
    pub is_discharge: bool,
    /// m/s of one of the file's units.
    pub factor: f64,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TableForm {
    /// Else text with commas.
    pub is_parquet: bool,
    /// Per axis of the domain.
    pub at: Vec<FileColumn>,
    /// The column that says which way a face looks; without it rows are middles of cells.
    pub normal: Option<String>,
    /// Per axis, or one of faces.
    pub flow: Vec<FileColumn>,
    pub is_discharge: bool,
    pub porosity: Option<FileColumn>,
    pub head: Option<FileColumn>,
    pub conductivity: Option<FileColumn>,
}

/// A column and what one of its unit is in SI.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FileColumn {
    pub name: String,
    pub factor: f64,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ModflowForm {
    /// m of the model's unit of length, …
    pub length: f64,
    /// … and s of its unit of time.
    pub time: f64,
    /// Lower left corner of the grid in the coordinates of the scene, m along x, y; and what is added to heights.
    pub origin: [f64; 3],
    /// Packages and the side, twice the axis x, y, z plus one at the upper end, through which their water goes.
    pub sides: Vec<(String, usize)>,
}

/// What is found in the files, for a plan that is made before anything moves.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FlowFacts {
    /// Cells along each axis of the domain.
    pub cells: Vec<usize>,
    /// Root mean square of the pore velocity, m/s.
    pub speed: f64,
    /// What takes water out within the domain, in the order of the sinks' owners.
    pub outlets: Vec<Outlet>,
    /// Water that appears or vanishes in the worst cell, of what flows through the domain; and …
    pub missing: f64,
    /// … the divergence that this is, relative to mean discharge over cell size: in the worst cell, and its root mean
    /// square.
    pub divergence: [f64; 2],
    /// When other flows of the files begin, s since the start of the run; none if the flow is steady.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub changes: Vec<f64>,
}

/// Something that takes water out of cells.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Outlet {
    pub name: String,
    /// The owner of its sinks.
    pub owner: usize,
}
