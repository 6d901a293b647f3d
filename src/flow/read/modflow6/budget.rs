//! The budget file of MODFLOW 6 (`*.bud`, `*.cbc`), record by record.
//!
//! Owns the headers of records and the bounds of their bodies. May use bytes and errors. It deliberately
//! copies nothing: a record lends the bytes of the file. The format is that of "MODFLOW 6 – Description of
//! Input and Output", budget file.

use super::grid::big_endian;
use crate::flow::read::bytes::{Bytes, doubles, text};
use crate::flow::read::error::{Kind, ReadError};

/// More columns than any package has.
const MAX_COLUMNS: i32 = 1000;

/// When a record was written, in the units of the model.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Moment {
    pub period: i32,
    pub step: i32,
    /// Length of the time step.
    pub length: f64,
    /// Its end, from the start of the simulation.
    pub end: f64,
}

#[derive(Debug)]
pub(super) struct Record<'a> {
    pub moment: Moment,
    /// What it holds: `FLOW-JA-FACE`, `WEL`, …
    pub text: String,
    pub body: Body<'a>,
}

#[derive(Debug)]
pub(super) enum Body<'a> {
    /// One double per connection or per cell.
    Array(&'a [u8]),
    List(List<'a>),
}

/// Cells, each with a flow into the model and further columns.
#[derive(Debug)]
pub(super) struct List<'a> {
    pub package: String,
    /// Names of the columns behind the flow.
    pub columns: Vec<String>,
    rows: &'a [u8],
}

/// One row of a list.
pub(super) struct Entry<'a> {
    /// From 1, as in the file.
    pub cell: i32,
    values: &'a [u8],
}

impl<'a> List<'a> {
    pub(super) fn entries(&self) -> impl Iterator<Item = Entry<'a>> + use<'a> {
        let size = row_size(self.columns.len() + 1);
        self.rows.chunks_exact(size).map(|row| Entry {
            cell: i32::from_le_bytes([row[0], row[1], row[2], row[3]]),
            values: &row[8..],
        })
    }

    /// The number of a column behind the flow; case does not matter to MODFLOW.
    pub(super) fn column(&self, name: &str) -> Option<usize> {
        self.columns.iter().position(|own| own.eq_ignore_ascii_case(name))
    }
}

impl Entry<'_> {
    /// Into the model.
    pub(super) fn flow(&self) -> f64 {
        self.value(0)
    }

    pub(super) fn column(&self, idx: usize) -> f64 {
        self.value(idx + 1)
    }

    fn value(&self, idx: usize) -> f64 {
        doubles(&self.values[8 * idx..]).next().unwrap_or(0.0)
    }
}

fn row_size(n_values: usize) -> usize {
    8 + 8 * n_values
}

/// All records in the order of the file.
pub(super) fn records(file: &[u8]) -> Result<Vec<Record<'_>>, ReadError> {
    let mut bytes = Bytes::new(file);
    if bytes.is_at_end() {
        return Err(ReadError::new(Kind::Foreign, "the budget file is empty"));
    }
    let mut records = Vec::new();
    while !bytes.is_at_end() {
        let place = bytes.place();
        records.push(record(&mut bytes).map_err(|error| match error.place {
            Some(_) => error,
            None => error.at(place),
        })?);
    }
    Ok(records)
}

fn record<'a>(bytes: &mut Bytes<'a>) -> Result<Record<'a>, ReadError> {
    const WHAT: &str = "the header of a record";
    let start = bytes.rest();
    let (step, period) = (bytes.int(WHAT)?, bytes.int(WHAT)?);
    let name = bytes.take(16, WHAT)?;
    let sizes = [bytes.int(WHAT)?, bytes.int(WHAT)?, bytes.int(WHAT)?];
    check_start(step, period, name, sizes)?;
    let method = bytes.int(WHAT)?;
    if !matches!(method, 1 | 6) {
        return Err(older(&format!("a record of method {method}")));
    }
    let (length, in_period, end) = (bytes.double(WHAT)?, bytes.double(WHAT)?, bytes.double(WHAT)?);
    check_times(start, [length, in_period, end])?;
    let text = text(name);
    let body = match method {
        1 => {
            let n = sizes.iter().try_fold(1usize, |n, size| n.checked_mul(size.unsigned_abs() as usize));
            let n = n.ok_or_else(|| ReadError::new(Kind::Damaged, format!("{text} has impossible sizes")))?;
            Body::Array(bytes.take_many(n, 8, &text)?)
        }
        _ => Body::List(list(bytes, &text)?),
    };
    Ok(Record { moment: Moment { period, step, length, end }, text, body })
}

