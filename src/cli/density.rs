//! `lamella density`: from points of any table to a density on cells.

use super::density_direction;
use super::density_ends::Ends;
use super::density_points::Points;
use super::text::{duration, significant};
use super::{CommandResult, Exit, Stopped, Terminal};
use clap::ValueEnum;
use lamella::diagnostic::{Diagnostic, codes};
use lamella::engine::density::{
    Adaptive, Cell, End, Estimate, Lattice, Order, Rule, Shape, Start, Tally, Variant, Weighing, estimate,
    global, histogram,
};
use lamella::maths::wide::Width;
use lamella::table::{DensityCell, DensityTable, write_density};
use lamella::units::Unit;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// Cells, at most: density, error and four more numbers of each are in memory.
const MOST_CELLS: usize = 100_000_000;

/// Estimate a density from points of a table, with kernels of locally best size and shape
///
/// Points come from a CSV or Parquet file with a column per axis, and perhaps one of weights. Every kernel is put on the cells
/// of a lattice and keeps its mass; its size and shape follow from the density around it, found by iteration.
#[derive(clap::Args)]
pub(crate) struct Arguments {
    /// CSV or Parquet file
    pub(super) file: PathBuf,
    /// Where the cells are, per axis, such as "0..200 m, 0..80 m"
    #[arg(long, value_name = "LOW..HIGH,…", value_parser = Axis::parse, value_delimiter = ',', required = true, allow_hyphen_values = true)]
    pub(super) domain: Vec<Axis>,
    /// How many cells along each axis
    #[arg(long, value_name = "N,…", value_delimiter = ',', required = true)]
    cells: Vec<usize>,
    /// Columns of coordinates, one per axis [default: x, y, z as many as needed]
    #[arg(long, value_name = "NAME,…", value_delimiter = ',')]
    pub(super) columns: Vec<String>,
    /// Column of weights, such as masses [default: all points weigh 1]
    #[arg(long, value_name = "NAME")]
    pub(super) weight: Option<String>,
    /// Take only rows that have this in a column, such as species=A or t=10; perhaps several times
    #[arg(long = "where", value_name = "COLUMN=VALUE", value_parser = super::load::parse_setting)]
    pub(super) conditions: Vec<(String, String)>,
    /// What both ends of each axis are, one word for all or one per axis: reflect (nothing passes), periodic (both ends are one),
    /// absorb (the density is zero), "hold 2 kg/m^2" (the density has this value); "reflect:absorb" if they differ
    #[arg(long, value_name = "WORD,…", value_parser = Ends::parse, value_delimiter = ',', default_value = "reflect")]
    ends: Vec<Ends>,
    /// What every point is spread by
    #[arg(long, value_enum, default_value_t = KernelName::Adaptive)]
    kernel: KernelName,
    /// Direction that kernels are stretched along: in a plane an angle from the first axis, such as 30deg, or components per axis,
    /// such as 1,0,0.2
    #[arg(
        long,
        value_name = "ANGLE|X,…",
        value_delimiter = ',',
        allow_hyphen_values = true,
        conflicts_with = "velocity"
    )]
    pub(super) direction: Vec<String>,
    /// Columns of components, one per axis: kernels are stretched along the mean of a cell's points
    #[arg(long, value_name = "NAME,…", value_delimiter = ',')]
    pub(super) velocity: Vec<String>,
    /// Least and largest bandwidth of kernels that differ, in the unit of the domain
    #[arg(long, value_name = "LOW..HIGH", value_parser = Axis::parse)]
    bandwidth: Option<Axis>,
    /// What counts where weights differ
    #[arg(long, value_enum, default_value_t = WeighingName::All)]
    weighing: WeighingName,
    /// Of which power of bandwidths the bias is: 2, or 4, by wider kernels whose sum is put right by the points; less wrong where the
    /// density is smooth
    #[arg(long, value_name = "2|4", default_value_t = 2, value_parser = order)]
    order: u8,
    /// Relative change of a loop that ends the iteration
    #[arg(long, value_name = "X", default_value_t = 0.02)]
    tolerance: f64,
    /// Loops, at most
    #[arg(long, value_name = "N", default_value_t = 20, value_parser = clap::value_parser!(u64).range(0..=1000))]
    loops: u64,
    /// Every kernel in full, without coarse cells and rounded bandwidths: slower, the same within the error
    #[arg(long)]
    exact: bool,
    /// The formulas of the released GPKDE program with its defects, to compare; implies --exact
    #[arg(long)]
    parity: bool,
    /// Write only cells that have a density
    #[arg(long)]
    nonzero: bool,
    /// Threads [default: all cores]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..=4096))]
    threads: Option<u64>,
    /// Parquet file to write
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
}

