//! The flow of a scene that other programs wrote.
//!
//! Owns the way from what a scene says of its files to a flow on the domain. May use the readers, the plan's words and
//! its tapes. It deliberately opens no file: bytes are among the sources.

use super::read::axes::{ACROSS, on_axes};
use super::read::modflow6::{self, Files, Settings, Side};
use super::read::table::{self, Column, Layout, Rows};
use super::read::window::{Extent, placed, within};
use super::read::{Kind, Quantity, ReadError, csv, npy, parquet};
use super::{Balance, FaceFlow};
use crate::plan::tape::Tape;
use crate::plan::transport::{
    FileColumn, FileForm, FlowFacts, FlowFile, ModflowForm, Outlet, TableForm, Velocity,
};
use std::sync::Arc;

/// A flow and what a plan is told of it.
#[derive(Debug, Clone, PartialEq)]
pub struct Loaded {
    pub flow: Arc<FaceFlow>,
    pub facts: FlowFacts,
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
    let (flow, outlets) = match &file.form {
        FileForm::Table(form) => (table(form, bytes[0], setting).map_err(of_first)?, Vec::new()),
        FileForm::Arrays(form) => (arrays(form, bytes, setting)?, Vec::new()),
        FileForm::Modflow(form) => modflow(form, bytes, setting).map_err(of_first)?,
    };
    let flow = within(flow, setting.axes).map_err(of_first)?;
    let facts = facts(&flow, setting.axes, outlets);
    Ok(Loaded { flow: Arc::new(flow), facts })
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

/// The flow, and names of what takes water out by owner.
fn modflow(
    form: &ModflowForm,
    bytes: &[&[u8]],
    setting: &Setting,
) -> Result<(FaceFlow, Vec<Outlet>), ReadError> {
    let sides: Vec<(String, Side)> = form
        .sides
        .iter()
        .map(|(name, side)| (name.clone(), Side { axis: side / 2, is_upper: side % 2 == 1 }))
        .collect();
    let moved = |place: [f64; 3]| [0, 1, 2].map(|axis| place[axis] + form.origin[axis]);
    let porosity = |_: usize, place: [f64; 3]| setting.porosity_at(moved(place));
    let settings = Settings { length: form.length, time: form.time, porosity: &porosity, sides: &sides };
    let files = Files { budget: bytes[0], grid: bytes[1], heads: bytes.get(2).copied() };
    let series = modflow6::read(files, &settings)?;
    let n_steps = series.periods.len();
    let mut periods = series.periods.into_iter();
    let (Some(period), None) = (periods.next(), periods.next()) else {
        let message = format!("the budget file has {n_steps} time steps, and a flow that is read is steady");
        return Err(ReadError::new(Kind::Unsupported, message).help("save the budget of one time step"));
    };
    let names: Vec<Outlet> =
        period
            .packages
            .iter()
            .enumerate()
            // Water that is stored stays where it is, with all that it carries.
            .filter(|(_, package)| !package.kind.starts_with("STO"))
            .map(|(owner, package)| {
                let name = if package.name.is_empty() { &package.kind } else { &package.name };
                Outlet { name: name.clone(), owner }
            })
            .chain((0..3).map(|axis| Outlet {
                name: format!("across_{}", ["x", "y", "z"][axis]),
                owner: ACROSS + axis,
            }))
            .collect();
    let keep: Vec<usize> = setting.axes.iter().map(|&(index, ..)| index).collect();
    let mut flow = period.flow;
    flow.cells = flow.cells.moved(form.origin).ok_or_else(|| {
        ReadError::new(Kind::Mismatch, "the corner of the grid lies too far away for its cells")
    })?;
    Ok((placed(on_axes(flow, &keep)?, setting.axes)?, names))
}

/// What a plan is told of a flow.
fn facts(flow: &FaceFlow, axes: &[Extent], known: Vec<Outlet>) -> FlowFacts {
    let n = flow.cells.n();
    let mut outlets: Vec<Outlet> = Vec::new();
    for mut outlet in known {
        if flow.sinks.iter().any(|sink| sink.owner == outlet.owner && sink.rate > 0.0) {
            while outlets.iter().any(|other| other.name == outlet.name) {
                outlet.name.push('_');
            }
            outlets.push(outlet);
        }
    }
    let Balance { worst_of_through_flow, worst_divergence, rms_divergence, .. } = flow.balance();
    let finite = |value: f64| if value.is_finite() { value } else { f64::MAX };
    FlowFacts {
        cells: axes.iter().map(|&(index, ..)| n[index]).collect(),
        speed: finite(speed(flow)),
        outlets,
        missing: finite(worst_of_through_flow),
        divergence: [finite(worst_divergence), finite(rms_divergence)],
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
