//! Flows of MODFLOW 6: binary grid file, budget file, and heads where they are given.
//!
//! Owns the way from these files to a series of steady flows. May use the flow and its words. It
//! deliberately smooths nothing between time steps, and reads no text file of a model: units and porosity,
//! which stand only there, are the caller's.

mod budget;
mod grid;
mod heads;
mod layers;
mod periods;
#[cfg(test)]
mod tests;

use super::PorosityOf;
use super::error::{Kind, ReadError};
use crate::flow::FaceFlow;
use std::ops::Range;

/// The bytes of a model's files.
#[derive(Clone, Copy)]
pub struct Files<'a> {
    /// `*.dis.grb`
    pub grid: &'a [u8],
    /// `*.bud` or `*.cbc`
    pub budget: &'a [u8],
    /// `*.hds`
    pub heads: Option<&'a [u8]>,
}

/// What the files do not say.
pub struct Settings<'a> {
    /// The unit of length in m, …
    pub length: f64,
    /// … and of time in s.
    pub time: f64,
    pub porosity: PorosityOf<'a>,
    /// Sides through which the water of packages flows that have no column IFLOWFACE or IFACE, by the name of
    /// the package or of its kind.
    pub sides: &'a [(String, Side)],
}

/// A face of a cell, by the axis it is normal to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Side {
    pub axis: usize,
    pub is_upper: bool,
}

impl Side {
    /// The face by its number as MODFLOW 6 counts: 1 west, 2 north, 3 east, 4 south, −2 bottom, −1 top.
    pub fn of_iflowface(number: f64) -> Option<Self> {
        Self::of(number, [1, 3, 4, 2, -2, -1])
    }

    /// The face by its number as MODPATH counts: 1 west, 2 east, 3 south, 4 north, 5 bottom, 6 top.
    pub fn of_iface(number: f64) -> Option<Self> {
        Self::of(number, [1, 2, 3, 4, 5, 6])
    }

    /// `numbers` stand for low and high x, y and z.
    fn of(number: f64, numbers: [i32; 6]) -> Option<Self> {
        let found = numbers.iter().position(|&own| number.round() == f64::from(own))?;
        Some(Self { axis: found / 2, is_upper: found % 2 == 1 })
    }
}

/// Flows that hold one after the other.
#[derive(Debug, Clone, PartialEq)]
pub struct Series {
    pub periods: Vec<Period>,
    /// Lower left corner of the grid in the coordinates of the world, m; cells start from 0.
    pub origin: [f64; 2],
    /// By which the grid is turned around that corner, degrees anticlockwise.
    pub rotation: f64,
}

/// A flow and when it holds.
#[derive(Debug, Clone, PartialEq)]
pub struct Period {
    /// From the start of the simulation, s. A period reaches from the end of the one before to the end of its
    /// time step.
    pub start: f64,
    pub end: f64,
    /// True if the time step began later than the period: the flow of the steps between was not saved.
    pub has_gap: bool,
    pub flow: FaceFlow,
    pub packages: Vec<Package>,
    /// Part of the pores that is filled in the driest active cell. The porosity of the flow is that of the
    /// medium times this part, so that cells hold the water they hold.
    pub least_saturation: f64,
}

/// What one package adds and takes.
#[derive(Debug, Clone, PartialEq)]
pub struct Package {
    /// As `WEL` or `STO-SS`.
    pub kind: String,
    /// As the user called it; empty for storage.
    pub name: String,
    /// Its part of the sinks of the flow.
    pub sinks: Range<usize>,
    /// Water that enters through outer faces, m³/s, less what leaves there.
    pub through_faces: f64,
    /// Cells that it lists; 0 of what is stored.
    pub n_cells: usize,
    /// The outer sides of the grid, two per axis, that all of these cells touch.
    pub touches: [bool; 6],
}

/// The flows of a model.
pub fn read(files: Files, settings: &Settings) -> Result<Series, ReadError> {
    for (name, factor) in [("length", settings.length), ("time", settings.time)] {
        if !(factor.is_finite() && factor > 0.0) {
            return Err(ReadError::new(Kind::Value, format!("the unit of {name} is {factor}")));
        }
    }
    let grid = grid::DisGrid::read(files.grid)?;
    let cells = grid.cells(settings.length)?;
    let records = budget::records(files.budget)?;
    let heads = files.heads.map(|file| heads::read(file, &grid)).transpose()?;
    let periods = periods::periods(&grid, &cells, &records, heads.as_ref(), settings)?;
    let origin = grid.origin.map(|at| at * settings.length);
    Ok(Series { periods, origin, rotation: grid.rotation })
}
