//! The tree of one `.lam` file: what was written, where, with every comment.
//!
//! Owns the shapes; `parse` builds them, `format` prints them. May use `source`.
//! It deliberately knows no physics: a unit is text here, a species is a name.

mod data;
mod kernel;
mod outputs;
mod study;
mod transport;

use crate::source::{Span, Spanned};
pub use data::{Data, DataColumn};
pub use kernel::{Estimate, EstimateEntry, EstimateValue, Kernel};
pub use outputs::{Output, Place, Times};
pub use study::{Criterion, Expect, Replicates, Report, Sweep, SweepAxis, SweepEntry, SweepValue, Use};
pub use transport::{
    Boundary, Change, ChangeTimes, Column, DarcyEntry, DarcyKind, Dispersion, FileEntry, FileValue, Flow,
    FlowArgument, RegionArgument, Source, Well,
};

/// A name with its place.
pub type Name = Spanned<String>;
/// The inside of a quoted text, escapes resolved, with the place of the whole token.
pub type Text = Spanned<String>;

/// One parsed file. `tokens` cover the text without a gap, comments and blanks included; the
/// statements refer to it by spans, so nothing of the text is lost.
#[derive(Debug, Clone, PartialEq)]
pub struct File {
    pub file: crate::source::FileId,
    pub tokens: Vec<Token>,
    /// Statements that parsed, in the order of the text. Those that did not have diagnostics.
    pub statements: Vec<Statement>,
}

/// A lexical token.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Token {
    pub kind: TokenKind,
    pub span: Span,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum TokenKind {
    /// A run of blanks without a line end.
    Blank,
    /// One line end.
    Newline,
    /// From `#` to before the line end.
    Comment,
    /// A word: letter or `_`, then letters, digits, `_`.
    Word,
    /// A number without its unit; `1_000_000`, `1.2e-2`, `3`.
    Number,
    /// A quoted text, quotes included.
    Text,
    /// Brackets, operators, commas, arrows.
    Symbol,
    /// Anything that no rule knows; always reported.
    Unknown,
}

/// One statement: from its keyword to before the line end or comment that closes it.
#[derive(Debug, Clone, PartialEq)]
pub struct Statement {
    pub span: Span,
    /// The place of the keyword.
    pub keyword: Span,
    pub kind: StatementKind,
}

/// The statements of edition 1.
#[derive(Debug, Clone, PartialEq)]
pub enum StatementKind {
    /// `lamella 1`
    Edition(Spanned<u32>),
    /// `title "…"`
    Title(Text),
    /// `cite "…", "…"`
    Cite(Vec<Text>),
    /// `seed 42`
    Seed(Spanned<u64>),
    /// `let c = 2 m "doc"`
    Let(Let),
    /// `param x = 3 d in 1 .. 10 d "doc"`
    Param(Param),
    /// `fn f(a, b) = a / (a + b)`
    Function(Function),
    /// `species A "doc", B immobile "doc"`
    Species(Vec<Species>),
    /// `reaction name: A + 2 B -> C @ instant`
    Reaction(Reaction),
    /// `chemistry tolerance 1e-6, activity davies`: settings in the order written.
    Chemistry(Vec<Field>),
    /// `domain line x = 0 m .. 1 m, frame moving v`
    Domain(Domain),
    /// `boundary left, right reflect`, `boundary left y = 1 m .. 2 m inflow A = 1 mg/L`
    Boundary(Boundary),
    /// `medium porosity 0.3`
    Medium(Vec<Field>),
    /// `flow uniform v`, `flow velocity = (u, v)`, `flow darcy { … }`
    Flow(Flow),
    /// `dispersion D`, or its parts: `dispersion longitudinal a, transverse b, molecular m`
    Dispersion(Dispersion),
    /// `source spill: A = 1 g/d at point(1 m, 2 m) during 0 .. 3 d`
    Source(Source),
    /// `mixing zones { fast: fraction 0.5, rate instant … }`
    MixingZones(Vec<Zone>),
    /// `exchange kernel gaussian, bandwidth collocation`: settings in the order written.
    Exchange(Vec<Field>),
    /// `kernel W(q) = (1 - q/2)^4 * (1 + 2*q) support 2 "doc"`
    Kernel(Kernel),
    /// `kernel gaussian adaptive { bandwidth 0.2 .. 5 m, grid 0.5 m }`
    Estimate(Estimate),
    /// `average bins 300`, `average bins 100 x 50` or `average kernel gaussian, bandwidth 2 mm`
    Average(Average),
    /// `initial A = …, B = …`
    Initial(Vec<Assignment>),
    /// `particles fluid 1_000_000 stratified`
    Particles(Particles),
    /// `run to 10 d, step 1 h`
    Run(Run),
    /// `output profile A, B at t = 1 d, 2 d`
    Output(Output),
    /// `reference NAME for TARGET = …` or `reference CATALOGUE(…) for TARGET`
    Reference(Reference),
    /// `measure err = l2(profile.A - exact) over x = 0 m .. 1 m at t = 1 d`
    Measure(Measure),
    /// `data plume = "plume.csv" (x [m], c [mg/L])`
    Data(Data),
    /// `use "column.lam" as column`
    Use(Use),
    /// `sweep NAME of SCENE { particles 1e3, 1e4 … }`
    Sweep(Sweep),
    /// `report convergence err against particles, step by chi`
    Report(Report),
}