#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
#[value(rename_all = "snake_case")]
enum KernelName {
    /// Kernels of locally best size and shape
    Adaptive,
    /// Kernels of locally best size, the same along all axes
    Round,
    /// One kernel for all, of the best size by the density's own roughness (iterated plug-in)
    PlugIn,
    /// One kernel for all, of the best size for a normal density
    NormalReference,
    /// The cell itself
    Histogram,
}

impl KernelName {
    fn word(self) -> String {
        self.to_possible_value().map_or_else(String::new, |value| value.get_name().to_owned())
    }
}

#[derive(Clone, Copy, ValueEnum)]
enum WeighingName {
    /// Weights over the effective weight of all points
    All,
    /// Weights over their mean
    Mean,
    /// Points
    Number,
    /// The effective number of points of each cell: for few points of very different weights
    Cell,
}

/// A range, and perhaps its unit.
#[derive(Debug, Clone)]
pub(super) struct Axis {
    low: f64,
    high: f64,
    pub(super) unit: Option<(String, Unit)>,
}

impl Axis {
    fn parse(text: &str) -> Result<Self, String> {
        let wrong = || format!("`{}` is no range such as 0..200 m", text.trim());
        let (low, rest) = text.trim().split_once("..").ok_or_else(wrong)?;
        let rest = rest.trim();
        // An exponent is no unit.
        let is_of_number = |(at, c): (usize, char)| {
            c.is_ascii_digit()
                || ".+-".contains(c)
                || (at > 0 && "eE".contains(c) && !rest[at + 1..].starts_with(' '))
        };
        let end = rest.char_indices().find(|&at| !is_of_number(at)).map_or(rest.len(), |(at, _)| at);
        let (high, unit) = (&rest[..end], rest[end..].trim());
        let number = |text: &str| text.trim().parse::<f64>().ok().filter(|number| number.is_finite());
        let (low, high) = number(low).zip(number(high)).ok_or_else(wrong)?;
        if low >= high {
            return Err(format!("`{}` is empty: its end is not above its beginning", text.trim()));
        }
        if unit.is_empty() {
            return Ok(Self { low, high, unit: None });
        }
        let known = Unit::parse(unit).map_err(|_| format!("`{unit}` is no unit"))?;
        Ok(Self { low, high, unit: Some((unit.to_owned(), known)) })
    }
}

fn order(text: &str) -> Result<u8, String> {
    text.parse().ok().filter(|order| [2, 4].contains(order)).ok_or_else(|| "2 or 4".to_owned())
}

pub(crate) fn run(arguments: &Arguments, terminal: &Terminal) -> CommandResult {
    let start = Instant::now();
    check(arguments)?;
    let points = Points::read(arguments)?;
    let lattice = lattice(arguments, &points)?;
    let low: Vec<f64> =
        arguments.domain.iter().zip(&points.factors).map(|(axis, factor)| axis.low * factor).collect();
    let numbers: Vec<&[f64]> = points.numbers.iter().map(|own| &own[..]).collect();
    let (coordinates, rest) = numbers.split_at(arguments.domain.len());
    let (weights, velocities) = rest.split_at(usize::from(arguments.weight.is_some()));
    let weights = weights.first().copied();
    let tally = Tally::of(&lattice, &low, coordinates, weights);
    if tally.cells.is_empty() {
        let message = Diagnostic::error(codes::F101, "no point with a weight lies within the domain");
        let help = format!("{} points are outside: look at --domain, --columns and units", tally.outside.0);
        return Err(Stopped::new(Exit::SceneWrong, message.help(help)));
    }
    let mut adaptive = adaptive(arguments, points.factors[0]);
    adaptive.orientation = density_direction::orientation(arguments, &lattice, || {
        tally.means(&lattice, &low, (coordinates, weights), velocities)
    })?;
    let estimated = Instant::now();
    let work = || spread(arguments.kernel, &lattice, &tally, &adaptive);
    let mut found = match arguments.threads {
        None => work(),
        Some(n) => rayon::ThreadPoolBuilder::new()
            .num_threads(n as usize)
            .build()
            .map_err(|error| failed(&format!("cannot start {n} threads: {error}")))?
            .install(work),
    }?;
    let seconds = estimated.elapsed().as_secs_f64();
    let error = norm(&found.standard_error) / norm(&found.density);
    let kept = found.density.iter().sum::<f64>() * lattice.volume() / tally.mass();
    // Walls that hold a value give and take.
    let kept = if arguments.ends.iter().any(Ends::holds) { 1.0 } else { kept };
    let table = tabulate(arguments, &points, (&lattice, &low), (&tally, &mut found));
    let path = write_density(&arguments.out, &table)
        .map_err(|error| Stopped::new(Exit::Failed, Diagnostic::error(codes::F103, error.to_string())))?;
    tell(
        terminal,
        &path,
        (&lattice, &tally, &found),
        (seconds, start.elapsed().as_secs_f64()),
        (error, kept),
    )?;
    Ok(Exit::Done)
}