fn list<'a>(bytes: &mut Bytes<'a>, what: &str) -> Result<List<'a>, ReadError> {
    // The names of the model and of the other model or package; the last names the package.
    bytes.take(48, what)?;
    let package = text(bytes.take(16, what)?);
    let n_values = bytes.int(what)?;
    if !(1..=MAX_COLUMNS).contains(&n_values) {
        return Err(ReadError::new(Kind::Damaged, format!("{what} has {n_values} columns")));
    }
    let n_values = n_values as usize;
    let names = bytes.take_many(n_values - 1, 16, what)?;
    let columns = names.chunks_exact(16).map(text).collect();
    let n_rows = bytes.int(what)?;
    let Ok(n_rows) = usize::try_from(n_rows) else {
        return Err(ReadError::new(Kind::Damaged, format!("{what} has {n_rows} rows")));
    };
    let rows = bytes.take_many(n_rows, row_size(n_values), what)?;
    Ok(List { package, columns, rows })
}

/// The first bytes tell other files and other byte orders apart.
fn check_start(step: i32, period: i32, name: &[u8], sizes: [i32; 3]) -> Result<(), ReadError> {
    let is_number = |number: i32| (1..1 << 24).contains(&number);
    let is_name = name.iter().all(|c| c.is_ascii_graphic() || *c == b' ');
    if is_name && is_number(step.swap_bytes()) && is_number(period.swap_bytes()) && !is_number(step) {
        return Err(big_endian(&format!("time step {step}")));
    }
    if !is_name || !is_number(step) || !is_number(period) {
        return Err(ReadError::new(
            Kind::Foreign,
            "this is no budget file of MODFLOW 6, or not from here on",
        ));
    }
    if sizes[2] >= 0 {
        return Err(older("a full array without a compact header"));
    }
    if sizes[0] < 0 || sizes[1] < 0 {
        return Err(ReadError::new(Kind::Damaged, format!("{} has sizes {sizes:?}", text(name))));
    }
    Ok(())
}

fn older(what: &str) -> ReadError {
    ReadError::new(Kind::Unsupported, format!("{what}, as MODFLOW 2005 and others write it"))
        .help("budget files of MODFLOW 6 are read")
}

/// Times that make no sense as doubles may make sense as singles.
fn check_times(start: &[u8], times: [f64; 3]) -> Result<(), ReadError> {
    let [length, in_period, end] = times;
    if are_times(times) {
        return Ok(());
    }
    let singles = start.get(40..52).and_then(|bytes| bytes.as_chunks().0.try_into().ok());
    let is_single = singles.is_some_and(|singles: [[u8; 4]; 3]| {
        let times = singles.map(|bytes| f64::from(f32::from_le_bytes(bytes)));
        are_times(times) && times[2] > 0.0
    });
    Err(if is_single {
        ReadError::new(Kind::Unsupported, "the file is in single precision").help("MODFLOW 6 writes doubles")
    } else {
        let message = format!("a step of length {length} that ends at {end}, {in_period} within its period");
        ReadError::new(Kind::Damaged, message)
    })
}

/// Length of a step, its end within its period, its end: a time far from all that is simulated comes from bytes
/// of something else.
fn are_times(times: [f64; 3]) -> bool {
    let last = times[2] * (1.0 + 1e-6);
    times.iter().all(|&time| time == 0.0 || (1e-20..1e20).contains(&time))
        && times.iter().all(|&time| time <= last)
}