#[derive(Debug, Clone, PartialEq)]
pub struct Let {
    pub name: Name,
    pub value: Expr,
    pub doc: Option<Text>,
}

#[derive(Debug, Clone, PartialEq)]
pub struct Param {
    pub name: Name,
    pub value: Expr,
    pub range: Option<Range>,
    pub doc: Option<Text>,
}

#[derive(Debug, Clone, PartialEq)]
pub struct Function {
    pub name: Name,
    pub parameters: Vec<Name>,
    pub body: Expr,
}

#[derive(Debug, Clone, PartialEq)]
pub struct Species {
    pub name: Name,
    /// What stands after the name (`immobile`, `charge 2`, …), resolved in `scenario`.
    pub qualifiers: Vec<Qualifier>,
    pub doc: Option<Text>,
}

/// A property of a species.
#[derive(Debug, Clone, PartialEq)]
pub struct Qualifier {
    pub name: Name,
    /// What stands after `charge` or `ion_size`.
    pub value: Option<Expr>,
}

#[derive(Debug, Clone, PartialEq)]
pub struct Reaction {
    pub name: Option<Name>,
    pub reactants: Vec<Term>,
    pub arrow: Spanned<Arrow>,
    pub products: Vec<Term>,
    pub rate: Rate,
}

/// What stands after `@`.
#[derive(Debug, Clone, PartialEq)]
pub enum Rate {
    /// One law; `instant` is a plain name here, `equilibrium(…)` a call.
    One(Expr),
    /// `forward kf, backward kb`, in the order written.
    Directions(Vec<Field>),
}

