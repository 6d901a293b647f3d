//! Records of a budget into flows.
//!
//! Owns signs, units and faces. May use the files' readers and the flow. It deliberately leaves the balance as
//! it is: what MODFLOW's solver left open is there to be seen.

use super::budget::{Body, List, Moment, Record};
use super::grid::DisGrid;
use super::heads::{Heads, is_wet};
use super::{Package, Period, Settings, Side};
use crate::flow::read::bytes::doubles;
use crate::flow::read::error::{Kind, ReadError};
use crate::flow::read::npy::porosity;
use crate::flow::{Cells, FaceFlow, Sink};

const FACES: &str = "FLOW-JA-FACE";
const SATURATION: &str = "DATA-SAT";

pub(super) fn periods(
    grid: &DisGrid,
    cells: &Cells,
    records: &[Record],
    heads: Option<&Heads>,
    settings: &Settings,
) -> Result<Vec<Period>, ReadError> {
    let number: Vec<usize> = (0..grid.n_cells()).map(|cell| cells.cell(grid.place_of(cell))).collect();
    let mut solid = porosity(cells, settings.porosity)?;
    for (cell, &own) in number.iter().enumerate() {
        if !grid.is_active(cell) {
            solid[own] = 0.0;
        }
    }
    let model = Model { grid, cells, number, solid, settings };
    let mut periods: Vec<Period> = Vec::new();
    let mut end = 0.0;
    for step in records.chunk_by(|a, b| (a.moment.period, a.moment.step) == (b.moment.period, b.moment.step))
    {
        let moment = step[0].moment;
        if moment.end < end || (moment.end == end && !periods.is_empty()) {
            let message = format!("{} ends at {}, the one before at {end}", shown(moment), moment.end);
            return Err(ReadError::new(Kind::Damaged, message));
        }
        let heads = heads.map(|all| {
            all.get(&(moment.period, moment.step)).ok_or_else(|| {
                ReadError::new(Kind::Mismatch, format!("the head file has no {}", shown(moment)))
                    .help("save heads and budget at the same times")
            })
        });
        let mut period = model.period(step, heads.transpose()?)?;
        period.start = end * settings.time;
        period.end = moment.end * settings.time;
        period.has_gap = moment.end - moment.length > end + 1e-9 * moment.end;
        end = moment.end;
        periods.push(period);
    }
    Ok(periods)
}

fn shown(moment: Moment) -> String {
    format!("time step {} of stress period {}", moment.step, moment.period)
}

struct Model<'a> {
    grid: &'a DisGrid,
    cells: &'a Cells,
    /// Our number of each cell of MODFLOW.
    number: Vec<usize>,
    /// Porosity in our order, 0 where no cell is active.
    solid: Vec<f64>,
    settings: &'a Settings<'a>,
}

