//! The flow of a scene that other programs wrote.
//!
//! Owns the way from what a scene says of its files to a flow on the domain. May use the readers, the plan's words and
//! its tapes. It deliberately opens no file: bytes are among the sources.

use super::read::axes::{ACROSS, on_axes};
use super::read::modflow6::{self, Files, Settings, Side};
use super::read::table::{self, Column, Layout, Rows};
use super::read::window::{Extent, placed, within};
use super::read::{Kind, Quantity, ReadError, csv, npy, parquet};
use super::series::Period;
use super::{Balance, FaceFlow, FlowSeries};
use crate::plan::tape::Tape;
use crate::plan::transport::{
    FileColumn, FileForm, FlowFacts, FlowFile, ModflowForm, Outlet, TableForm, Velocity,
};
use std::sync::Arc;

/// A flow and what a plan is told of it.
#[derive(Debug, Clone, PartialEq)]
pub struct Loaded {
    pub flows: FlowSeries,
    pub facts: FlowFacts,
    /// What a budget lists besides.
    pub packages: Vec<Listed>,
}

/// A package of a budget over all time steps.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Listed {
    /// As `WEL`.
    pub kind: String,
    pub name: String,
    /// The most cells that it lists in a time step.
    pub n_cells: usize,
    /// Some of its water goes through a face.
    pub has_faces: bool,
    /// Sides of the domain, two per axis x, y, z, that all of its cells touch.
    pub touches: [bool; 6],
}

/// What is wrong, and with which file.
#[derive(Debug, Clone, PartialEq)]
pub struct Trouble {
    pub file: usize,
    pub error: ReadError,
}

/// What a flow knows only from the scene.
pub struct Setting<'a> {
    pub axes: &'a [Extent],
    /// Over x, y, z and the time.
    pub porosity: &'a Tape,
}

impl Setting<'_> {
    fn porosity_at(&self, place: [f64; 3]) -> f64 {
        self.porosity.evaluate(&[place[0], place[1], place[2], 0.0])
    }

    /// A place along the axes of the domain as one along x, y and z.
    fn place(&self, own: [f64; 3]) -> [f64; 3] {
        let mut place = [0.5; 3];
        self.axes.iter().zip(own).for_each(|(&(index, ..), at)| place[index] = at);
        place
    }

    fn corners(&self) -> ([f64; 3], [f64; 3]) {
        let (mut low, mut high) = ([0.0; 3], [1.0; 3]);
        for (own, &(_, from, to)) in self.axes.iter().enumerate() {
            (low[own], high[own]) = (from, to);
        }
        (low, high)
    }
}

/// Reads the flow of files whose bytes are given in their order.
pub fn read(file: &FlowFile, bytes: &[&[u8]], setting: &Setting) -> Result<Loaded, Trouble> {
    if bytes.len() != file.files.len() {
        return Err(Trouble {
            file: 0,
            error: ReadError::new(Kind::Missing, "a file of the flow is not there"),
        });
    }
    let of_first = |error| Trouble { file: 0, error };
    let (flows, names) = match &file.form {
        FileForm::Table(form) => {
            (vec![(0.0, table(form, bytes[0], setting).map_err(of_first)?)], Names::default())
        }
        FileForm::Arrays(form) => (vec![(0.0, arrays(form, bytes, setting)?)], Names::default()),
        FileForm::Modflow(form) => modflow(form, bytes, setting).map_err(of_first)?,
    };
    let mut periods = Vec::new();
    for (from, flow) in flows {
        let flow = Arc::new(within(flow, setting.axes).map_err(of_first)?);
        periods.push(Period { from, flow });
    }
    let flows = FlowSeries::new(periods).map_err(|error| {
        let error =
            ReadError::new(Kind::Unsupported, format!("the time steps do not follow one another: {error}"));
        of_first(error.help("layers whose water table moves hold another amount of water in each step"))
    })?;
    let packages = names.0.clone();
    let outlets = if matches!(file.form, FileForm::Modflow(_)) { names.outlets() } else { Vec::new() };
    let facts = facts(&flows, setting.axes, outlets);
    Ok(Loaded { flows, facts, packages })
}