/// `2 B` or `Y B` in an equation.
#[derive(Debug, Clone, PartialEq)]
pub struct Term {
    /// A number without a unit or a name; absent means one.
    pub coefficient: Option<Expr>,
    pub species: Name,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Arrow {
    /// `->`
    Forward,
    /// `<->`
    Both,
}

#[derive(Debug, Clone, PartialEq)]
pub struct Domain {
    /// `line`, `rect`, `box`
    pub shape: Name,
    pub axes: Vec<Axis>,
    /// The velocity after `frame moving`.
    pub frame: Option<Expr>,
}

/// `x = lo .. hi`
#[derive(Debug, Clone, PartialEq)]
pub struct Axis {
    pub name: Name,
    pub range: Range,
}

/// `lo .. hi`
#[derive(Debug, Clone, PartialEq)]
pub struct Range {
    pub low: Expr,
    pub high: Expr,
}

#[derive(Debug, Clone, PartialEq)]
pub struct Zone {
    pub name: Name,
    /// `fraction e`, `rate e`, in the order written; `rate instant` has the plain name `instant`.
    pub fields: Vec<Field>,
}

/// `keyword value`
#[derive(Debug, Clone, PartialEq)]
pub struct Field {
    pub name: Name,
    pub value: Expr,
}

#[derive(Debug, Clone, PartialEq)]
pub struct Average {
    /// `bins 300`: a number each, or a dimensionless constant.
    pub bins: Option<(Name, Vec<Expr>)>,
    /// `kernel gaussian`, `bandwidth 2 mm`, …
    pub settings: Vec<Field>,
}

/// `A = …`
#[derive(Debug, Clone, PartialEq)]
pub struct Assignment {
    pub name: Name,
    pub value: Expr,
}

#[derive(Debug, Clone, PartialEq)]
pub struct Particles {
    /// `fluid`, `mass`
    pub kind: Name,
    pub count: Count,
    /// A catalogue name: `stratified`, `random`.
    pub placement: Option<Name>,
    /// `disorder 0.3`, after the placement.
    pub disorder: Option<Expr>,
}

#[derive(Debug, Clone, PartialEq)]
pub enum Count {
    /// A number, or a name of a dimensionless parameter.
    All(Expr),
    /// `A 1000, B 2000`
    Shares(Vec<Field>),
}

#[derive(Debug, Clone, PartialEq)]
pub struct Run {
    pub duration: Expr,
    pub step: Option<Expr>,
    /// Further `, word word` settings, such as `normals double`.
    pub settings: Vec<(Name, Name)>,
}

#[derive(Debug, Clone, PartialEq)]
pub struct Reference {
    /// `None` in the form `reference CATALOGUE(…) for TARGET`: the catalogue name is the name.
    pub name: Option<Name>,
    pub target: Target,
    pub value: Expr,
}

/// What a reference predicts: `AB`, `covariance A, B`, `mixing A, B`, `total AB`.
#[derive(Debug, Clone, PartialEq)]
pub struct Target {
    /// An output kind; absent means the concentration.
    pub output: Option<Name>,
    /// With dots for species of a used scene: `column.A`.
    pub species: Vec<Name>,
}

#[derive(Debug, Clone, PartialEq)]
pub struct Measure {
    pub name: Name,
    pub value: Expr,
    /// `over x = lo .. hi`
    pub over: Option<Axis>,
    /// `at t = a, b`
    pub times: Option<Vec<Expr>>,
    pub doc: Option<Text>,
}

/// An expression with its place.
#[derive(Debug, Clone, PartialEq)]
pub struct Expr {
    pub span: Span,
    pub kind: ExprKind,
}

#[derive(Debug, Clone, PartialEq)]
pub enum ExprKind {
    /// A number and, by adjacency, its unit.
    Number(Number),
    /// A name, or a dotted path such as `profile.A`.
    Path(Vec<Name>),
    /// `f(a, b)` or `f(c0 = a, D = b)`.
    Call {
        function: Name,
        arguments: Vec<Argument>,
    },
    Unary {
        operator: Spanned<UnaryOperator>,
        operand: Box<Expr>,
    },
    Binary {
        operator: Spanned<BinaryOperator>,
        left: Box<Expr>,
        right: Box<Expr>,
    },
    If {
        condition: Box<Expr>,
        then: Box<Expr>,
        otherwise: Box<Expr>,
    },
    /// `(a, b)`; a single expression in brackets is that expression.
    Tuple(Vec<Expr>),
}

/// A number as written: the digits (without `_`) and the unit text, both exact.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Number {
    pub digits: String,
    pub unit: Option<Spanned<String>>,
}

#[derive(Debug, Clone, PartialEq)]
pub struct Argument {
    pub name: Option<Name>,
    pub value: Expr,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum UnaryOperator {
    Negate,
    Not,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum BinaryOperator {
    Add,
    Subtract,
    Multiply,
    Divide,
    Power,
    Less,
    LessEqual,
    Greater,
    GreaterEqual,
    Equal,
    NotEqual,
    And,
    Or,
}
