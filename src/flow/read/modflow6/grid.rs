//! The binary grid file of MODFLOW 6, for structured grids (`*.dis.grb`).
//!
//! Owns its text header and its arrays. May use bytes and errors. It deliberately keeps MODFLOW's own
//! numbering: layers from the top, rows from the north. The format is that of "MODFLOW 6 – Description of
//! Input and Output", binary grid file, versions 1 and 2.

use crate::flow::read::bytes::{Bytes, doubles, ints, text};
use crate::flow::read::error::{Kind, ReadError};
use std::collections::BTreeMap;

/// Lines of the header and variables are short; longer ones are not of this format.
const MAX_LINES: usize = 1000;
const MAX_LINE: usize = 10_000;
/// What writes the file, for messages about other files.
const WRITER: &str = "MODFLOW 6 writes it beside the model's DIS file, unless NOGRB is set";

/// A structured grid as the file has it.
#[derive(Debug)]
pub(super) struct DisGrid {
    pub n_layers: usize,
    pub n_rows: usize,
    pub n_columns: usize,
    /// Lower left corner and angle (degrees, anticlockwise) in the coordinates of the world.
    pub origin: [f64; 2],
    pub rotation: f64,
    /// Widths of columns along x, …
    pub delr: Vec<f64>,
    /// … and of rows, from the north.
    pub delc: Vec<f64>,
    /// Per column of cells.
    pub top: Vec<f64>,
    /// Per cell.
    pub bottom: Vec<f64>,
    /// Positions of the entries of each cell in `ja`, from 0; a cell's first entry is itself.
    pub ia: Vec<usize>,
    /// Cells from 0.
    pub ja: Vec<usize>,
    /// Per cell: positive where it is active.
    pub idomain: Vec<i32>,
    /// Per cell: 0 where its thickness is always that of the cell.
    pub cell_type: Vec<i32>,
}

/// What the header says of a variable.
struct Variable<'a> {
    name: &'a str,
    kind: &'a str,
    n: usize,
}

impl DisGrid {
    pub(super) fn read(file: &[u8]) -> Result<Self, ReadError> {
        let mut bytes = Bytes::new(file);
        let variables = header(&mut bytes)?;
        let mut found = BTreeMap::new();
        for variable in variables {
            let size = match variable.kind {
                "INTEGER" => 4,
                "DOUBLE" => 8,
                "CHARACTER" => 1,
                "SINGLE" => {
                    let message = format!("{} is in single precision", variable.name);
                    return Err(
                        ReadError::new(Kind::Unsupported, message).help("MODFLOW 6 itself writes doubles")
                    );
                }
                other => {
                    let message =
                        format!("{} is of the unknown type `{}`", variable.name, text(other.as_bytes()));
                    return Err(ReadError::new(Kind::Damaged, message));
                }
            };
            let data = bytes.take_many(variable.n, size, variable.name)?;
            found.insert(variable.name, (size, data));
        }
        Found(found).grid()
    }

    pub(super) fn n_cells(&self) -> usize {
        self.bottom.len()
    }

    /// Layer, row and column of a cell, from 0.
    pub(super) fn place(&self, cell: usize) -> [usize; 3] {
        let per_layer = self.n_rows * self.n_columns;
        [cell / per_layer, cell / self.n_columns % self.n_rows, cell % self.n_columns]
    }

    /// A cell as MODFLOW's users call it.
    pub(super) fn shown(&self, cell: usize) -> String {
        let [layer, row, column] = self.place(cell);
        format!("layer {}, row {}, column {}", layer + 1, row + 1, column + 1)
    }

    pub(super) fn is_active(&self, cell: usize) -> bool {
        self.idomain[cell] > 0
    }
}

/// The lines of the header: which variables follow.
fn header<'a>(bytes: &mut Bytes<'a>) -> Result<Vec<Variable<'a>>, ReadError> {
    let mut lines = Vec::new();
    for key in ["GRID", "VERSION", "NTXT", "LENTXT"] {
        let line = bytes.take(50, "the header").ok().and_then(|line| std::str::from_utf8(line).ok());
        let value = line.and_then(|line| line.trim().strip_prefix(key)).map(str::trim);
        let message = "this is no binary grid file of MODFLOW 6";
        lines.push(value.ok_or_else(|| ReadError::new(Kind::Foreign, message).help(WRITER))?);
    }
    if lines[0] != "DIS" {
        let message = format!("the grid is of the type {}", text(lines[0].as_bytes()));
        return Err(ReadError::new(Kind::Unsupported, message)
            .help("cells of structured grids (DIS) with flat layers are read"));
    }
    if !matches!(lines[1], "1" | "2") {
        let message = format!("version {} of the grid file", text(lines[1].as_bytes()));
        return Err(ReadError::new(Kind::Unsupported, message).help("versions 1 and 2 are read"));
    }
    let number = |line: &str, most: usize| line.parse::<usize>().ok().filter(|n| (1..=most).contains(n));
    let (Some(n_lines), Some(length)) = (number(lines[2], MAX_LINES), number(lines[3], MAX_LINE)) else {
        return Err(ReadError::new(Kind::Damaged, "the header has an impossible number of lines"));
    };
    let mut variables = Vec::new();
    for _ in 0..n_lines {
        let place = bytes.place();
        let line = bytes.take(length, "the header")?;
        let damaged = || {
            let message = format!("`{}` describes no variable", text(line));
            ReadError::new(Kind::Damaged, message).at(place)
        };
        let line = std::str::from_utf8(line).map_err(|_| damaged())?.trim();
        if line.is_empty() || line.starts_with('#') {
            continue;
        }
        variables.push(variable(line).ok_or_else(damaged)?);
    }
    Ok(variables)
}

