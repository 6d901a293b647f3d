//! The statements of transport: sides, flow, dispersion, sources.
//!
//! Owns their shapes. May use the tree. It deliberately knows no physics.

use super::{Assignment, Axis, Expr, Field, Name, Range, Text};
use crate::source::Span;

#[derive(Debug, Clone, PartialEq)]
pub struct Boundary {
    /// `left`, `right`, `bottom`, `top`, `front`, `back`
    pub sides: Vec<Name>,
    /// `y = 10 m .. 20 m`: a part of the side.
    pub patch: Vec<Axis>,
    /// A catalogue name: `reflect`, `open`, `inflow`.
    pub kind: Name,
    /// `A = 1 mg/L, …`
    pub carried: Vec<Assignment>,
    /// `rate k`
    pub rate: Option<Field>,
}

#[derive(Debug, Clone, PartialEq)]
pub struct Flow {
    /// A catalogue name: `uniform`, `velocity`, `darcy`, `table`, `grid`, `modflow`.
    pub kind: Name,
    pub argument: FlowArgument,
    /// `change every 1 d`, after anything but braces.
    pub change: Option<Change>,
}

#[derive(Debug, Clone, PartialEq)]
pub enum FlowArgument {
    None,
    /// `uniform v`
    Value(Expr),
    /// `velocity = (u, v)`
    Assigned(Expr),
    /// `darcy { … }`
    Entries(Vec<DarcyEntry>),
    /// `table "field.csv" { … }`
    Files(Vec<Text>, Vec<FileEntry>),
}

/// An entry of a flow from files, by the word that it begins with.
#[derive(Debug, Clone, PartialEq)]
pub struct FileEntry {
    pub word: Name,
    pub value: FileValue,
}

#[derive(Debug, Clone, PartialEq)]
pub enum FileValue {
    /// `length [m]`
    Unit(Name),
    /// `origin (0 m, 0 m)`
    Value(Expr),
    /// `at x [m], y [m]`, `grid "model.dis.grb"`, `top RCH`
    Columns(Vec<Column>),
}

/// A column of a table, or another thing that has a name in a file.
#[derive(Debug, Clone, PartialEq)]
pub struct Column {
    pub name: Name,
    /// Whether the name stands in quotes.
    pub is_quoted: bool,
    pub unit: Option<Name>,
}

/// When a flow that changes is looked at again, or solved for again.
#[derive(Debug, Clone, PartialEq)]
pub struct Change {
    /// The word.
    pub span: Span,
    pub times: ChangeTimes,
}

#[derive(Debug, Clone, PartialEq)]
pub enum ChangeTimes {
    /// `change at 30 d, 60 d`
    At(Vec<Expr>),
    /// `change every 1 d`
    Every(Expr),
}

#[derive(Debug, Clone, PartialEq)]
pub struct DarcyEntry {
    /// The word that it begins with.
    pub word: Span,
    pub kind: DarcyKind,
}

#[derive(Debug, Clone, PartialEq)]
pub enum DarcyKind {
    /// `head left 101 m, right 100 m`
    Head(Vec<(Name, Expr)>),
    /// `flux bottom 1 mm/d`
    Flux(Vec<(Name, Expr)>),
    NoFlow(Vec<Name>),
    Periodic(Vec<Name>),
    /// A value, an expression of the place, or a call such as `lognormal(…)`.
    Conductivity(Expr),
    Anisotropy(Expr),
    Well(Box<Well>),
    /// `grid 400 x 160`
    Grid(Vec<Expr>),
    Change(Change),
}

/// `well pump at (50 m, 30 m) rate -3 m^3/d screen 2 m .. 8 m`, `… carrying S = 5 mg/L`
#[derive(Debug, Clone, PartialEq)]
pub struct Well {
    pub name: Name,
    pub at: Expr,
    pub rate: Option<Expr>,
    pub screen: Option<Range>,
    pub carrying: Vec<Assignment>,
}

#[derive(Debug, Clone, PartialEq)]
pub enum Dispersion {
    /// A scalar, a tuple (diagonal) or a tuple of tuples (tensor).
    Value(Expr),
    /// `longitudinal a, transverse b, molecular m`, in the order written.
    Parts(Vec<Field>),
}

#[derive(Debug, Clone, PartialEq)]
pub struct Source {
    pub name: Name,
    pub carried: Vec<Assignment>,
    /// `point`, `box`, `gaussian`, `line`, or the name of a table; with dots for one of a used scene.
    pub region: Name,
    pub arguments: Vec<RegionArgument>,
    pub during: Option<Range>,
}

#[derive(Debug, Clone, PartialEq)]
pub enum RegionArgument {
    Range(Range),
    Value(Expr),
}