fn table(form: &TableForm, bytes: &[u8], setting: &Setting) -> Result<FaceFlow, ReadError> {
    let column = |column: &FileColumn| Column::new(&column.name, column.factor);
    let quantity = quantity(form.is_discharge);
    let rows = match (&form.normal, form.flow.first()) {
        (Some(normal), Some(q)) => Rows::Faces { normal: normal.clone(), q: column(q) },
        _ => Rows::Centres { q: form.flow.iter().map(column).collect(), quantity },
    };
    let layout = Layout {
        at: form.at.iter().map(column).collect(),
        rows,
        porosity: form.porosity.as_ref().map(column),
        head: form.head.as_ref().map(column),
        conductivity: form.conductivity.as_ref().map(column),
    };
    let porosity = |_: usize, own: [f64; 3]| setting.porosity_at(setting.place(own));
    let frame = table::Frame { bounds: Some(setting.corners()), porosity: &porosity };
    let flow = match form.is_parquet {
        true => parquet::flow(bytes.to_vec(), &layout, &frame),
        false => csv::flow(bytes, &layout, &frame),
    };
    placed(flow?, setting.axes)
}

fn quantity(is_discharge: bool) -> Quantity {
    if is_discharge { Quantity::Discharge } else { Quantity::PoreVelocity }
}

fn arrays(form: &Velocity, bytes: &[&[u8]], setting: &Setting) -> Result<FaceFlow, Trouble> {
    let mut arrays = Vec::new();
    for (file, bytes) in bytes.iter().enumerate() {
        arrays.push(npy::array(bytes).map_err(|error| Trouble { file, error })?);
    }
    let (low, high) = setting.corners();
    let porosity = |_: usize, own: [f64; 3]| setting.porosity_at(setting.place(own));
    let frame = npy::Frame {
        low,
        high,
        axes: setting.axes.len(),
        factor: form.factor,
        quantity: quantity(form.is_discharge),
        porosity: &porosity,
    };
    // On a line the one array may be that of the faces or of the middles: its entry says which.
    let flow = match &arrays[..] {
        [array] if setting.axes.len() > 1 || !form.is_discharge => npy::centred(array, &frame),
        all => npy::staggered(all, &frame),
    };
    flow.and_then(|flow| placed(flow, setting.axes)).map_err(|error| Trouble { file: 0, error })
}

/// Flows and when they begin, s.
type Timed = Vec<(f64, FaceFlow)>;

/// The flows of a budget, and its packages by owner.
fn modflow(form: &ModflowForm, bytes: &[&[u8]], setting: &Setting) -> Result<(Timed, Names), ReadError> {
    let sides: Vec<(String, Side)> = form
        .sides
        .iter()
        .map(|(name, side)| (name.clone(), Side { axis: side / 2, is_upper: side % 2 == 1 }))
        .collect();
    let moved = |place: [f64; 3]| [0, 1, 2].map(|axis| place[axis] + form.origin[axis]);
    let porosity = |_: usize, place: [f64; 3]| setting.porosity_at(moved(place));
    let settings = Settings { length: form.length, time: form.time, porosity: &porosity, sides: &sides };
    let files = Files { budget: bytes[0], grid: bytes[1], heads: bytes.get(2).copied() };
    let keep: Vec<usize> = setting.axes.iter().map(|&(index, ..)| index).collect();
    let mut names = Names::default();
    let mut flows = Vec::new();
    // A side of the grid is one of the domain only where both lie at one place.
    let mut sides_in_common = [false; 6];
    for mut period in modflow6::read(files, &settings)?.periods {
        names.enter(&mut period);
        let mut flow = period.flow;
        flow.cells = flow.cells.moved(form.origin).ok_or_else(|| {
            ReadError::new(Kind::Mismatch, "the corner of the grid lies too far away for its cells")
        })?;
        for &(axis, low, high) in setting.axes {
            let edges = &flow.cells.edges()[axis];
            let is_one = |edge: f64, end: f64| (edge - end).abs() <= 1e-6 * (high - low);
            sides_in_common[2 * axis] = is_one(edges[0], low);
            sides_in_common[2 * axis + 1] = is_one(edges[edges.len() - 1], high);
        }
        flows.push((period.start, placed(on_axes(flow, &keep)?, setting.axes)?));
    }
    for package in &mut names.0 {
        package.touches.iter_mut().zip(sides_in_common).for_each(|(own, is_one)| *own &= is_one);
    }
    Ok((flows, names))
}