/// What contradicts itself, before anything is read.
fn check(arguments: &Arguments) -> Result<(), Stopped> {
    if arguments.out.extension().is_none_or(|extension| extension != "parquet") {
        return Err(wrong("--out is a Parquet file: its name ends in .parquet"));
    }
    if arguments.tolerance.is_nan() || arguments.tolerance < 0.0 {
        return Err(wrong("the tolerance is a number of zero or more"));
    }
    let differ = matches!(arguments.kernel, KernelName::Adaptive | KernelName::Round);
    let idle = [
        (arguments.exact, "--exact"),
        (arguments.parity, "--parity"),
        (arguments.bandwidth.is_some(), "--bandwidth"),
    ];
    if density_direction::is_asked_for(arguments)
        && (arguments.kernel != KernelName::Adaptive || arguments.parity)
    {
        return Err(wrong("--direction and --velocity are for --kernel adaptive, without --parity"));
    }
    if let Some((_, name)) = idle.iter().find(|(is_given, _)| *is_given && !differ) {
        return Err(wrong(&format!("{name} is for kernels that differ from place to place")));
    }
    if arguments.order == 4 && (!differ || arguments.parity || arguments.ends.iter().any(Ends::is_odd)) {
        let message =
            "--order 4 is for --kernel adaptive and round, without --parity and ends that absorb or hold";
        return Err(wrong(message));
    }
    if !differ && arguments.ends.iter().any(Ends::holds) {
        return Err(wrong("--ends hold is for kernels that differ from place to place"));
    }
    let Some(first) = arguments.domain.first() else { return Ok(()) };
    let dimension = |axis: &Axis| axis.unit.as_ref().map(|(_, unit)| unit.dimension);
    if arguments.domain.iter().any(|axis| dimension(axis) != dimension(first)) {
        return Err(wrong("axes are lengths of one kind: all with units, or none"));
    }
    let of_bandwidth = arguments.bandwidth.as_ref().and_then(dimension);
    if of_bandwidth.is_some() && of_bandwidth != dimension(first) {
        return Err(wrong("--bandwidth has a unit that --domain has not"));
    }
    for (idx, name) in arguments.columns.iter().enumerate() {
        if arguments.columns[..idx].contains(name) {
            return Err(wrong(&format!("column `{name}` is there twice")));
        }
        let is_taken = ["density", "standard_error", "n_particles", "support"].contains(&name.as_str());
        if is_taken || name.starts_with("bandwidth_") || name.starts_with("direction_") {
            return Err(wrong(&format!("`{name}` is a column of the result: coordinates need other names")));
        }
    }
    Ok(())
}