impl Model<'_> {
    fn period(&self, step: &[Record], heads: Option<&Vec<f64>>) -> Result<Period, ReadError> {
        let moment = step[0].moment;
        let mut through = step.iter().filter_map(|record| match &record.body {
            Body::Array(data) if record.text == FACES => Some(*data),
            _ => None,
        });
        let Some(data) = through.next() else {
            let message = format!("the budget file has no {FACES} for {}", shown(moment));
            return Err(ReadError::new(Kind::Missing, message)
                .help("set SAVE_FLOWS in the NPF package, and give the budget file of the flow model"));
        };
        if through.next().is_some() {
            let message = format!("{FACES} stands twice in {}", shown(moment));
            return Err(ReadError::new(Kind::Damaged, message));
        }
        let saturation = self.saturation(step, heads)?;
        let flux = self.flux(data)?;
        let porosity = self.solid.iter().zip(&saturation).map(|(solid, part)| solid * part).collect();
        let head = heads.map(|heads| self.heads(heads));
        let cells = self.cells.clone();
        let mut flow = FaceFlow { cells, flux, porosity, head, conductivity: None, sinks: Vec::new() };
        let mut packages = Vec::new();
        for record in step {
            let is_data = record.text.starts_with("DATA-");
            match &record.body {
                Body::Array(_) if record.text == FACES => {}
                _ if is_data => {}
                Body::Array(data) => {
                    packages.push(self.stored(&mut flow, packages.len(), &record.text, data)?)
                }
                Body::List(list) => {
                    packages.push(self.package(&mut flow, packages.len(), &record.text, list)?)
                }
            }
        }
        let active = saturation.iter().zip(&self.solid).filter(|(_, solid)| **solid > 0.0);
        let least_saturation = active.map(|(part, _)| *part).fold(1.0, f64::min);
        Ok(Period { start: 0.0, end: 0.0, has_gap: false, flow, packages, least_saturation })
    }

    /// Specific discharge through the faces between cells.
    ///
    /// - Equation: `q = −F / A` along x, `q = F / A` along y and z.
    /// - Symbols: `F` the entry of FLOW-JA-FACE of cell n for its neighbour m > n: flow from m into n;
    ///   `A` area of the face. A neighbour with a higher number lies to the east, the south or below.
    /// - Range: cells of full height; the area is that of the whole cell where it is partly filled.
    /// - Source: MODFLOW 6, Description of Input and Output, budget file.
    /// - Shape: one number per face.
    fn flux(&self, data: &[u8]) -> Result<[Vec<f64>; 3], ReadError> {
        let grid = self.grid;
        if data.len() / 8 != grid.ja.len() {
            let message = format!(
                "{FACES} has {} entries, the grid file {} connections",
                data.len() / 8,
                grid.ja.len()
            );
            return Err(
                ReadError::new(Kind::Mismatch, message).help("give the files of one and the same model")
            );
        }
        let flows: Vec<f64> = doubles(data).collect();
        let mut flux = [0, 1, 2].map(|axis| vec![0.0; self.cells.n_faces(axis)]);
        let unit = self.settings.length.powi(3) / self.settings.time;
        for cell in 0..grid.n_cells() {
            // The first entry is the cell itself; an inactive cell has none at all.
            let entries = (grid.ia[cell] + 1).min(grid.ia[cell + 1])..grid.ia[cell + 1];
            for (&other, &flow) in grid.ja[entries.clone()].iter().zip(&flows[entries]) {
                if other <= cell {
                    continue;
                }
                let flow = finite(flow, FACES, || grid.shown(cell))? * unit;
                let (here, there) = (grid.place_of(cell), grid.place_of(other));
                let Some(axis) = neighbours(here, there) else {
                    let message =
                        format!("the cells in {} and {} are connected", grid.shown(cell), grid.shown(other));
                    return Err(ReadError::new(Kind::Unsupported, message)
                        .help("cells are connected to those beside, above and below them"));
                };
                let (low, high) = self.cells.faces(axis, here);
                let area = self.cells.face_area(axis, here);
                if axis == 0 {
                    flux[axis][high] = -flow / area;
                } else {
                    flux[axis][low] = flow / area;
                }
            }
        }
        Ok(flux)
    }

    /// Filled part of the pores per cell, in our order.
    fn saturation(&self, step: &[Record], heads: Option<&Vec<f64>>) -> Result<Vec<f64>, ReadError> {
        let mut saturation = vec![1.0; self.grid.n_cells()];
        let saved = step.iter().find_map(|record| match &record.body {
            Body::List(list) if record.text == SATURATION => Some(list),
            _ => None,
        });
        if let Some(list) = saved {
            let Some(column) = list.column("sat") else {
                return Err(ReadError::new(Kind::Damaged, format!("{SATURATION} has no column `sat`")));
            };
            for entry in list.entries() {
                let cell = self.cell(entry.cell, SATURATION)?;
                let part = entry.column(column);
                if !(0.0..=1.0 + 1e-9).contains(&part) {
                    let message = format!("{SATURATION} is {part} in {}", self.grid.shown(cell));
                    return Err(ReadError::new(Kind::Value, message));
                }
                saturation[self.number[cell]] = part.min(1.0);
            }
            return Ok(saturation);
        }
        for cell in (0..self.grid.n_cells()).filter(|&cell| self.grid.is_active(cell)) {
            match heads {
                Some(heads) if self.grid.cell_type[cell] != 0 => {
                    saturation[self.number[cell]] = self.filled(cell, heads[cell]);
                }
                Some(heads) if !is_wet(heads[cell]) => saturation[self.number[cell]] = 0.0,
                None if self.grid.cell_type[cell] != 0 => {
                    let message = format!("the cell in {} may be partly filled", self.grid.shown(cell));
                    return Err(ReadError::new(Kind::Missing, message)
                        .help("set SAVE_SATURATION in the NPF package, or give the head file, too"));
                }
                _ => {}
            }
        }
        Ok(saturation)
    }

    /// Filled part of a cell whose thickness follows the head.
    fn filled(&self, cell: usize, head: f64) -> f64 {
        if !is_wet(head) {
            return 0.0;
        }
        let edges = &self.cells.edges()[2];
        let layer = self.grid.place_of(cell)[2];
        let (low, high) = (edges[layer], edges[layer + 1]);
        ((head * self.settings.length - low) / (high - low)).clamp(0.0, 1.0)
    }

    /// Heads in metres and in our order; not a number where there is no water.
    fn heads(&self, heads: &[f64]) -> Vec<f64> {
        let mut ordered = vec![f64::NAN; heads.len()];
        for (&head, &own) in heads.iter().zip(&self.number).filter(|(head, _)| is_wet(**head)) {
            ordered[own] = head * self.settings.length;
        }
        ordered
    }

    /// A cell from its number in a list.
    fn cell(&self, number: i32, what: &str) -> Result<usize, ReadError> {
        let cell = usize::try_from(number).ok().and_then(|number| number.checked_sub(1));
        cell.filter(|&cell| cell < self.grid.n_cells()).ok_or_else(|| {
            let message = format!("{what} names cell {number}, the grid has {}", self.grid.n_cells());
            ReadError::new(Kind::Mismatch, message).help("give the files of one and the same model")
        })
    }

    /// Storage and the like: one number per cell, positive into the flow.
    fn stored(
        &self,
        flow: &mut FaceFlow,
        owner: usize,
        text: &str,
        data: &[u8],
    ) -> Result<Package, ReadError> {
        let n = data.len() / 8;
        if n != self.grid.n_cells() {
            let message = format!("{text} has {n} entries, the grid {} cells", self.grid.n_cells());
            return Err(
                ReadError::new(Kind::Mismatch, message).help("give the files of one and the same model")
            );
        }
        let start = flow.sinks.len();
        for (cell, rate) in doubles(data).enumerate().filter(|(cell, _)| self.grid.is_active(*cell)) {
            self.add_sink(flow, (owner, text), cell, rate)?;
        }
        let (kind, name) = (text.to_owned(), String::new());
        let sinks = start..flow.sinks.len();
        Ok(Package { kind, name, sinks, through_faces: 0.0, n_cells: 0, touches: [false; 6] })
    }

    fn package(
        &self,
        flow: &mut FaceFlow,
        owner: usize,
        text: &str,
        list: &List,
    ) -> Result<Package, ReadError> {
        let start = flow.sinks.len();
        let by_flow = list.column("IFLOWFACE");
        let by_path = list.column("IFACE");
        let named =
            self.settings.sides.iter().find(|(name, _)| {
                name.eq_ignore_ascii_case(&list.package) || name.eq_ignore_ascii_case(text)
            });
        let mut through_faces = 0.0;
        let (mut n_cells, mut touches) = (0, [true; 6]);
        for entry in list.entries() {
            let cell = self.cell(entry.cell, text)?;
            n_cells += 1;
            for (idx, touches) in touches.iter_mut().enumerate() {
                *touches &= self.outer_face(cell, Side { axis: idx / 2, is_upper: idx % 2 == 1 }).is_some();
            }
            let side = match (by_flow, by_path) {
                (Some(column), _) => Side::of_iflowface(entry.column(column)),
                (None, Some(column)) => Side::of_iface(entry.column(column)),
                (None, None) => named.map(|(_, side)| *side),
            };
            match side.and_then(|side| self.outer_face(cell, side)) {
                None => self.add_sink(flow, (owner, text), cell, entry.flow())?,
                Some((axis, face, inward)) => {
                    let rate = finite(entry.flow(), text, || self.grid.shown(cell))?
                        * self.settings.length.powi(3)
                        / self.settings.time;
                    let area = self.cells.face_area(axis, self.grid.place_of(cell));
                    flow.flux[axis][face] += inward * rate / area;
                    through_faces += rate;
                }
            }
        }
        let (kind, name) = (text.to_owned(), list.package.clone());
        let touches = touches.map(|touches| touches && n_cells > 0);
        Ok(Package { kind, name, sinks: start..flow.sinks.len(), through_faces, n_cells, touches })
    }

    /// The face of a cell on a side, if it is one of the grid's outer faces, and the sign of what flows in.
    fn outer_face(&self, cell: usize, side: Side) -> Option<(usize, usize, f64)> {
        let place = self.grid.place_of(cell);
        let last = self.cells.n()[side.axis] - 1;
        let (low, high) = self.cells.faces(side.axis, place);
        match side.is_upper {
            false if place[side.axis] == 0 => Some((side.axis, low, 1.0)),
            true if place[side.axis] == last => Some((side.axis, high, -1.0)),
            _ => None,
        }
    }

    /// Books water that enters a cell from nowhere; none is not booked.
    fn add_sink(
        &self,
        flow: &mut FaceFlow,
        (owner, text): (usize, &str),
        cell: usize,
        rate: f64,
    ) -> Result<(), ReadError> {
        let rate = finite(rate, text, || self.grid.shown(cell))?;
        if rate == 0.0 {
            return Ok(());
        }
        if !self.grid.is_active(cell) {
            let message =
                format!("{text} has a flow of {rate} in {}, which is not active", self.grid.shown(cell));
            return Err(ReadError::new(Kind::Mismatch, message));
        }
        let rate = -rate * self.settings.length.powi(3) / self.settings.time;
        flow.sinks.push(Sink { cell: self.number[cell], rate, owner });
        Ok(())
    }
}

fn finite(value: f64, what: &str, place: impl Fn() -> String) -> Result<f64, ReadError> {
    // Values that no unit makes sense of come from bytes of something else.
    if value.abs() < 1e100 {
        return Ok(value);
    }
    Err(ReadError::new(Kind::Value, format!("{what} is {value} in {}", place())))
}

/// The axis along which two places are neighbours.
fn neighbours(a: [usize; 3], b: [usize; 3]) -> Option<usize> {
    let axis = (0..3).find(|&axis| a[axis] != b[axis])?;
    let is_alone = (0..3).all(|other| other == axis || a[other] == b[other]);
    (is_alone && a[axis].abs_diff(b[axis]) == 1).then_some(axis)
}