/// Packages of all time steps, in the order in which they come up.
#[derive(Default)]
struct Names(Vec<Listed>);

impl Names {
    /// Gives the sinks of a time step owners that are the same in all of them.
    fn enter(&mut self, period: &mut modflow6::Period) {
        let mut owner_of = Vec::new();
        for package in &period.packages {
            let is_it = |own: &Listed| own.kind == package.kind && own.name == package.name;
            let known = self.0.iter().position(is_it).unwrap_or(self.0.len());
            owner_of.push(known);
            let has_faces = package.through_faces != 0.0;
            match self.0.get_mut(known) {
                Some(own) => {
                    own.n_cells = own.n_cells.max(package.n_cells);
                    own.has_faces |= has_faces;
                    own.touches.iter_mut().zip(package.touches).for_each(|(own, other)| *own &= other);
                }
                None => self.0.push(Listed {
                    kind: package.kind.clone(),
                    name: package.name.clone(),
                    n_cells: package.n_cells,
                    has_faces,
                    touches: package.touches,
                }),
            }
        }
        for sink in &mut period.flow.sinks {
            sink.owner = owner_of.get(sink.owner).copied().unwrap_or(sink.owner);
        }
    }

    fn outlets(self) -> Vec<Outlet> {
        let across = (0..3)
            .map(|axis| Outlet { name: format!("across_{}", ["x", "y", "z"][axis]), owner: ACROSS + axis });
        let packages = self.0.into_iter().enumerate();
        packages
            // Water that is stored stays where it is, with all that it carries.
            .filter(|(_, own)| !own.kind.starts_with("STO"))
            .map(|(owner, own)| Outlet { name: if own.name.is_empty() { own.kind } else { own.name }, owner })
            .chain(across)
            .collect()
    }
}

/// What a plan is told of flows: of several the fastest, and the one that keeps its water worst.
fn facts(flows: &FlowSeries, axes: &[Extent], known: Vec<Outlet>) -> FlowFacts {
    let all: Vec<&FaceFlow> = flows.periods().iter().map(|period| &*period.flow).collect();
    let n = flows.flow(0).cells.n();
    let takes = |outlet: &Outlet| {
        all.iter().flat_map(|flow| &flow.sinks).any(|sink| sink.owner == outlet.owner && sink.rate > 0.0)
    };
    let mut outlets: Vec<Outlet> = Vec::new();
    for mut outlet in known.into_iter().filter(takes) {
        while outlets.iter().any(|other| other.name == outlet.name) {
            outlet.name.push('_');
        }
        outlets.push(outlet);
    }
    let balances: Vec<Balance> = all.iter().map(|flow| flow.balance()).collect();
    let finite = |value: f64| if value.is_finite() { value } else { f64::MAX };
    let worst = |of: fn(&Balance) -> f64| balances.iter().map(|own| finite(of(own))).fold(0.0, f64::max);
    FlowFacts {
        cells: axes.iter().map(|&(index, ..)| n[index]).collect(),
        speed: all.iter().map(|flow| finite(speed(flow))).fold(0.0, f64::max),
        outlets,
        missing: worst(|own| own.worst_of_through_flow),
        divergence: [worst(|own| own.worst_divergence), worst(|own| own.rms_divergence)],
        changes: flows.changes(),
    }
}

/// Root mean square of the pore velocity in the middles of cells.
///
/// - Equation: `v = √(Σ Σ_i ((q_low + q_high)/2φ)² / n)`.
/// - Symbols: `q` discharge through the two faces along each axis, φ porosity, `n` cells with pores.
/// - Range: any flow; 0 without pores.
/// - Source: definition.
/// - Shape: one number.
fn speed(flow: &FaceFlow) -> f64 {
    let (mut sum, mut count) = (0.0, 0.0_f64);
    for (cell, &porosity) in flow.porosity.iter().enumerate().filter(|(_, porosity)| **porosity > 0.0) {
        let place = flow.cells.place(cell);
        for axis in 0..3 {
            let (low, high) = flow.cells.faces(axis, place);
            let v = 0.5 * (flow.flux[axis][low] + flow.flux[axis][high]) / porosity;
            sum += v * v;
        }
        count += 1.0;
    }
    (sum / count.max(1.0)).sqrt()
}
