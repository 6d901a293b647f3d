//! Long tables of a flow: one row per point.
//!
//! Owns which columns are asked for, and the way from rows to a flow. May use the grid of points and the
//! averaging. It deliberately knows neither CSV nor Parquet: their readers hand over rows.

use super::PorosityOf;
use super::centred::{Centred, Quantity, check_porosity, into_faces};
use super::error::{Kind, ReadError};
pub(super) use super::error::{RowPlaces, no_column};
use super::npy::porosity;
use super::points::{Bounds, Grid, Points, cells_of_faces};
use crate::flow::FaceFlow;

/// A column and what its unit is in SI.
#[derive(Debug, Clone, PartialEq)]
pub struct Column {
    pub name: String,
    pub factor: f64,
}

impl Column {
    pub fn new(name: impl Into<String>, factor: f64) -> Self {
        Self { name: name.into(), factor }
    }
}

/// What a row holds besides its place.
#[derive(Debug, Clone, PartialEq)]
pub enum Rows {
    /// The middle of a cell; one column per axis.
    Centres { q: Vec<Column>, quantity: Quantity },
    /// The middle of a face: the column that says `x`, `y` or `z` for the axis it is normal to, and the
    /// specific discharge along that axis.
    Faces { normal: String, q: Column },
}

/// Which columns mean what.
#[derive(Debug, Clone, PartialEq)]
pub struct Layout {
    /// Coordinates, one column per axis of the domain.
    pub at: Vec<Column>,
    pub rows: Rows,
    /// Columns that only middles of cells can have.
    pub porosity: Option<Column>,
    pub head: Option<Column>,
    pub conductivity: Option<Column>,
}

/// What a table does not know of itself.
pub struct Frame<'a> {
    /// Corners of the domain, m. Without them the spacing must be equal.
    pub bounds: Option<Bounds>,
    /// Used where the table has no column of it.
    pub porosity: PorosityOf<'a>,
}

/// Rows as a format's reader hands them over, in the units of the file.
#[derive(Debug, Default)]
pub(super) struct Raw {
    /// Per column asked for.
    pub numbers: Vec<Vec<f64>>,
    /// Per row, where a column of normals was asked for.
    pub normals: Vec<u8>,
    pub places: RowPlaces,
}

impl Layout {
    /// Numeric columns in the order in which `flow` takes them.
    pub(super) fn numeric(&self) -> Vec<&Column> {
        let q: Vec<&Column> = match &self.rows {
            Rows::Centres { q, .. } => q.iter().collect(),
            Rows::Faces { q, .. } => vec![q],
        };
        let more = [&self.porosity, &self.head, &self.conductivity];
        self.at.iter().chain(q).chain(more.into_iter().flatten()).collect()
    }

    pub(super) fn normal(&self) -> Option<&str> {
        match &self.rows {
            Rows::Centres { .. } => None,
            Rows::Faces { normal, .. } => Some(normal),
        }
    }

    /// The flow of the rows.
    pub(super) fn flow(&self, mut raw: Raw, frame: &Frame) -> Result<FaceFlow, ReadError> {
        self.check(&raw)?;
        for (column, values) in self.numeric().into_iter().zip(&mut raw.numbers) {
            values.iter_mut().for_each(|value| *value *= column.factor);
        }
        match &self.rows {
            Rows::Centres { quantity, .. } => self.of_centres(raw, *quantity, frame),
            Rows::Faces { .. } => self.of_faces(raw, frame),
        }
    }