/// The density, as if kernels differed from cell to cell.
fn spread(
    kernel: KernelName,
    lattice: &Lattice,
    tally: &Tally,
    adaptive: &Adaptive,
) -> Result<Estimate, Stopped> {
    let rule = match kernel {
        KernelName::Adaptive | KernelName::Round => {
            return Ok(estimate(lattice, tally, adaptive, Width::widest()));
        }
        KernelName::PlugIn => Rule::PlugIn(Shape::Stretched),
        KernelName::NormalReference => Rule::NormalReference,
        KernelName::Histogram => {
            let (density, standard_error) = histogram(lattice, tally);
            return Ok(Estimate {
                density,
                standard_error,
                cells: Vec::new(),
                history: vec![0.0],
                is_settled: true,
            });
        }
    };
    let found = global(lattice, tally, rule, adaptive.weighing, Width::widest())
        .map_err(|trouble| wrong(&trouble.to_string()))?;
    let product: f64 = lattice.axes().map(|axis| found.bandwidths[axis]).product();
    let h = lamella::maths::vector::pow(product, 1.0 / lattice.d as f64);
    let cell = |&idx: &u32| Cell {
        at: lattice.cell(idx as usize),
        h,
        s: found.bandwidths.map(|own| own / h),
        ..Cell::default()
    };
    Ok(Estimate {
        density: found.density,
        standard_error: found.standard_error,
        cells: tally.cells.iter().map(cell).collect(),
        history: vec![h; found.n_loops + 1],
        is_settled: found.is_settled,
    })
}

fn lattice(arguments: &Arguments, points: &Points) -> Result<Lattice, Stopped> {
    let d = arguments.domain.len();
    if arguments.cells.len() != d {
        return Err(wrong(&format!("--cells has {} numbers for {d} axes", arguments.cells.len())));
    }
    let n = arguments.cells.iter().try_fold(1_usize, |n, &own| n.checked_mul(own));
    if n.is_none_or(|n| n == 0 || n > MOST_CELLS) {
        return Err(wrong("there may be 1 to 100 million cells"));
    }
    if arguments.ends.len() != 1 && arguments.ends.len() != d {
        return Err(wrong(&format!("--ends has {} words for {d} axes", arguments.ends.len())));
    }
    let axis = |idx: usize| -> Result<(usize, f64, [End; 2]), Stopped> {
        let (Axis { low, high, .. }, factor) = (&arguments.domain[idx], points.factors[idx]);
        let ends = arguments.ends.get(idx).unwrap_or(&arguments.ends[0]).of(points, d)?;
        Ok((arguments.cells[idx], (high - low) * factor / arguments.cells[idx] as f64, ends))
    };
    let axes = (0..d).map(axis).collect::<Result<Vec<(usize, f64, [End; 2])>, Stopped>>()?;
    Lattice::new(&axes).ok_or_else(|| wrong("cells of this domain have no size that is a number"))
}

fn adaptive(arguments: &Arguments, factor: f64) -> Adaptive {
    Adaptive {
        variant: if arguments.parity { Variant::Released } else { Variant::Corrected },
        shape: if arguments.kernel == KernelName::Round { Shape::Round } else { Shape::Stretched },
        start: Start::NormalReference,
        orientation: Default::default(),
        weighing: match arguments.weighing {
            WeighingName::All => Weighing::OfAll,
            WeighingName::Mean => Weighing::Mean,
            WeighingName::Number => Weighing::Number,
            WeighingName::Cell => Weighing::OfCell,
        },
        order: if arguments.order == 4 { Order::Fourth } else { Order::Second },
        bounds: arguments.bandwidth.as_ref().map(|own| {
            let factor = own.unit.as_ref().map_or(factor, |(_, unit)| unit.factor());
            [own.low * factor, own.high * factor]
        }),
        is_fast: !(arguments.exact || arguments.parity),
        tolerance: arguments.tolerance,
        most_loops: arguments.loops as usize,
    }
}