/// `NAME TYPE NDIM n size …`, and a comment behind `#`.
fn variable(line: &str) -> Option<Variable<'_>> {
    let mut words = line.split('#').next()?.split_whitespace();
    let (name, kind) = (words.next()?, words.next()?);
    if words.next()? != "NDIM" {
        return None;
    }
    let n_dimensions: usize = words.next()?.parse().ok().filter(|n| *n <= 3)?;
    let mut n = 1usize;
    for _ in 0..n_dimensions {
        n = n.checked_mul(words.next()?.parse().ok()?)?;
    }
    Some(Variable { name, kind, n })
}

/// Variables by name, each with the size of its elements.
struct Found<'a>(BTreeMap<&'a str, (usize, &'a [u8])>);

impl Found<'_> {
    fn bytes(&self, name: &str, size: usize, n: Option<usize>) -> Result<&[u8], ReadError> {
        let Some((own, data)) = self.0.get(name) else {
            return Err(ReadError::new(Kind::Missing, format!("the grid file has no {name}")));
        };
        let n_own = data.len() / own;
        if *own != size || n.is_some_and(|n| n != n_own) {
            let message = format!("{name} has {n_own} elements of {own} bytes");
            return Err(ReadError::new(Kind::Damaged, message));
        }
        Ok(data)
    }

    fn int(&self, name: &str) -> Result<i32, ReadError> {
        Ok(ints(self.bytes(name, 4, Some(1))?).next().unwrap_or(0))
    }

    fn count(&self, name: &str) -> Result<usize, ReadError> {
        let count = self.int(name)?;
        usize::try_from(count).ok().filter(|&count| count > 0).ok_or_else(|| {
            let swapped = count.swap_bytes();
            let message = format!("{name} is {count}");
            if (1..1 << 24).contains(&swapped) {
                return big_endian(&message);
            }
            ReadError::new(Kind::Damaged, message)
        })
    }

    fn double(&self, name: &str) -> Result<f64, ReadError> {
        Ok(doubles(self.bytes(name, 8, Some(1))?).next().unwrap_or(0.0))
    }

    fn doubles(&self, name: &str, n: usize) -> Result<Vec<f64>, ReadError> {
        Ok(doubles(self.bytes(name, 8, Some(n))?).collect())
    }

    fn ints(&self, name: &str, n: Option<usize>) -> Result<Vec<i32>, ReadError> {
        Ok(ints(self.bytes(name, 4, n)?).collect())
    }

    fn grid(&self) -> Result<DisGrid, ReadError> {
        let [n_cells, n_layers, n_rows, n_columns, nja] =
            ["NCELLS", "NLAY", "NROW", "NCOL", "NJA"].map(|name| self.count(name));
        let (n_cells, n_layers, n_rows, n_columns) = (n_cells?, n_layers?, n_rows?, n_columns?);
        let product = n_layers.checked_mul(n_rows).and_then(|n| n.checked_mul(n_columns));
        if product != Some(n_cells) {
            let message =
                format!("{n_cells} cells in {n_layers} layers, {n_rows} rows and {n_columns} columns");
            return Err(ReadError::new(Kind::Damaged, message));
        }
        let grid = DisGrid {
            n_layers,
            n_rows,
            n_columns,
            origin: [self.double("XORIGIN")?, self.double("YORIGIN")?],
            rotation: self.double("ANGROT")?,
            delr: self.doubles("DELR", n_columns)?,
            delc: self.doubles("DELC", n_rows)?,
            top: self.doubles("TOP", n_rows * n_columns)?,
            bottom: self.doubles("BOTM", n_cells)?,
            ia: from_one(&self.ints("IA", Some(n_cells + 1))?, "IA")?,
            ja: from_one(&self.ints("JA", Some(nja?))?, "JA")?,
            idomain: self.ints("IDOMAIN", Some(n_cells))?,
            cell_type: self.ints("ICELLTYPE", Some(n_cells))?,
        };
        let rises = grid.ia.windows(2).all(|pair| pair[0] <= pair[1]);
        let is_whole = grid.ia[0] == 0 && grid.ia[n_cells] == grid.ja.len();
        if !rises || !is_whole || grid.ja.iter().any(|&cell| cell >= n_cells) {
            return Err(ReadError::new(Kind::Damaged, "the connections IA and JA contradict themselves"));
        }
        Ok(grid)
    }
}

/// Numbers that count from 1 in the file.
fn from_one(numbers: &[i32], name: &str) -> Result<Vec<usize>, ReadError> {
    let lowered = numbers.iter().map(|&number| usize::try_from(number).ok()?.checked_sub(1));
    lowered
        .collect::<Option<_>>()
        .ok_or_else(|| ReadError::new(Kind::Damaged, format!("{name} holds numbers below 1")))
}

/// The message for files of machines that write the other byte first.
pub(super) fn big_endian(message: &str) -> ReadError {
    ReadError::new(Kind::Unsupported, format!("the file is big-endian ({message})"))
        .help("MODFLOW 6 writes little-endian files on today's machines")
}