    fn check(&self, raw: &Raw) -> Result<(), ReadError> {
        let wrong = |message: &str| Err(ReadError::new(Kind::Mismatch, message));
        let n_more = [&self.porosity, &self.head, &self.conductivity].into_iter().flatten().count();
        match &self.rows {
            _ if !(1..=3).contains(&self.at.len()) => return wrong("a domain has one to three axes"),
            Rows::Centres { q, .. } if q.len() != self.at.len() => {
                return wrong("there is one component of the discharge per axis");
            }
            Rows::Faces { .. } if n_more > 0 => {
                return wrong("porosity, head and conductivity belong to cells, and these rows are faces");
            }
            _ => {}
        }
        if raw.numbers.first().is_none_or(Vec::is_empty) {
            return Err(ReadError::new(Kind::Missing, "the table has no row"));
        }
        Ok(())
    }

    fn of_centres(&self, mut raw: Raw, quantity: Quantity, frame: &Frame) -> Result<FaceFlow, ReadError> {
        let axes = self.at.len();
        let mut values = raw.numbers.split_off(axes).into_iter();
        let points = Points { at: raw.numbers, places: &raw.places, rows: None };
        let grid = Grid::of(&points)?;
        let row_of_cell = grid.row_of_cell(&points)?;
        let cells = grid.cells_of_centres(&points, frame.bounds)?;
        let mut take = || {
            let column = values.next().unwrap_or_default();
            row_of_cell.iter().map(|&row| column[row as usize]).collect::<Vec<f64>>()
        };
        let q = (0..axes).map(|_| take()).collect();
        let own_porosity = self.porosity.as_ref().map(|_| take());
        let head = self.head.as_ref().map(|_| take());
        let conductivity = self.conductivity.as_ref().map(|_| take());
        let porosity = match own_porosity {
            Some(porosity) => {
                let wrong = porosity.iter().position(|porosity| !(0.0..=1.0).contains(porosity));
                let place = wrong.map(|cell| raw.places.of(row_of_cell[cell] as usize));
                check_porosity(&porosity).map_err(|error| ReadError { place, ..error })?;
                porosity
            }
            None => porosity(&cells, frame.porosity)?,
        };
        into_faces(Centred { cells, quantity, q, porosity, head, conductivity })
    }

    fn of_faces(&self, raw: Raw, frame: &Frame) -> Result<FaceFlow, ReadError> {
        let axes = self.at.len();
        let mut columns = raw.numbers;
        let q = columns.pop().unwrap_or_default();
        let parts: Vec<Points> = (0..axes)
            .map(|axis| {
                let is_of = |row: &usize| usize::from(raw.normals[*row]) == axis;
                let rows: Vec<u32> = (0..q.len()).filter(is_of).map(|row| row as u32).collect();
                let at =
                    columns.iter().map(|at| rows.iter().map(|&row| at[row as usize]).collect()).collect();
                Points { at, places: &raw.places, rows: Some(rows) }
            })
            .collect();
        if let Some(row) = raw.normals.iter().position(|&normal| usize::from(normal) >= axes) {
            let message =
                format!("a face normal to {} in a domain without that axis", ["x", "y", "z"][axes.min(2)]);
            return Err(ReadError::new(Kind::Points, message).at(raw.places.of(row)));
        }
        let grids = parts.iter().map(Grid::of).collect::<Result<Vec<_>, _>>()?;
        let mut found = Vec::new();
        for (grid, points) in grids.iter().zip(&parts) {
            let rows = grid.row_of_cell(points)?;
            found.push(rows.into_iter().map(|row| q[points.row(row as usize)]).collect());
        }
        let cells = cells_of_faces(&grids, &parts)?;
        let mut found = found.into_iter();
        let flux = [0, 1, 2].map(|axis| found.next().unwrap_or_else(|| vec![0.0; cells.n_faces(axis)]));
        let porosity = porosity(&cells, frame.porosity)?;
        Ok(FaceFlow { cells, flux, porosity, head: None, conductivity: None, sinks: Vec::new() })
    }
}

/// The axis of a name in a column of normals.
pub(super) fn axis_of(name: &str) -> Option<u8> {
    match name.trim() {
        "x" => Some(0),
        "y" => Some(1),
        "z" => Some(2),
        _ => None,
    }
}