fn tabulate(
    arguments: &Arguments,
    points: &Points,
    (lattice, low): (&Lattice, &[f64]),
    (tally, found): (&Tally, &mut Estimate),
) -> DensityTable {
    let axes = lattice.axes().enumerate().map(|(idx, axis)| {
        let (name, unit) = (points.names[idx].clone(), points.units[idx].clone());
        (name, unit, low[idx], lattice.edge[axis], lattice.cells[axis])
    });
    let unknown = Cell::default();
    // A histogram has no kernels.
    let of_cells = found.cells.iter().chain(std::iter::repeat(&unknown));
    let cells = of_cells.zip(&tally.cells).zip(&tally.counts).map(|((cell, &idx), &count)| DensityCell {
        idx: idx as usize,
        n_particles: count as u64,
        bandwidth: density_direction::bandwidths(arguments, lattice, cell),
        direction: density_direction::of_cell(lattice, cell),
        support: cell.sigma,
    });
    let mut notes = serde_json::json!({
        "version": 1,
        "lamella": env!("CARGO_PKG_VERSION"),
        "file": { "name": arguments.file.file_name().map(|name| name.to_string_lossy().into_owned()), "hash": points.hash },
        "columns": points.names,
        "where": arguments.conditions,
        "exact": arguments.exact || arguments.parity,
        "parity": arguments.parity,
        "kernel": arguments.kernel.word(),
        "order": arguments.order,
        "tolerance": arguments.tolerance,
        "loops": found.history.len() - 1,
        "settled": found.is_settled,
        "mean_bandwidth": found.history.last(),
        "weighing": arguments.weighing.to_possible_value().map(|value| value.get_name().to_owned()),
        "ends": arguments.ends.iter().map(|ends| ends.text.clone()).collect::<Vec<String>>(),
        "bandwidth_bounds": adaptive(arguments, points.factors[0]).bounds,
        "weight_inside": tally.mass(),
        "effective_points": tally.effective(),
        "points_outside": tally.outside.0,
        "weight_outside": tally.outside.1,
    });
    density_direction::note(arguments, &mut notes);
    DensityTable {
        axes: axes.collect(),
        unit: points.units.get(low.len()).cloned().unwrap_or_default(),
        density: std::mem::take(&mut found.density),
        standard_error: std::mem::take(&mut found.standard_error),
        is_sparse: arguments.nonzero,
        is_oriented: density_direction::is_asked_for(arguments),
        cells: cells.collect(),
        notes: notes.to_string(),
    }
}

fn tell(
    terminal: &Terminal,
    path: &Path,
    (lattice, tally, found): (&Lattice, &Tally, &Estimate),
    (seconds, all): (f64, f64),
    (error, kept): (f64, f64),
) -> Result<(), Stopped> {
    let n: f64 = tally.counts.iter().sum();
    let (loops, mean) = (found.history.len() - 1, found.history.last().copied().unwrap_or(0.0));
    if terminal.is_json() {
        let text = serde_json::json!({
            "file": path.display().to_string(), "points": n, "points_outside": tally.outside.0,
            "cells": lattice.n_cells(), "cells_with_points": tally.cells.len(), "loops": loops,
            "settled": found.is_settled, "mean_bandwidth": mean, "relative_standard_error": error, "weight_kept": kept,
            "seconds_estimate": seconds, "seconds": all,
        });
        return terminal.product(&format!("{text}\n"));
    }
    if terminal.is_quiet() {
        return Ok(());
    }
    let outside = match tally.outside.0 {
        0 => String::new(),
        n => format!("; {n} outside of the domain are left out"),
    };
    let state =
        if found.is_settled { "settled" } else { "not settled: more --loops, or a larger --tolerance" };
    let outside = match kept {
        kept if kept < 1.0 - 1e-6 => {
            format!(
                "{outside}; {} % of the weight is beyond ends that absorb",
                significant(100.0 * (1.0 - kept), 2)
            )
        }
        _ => outside,
    };
    let kernels = match (found.cells.is_empty(), loops) {
        (true, _) => "none".to_owned(),
        (_, 0) => format!("bandwidth {}", significant(mean, 3)),
        _ => format!("{loops} loops, {state}; mean bandwidth {}", significant(mean, 3)),
    };
    terminal.product(&format!(
        "points:     {n} in {} of {} cells{outside}\nkernels:    {kernels}\nerror:      \
         {} % by the number of points (L2 of the standard error over the density)\ntime:       {} for the density, {} in all\n\
         density:    {}\n",
        tally.cells.len(),
        lattice.n_cells(),
        significant(100.0 * error, 2),
        duration(seconds),
        duration(all),
        path.display(),
    ))
}

fn norm(values: &[f64]) -> f64 {
    values.iter().map(|value| value * value).sum::<f64>().sqrt()
}

pub(super) fn wrong(message: &str) -> Stopped {
    Stopped::new(
        Exit::SceneWrong,
        Diagnostic::error(codes::F101, message.to_owned()).help("see lamella density --help"),
    )
}

fn failed(message: &str) -> Stopped {
    Stopped::new(Exit::Failed, Diagnostic::error(codes::F103, message.to_owned()))
}
