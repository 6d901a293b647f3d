//! The head file of MODFLOW 6 (`*.hds`).
//!
//! Owns its records. May use bytes and errors. It deliberately keeps the numbers as they are: dry and
//! inactive cells are told by their value.

use super::grid::{DisGrid, big_endian};
use crate::flow::read::bytes::{Bytes, doubles, text};
use crate::flow::read::error::{Kind, ReadError};
use std::collections::BTreeMap;

/// Heads by stress period and time step, in MODFLOW's order of cells.
pub(super) type Heads = BTreeMap<(i32, i32), Vec<f64>>;

/// What MODFLOW writes where there is no water.
pub(super) fn is_wet(head: f64) -> bool {
    head.abs() < 1e29
}

pub(super) fn read(file: &[u8], grid: &DisGrid) -> Result<Heads, ReadError> {
    const WHAT: &str = "the header of a layer of heads";
    let mut bytes = Bytes::new(file);
    let mut heads = Heads::new();
    let per_layer = grid.n_rows * grid.n_columns;
    while !bytes.is_at_end() {
        let place = bytes.place();
        let (step, period) = (bytes.int(WHAT)?, bytes.int(WHAT)?);
        bytes.take(16, WHAT)?;
        let name = text(bytes.take(16, WHAT)?);
        let sizes = [bytes.int(WHAT)?, bytes.int(WHAT)?, bytes.int(WHAT)?];
        if !name.eq_ignore_ascii_case("HEAD") {
            if (1..1 << 24).contains(&step.swap_bytes()) && step.swap_bytes() < step {
                return Err(big_endian(&format!("time step {step}")).at(place));
            }
            let message = format!("this is no head file of MODFLOW 6: `{name}` where `HEAD` should stand");
            return Err(ReadError::new(Kind::Foreign, message).at(place));
        }
        let layer = usize::try_from(sizes[2]).ok().filter(|layer| (1..=grid.n_layers).contains(layer));
        let fits = sizes[0] as usize == grid.n_columns && sizes[1] as usize == grid.n_rows;
        let Some(layer) = layer.filter(|_| fits) else {
            let message = format!(
                "heads of {} columns, {} rows and layer {}; the grid has {}, {} and {}",
                sizes[0], sizes[1], sizes[2], grid.n_columns, grid.n_rows, grid.n_layers
            );
            return Err(ReadError::new(Kind::Mismatch, message).at(place));
        };
        let data = bytes.take_many(per_layer, 8, "a layer of heads")?;
        let all = heads.entry((period, step)).or_insert_with(|| vec![1e30; grid.n_cells()]);
        for (head, value) in all[(layer - 1) * per_layer..].iter_mut().zip(doubles(data)) {
            *head = value;
        }
    }
    Ok(heads)
}
