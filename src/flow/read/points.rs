//! The rectilinear grid that points lie on.
//!
//! Owns the coordinates of its lines, and which row is which point. May use the cells. It deliberately
//! interpolates nothing: a point that is missing, doubled or off the lines is an error that names its row.

use super::error::{Kind, Place, ReadError};
use super::table::RowPlaces;
use crate::flow::Cells;

/// Corners of a domain, m.
pub type Bounds = ([f64; 3], [f64; 3]);

/// Coordinates that differ by less than this part of the extent are one line: programs write the same
/// coordinate with different last digits.
const SAME: f64 = 1e-7;
/// Spacings that differ by less than this part of themselves are equal; files keep few digits.
const EQUAL: f64 = 1e-4;

/// Points by columns of coordinates.
pub(super) struct Points<'a> {
    pub at: Vec<Vec<f64>>,
    pub places: &'a RowPlaces,
    /// Rows of the table, where these are not all.
    pub rows: Option<Vec<u32>>,
}

impl Points<'_> {
    pub(super) fn row(&self, point: usize) -> usize {
        self.rows.as_ref().map_or(point, |rows| rows[point] as usize)
    }

    fn place(&self, point: usize) -> Place {
        self.places.of(self.row(point))
    }

    fn shown(&self, point: usize) -> String {
        shown(self.at.iter().map(|at| at[point]))
    }
}

fn shown(at: impl Iterator<Item = f64>) -> String {
    format!("({})", at.map(|x| format!("{x} m")).collect::<Vec<_>>().join(", "))
}

/// Lines along one axis.
struct Lines {
    /// Rising.
    at: Vec<f64>,
    /// Per point.
    of_point: Vec<u32>,
}

impl Lines {
    fn of(values: &[f64]) -> Self {
        let mut order: Vec<u32> = (0..values.len() as u32).collect();
        order.sort_unstable_by(|&a, &b| values[a as usize].total_cmp(&values[b as usize]));
        let (low, high) = (values[order[0] as usize], values[order[order.len() - 1] as usize]);
        let same = SAME * (high - low);
        let mut at = vec![low];
        let mut of_point = vec![0; values.len()];
        for point in order {
            let value = values[point as usize];
            if value - at[at.len() - 1] > same {
                at.push(value);
            }
            of_point[point as usize] = at.len() as u32 - 1;
        }
        Self { at, of_point }
    }
}

/// Lines along each axis.
pub(super) struct Grid {
    lines: Vec<Lines>,
}

impl Grid {
    pub(super) fn of(points: &Points) -> Result<Self, ReadError> {
        if points.at.iter().any(Vec::is_empty) {
            return Err(ReadError::new(Kind::Missing, "the table has no row for one of the directions"));
        }
        if u32::try_from(points.at[0].len()).is_err() {
            return Err(ReadError::new(Kind::Unsupported, "the table has more than 2^32 rows"));
        }
        Ok(Self { lines: points.at.iter().map(|at| Lines::of(at)).collect() })
    }

    /// Which point stands on each crossing of lines; the last axis is fastest.
    pub(super) fn row_of_cell(&self, points: &Points) -> Result<Vec<u32>, ReadError> {
        let n_points = points.at[0].len();
        let n: Vec<usize> = self.lines.iter().map(|lines| lines.at.len()).collect();
        let n_cells = n.iter().try_fold(1usize, |product, &n| product.checked_mul(n));
        let Some(n_cells) = n_cells.filter(|&n_cells| n_cells <= 2 * n_points) else {
            return Err(self.irregular(points));
        };
        let mut rows = vec![u32::MAX; n_cells];
        for point in 0..n_points {
            let crossing =
                self.lines.iter().fold(0, |idx, lines| idx * lines.at.len() + lines.of_point[point] as usize);
            let first = rows[crossing];
            if first != u32::MAX {
                let message = format!("the point {} is there twice", points.shown(point));
                return Err(ReadError::new(Kind::Points, message)
                    .at(points.place(point))
                    .help(format!("it stands in {}, too", points.place(first as usize))));
            }
            rows[crossing] = point as u32;
        }
        match rows.iter().position(|&row| row == u32::MAX) {
            None => Ok(rows),
            Some(crossing) => Err(self.missing(points, &rows, crossing)),
        }
    }

    /// A crossing without a point: either one is missing there, or a point off the lines made the lines.
    fn missing(&self, points: &Points, rows: &[u32], crossing: usize) -> ReadError {
        if let Some(error) = self.lonely(points) {
            return error;
        }
        let mut rest = crossing;
        let mut at = vec![0.0; self.lines.len()];
        for axis in (0..at.len()).rev() {
            at[axis] = self.lines[axis].at[rest % self.lines[axis].at.len()];
            rest /= self.lines[axis].at.len();
        }
        let n_missing = rows.iter().filter(|&&row| row == u32::MAX).count();
        let message = match n_missing {
            1 => format!("there is no row for the point {}", shown(at.into_iter())),
            n => format!("there is no row for {n} points; the first is {}", shown(at.into_iter())),
        };
        // The nearest that is there, in the order of the grid.
        let before = rows[..crossing].iter().rev().chain(&rows[crossing..]).find(|&&row| row != u32::MAX);
        let error =
            ReadError::new(Kind::Points, message).help("every crossing of the grid's lines needs one row");
        match before {
            Some(&row) => error.at(points.place(row as usize)),
            None => error,
        }
    }

    fn irregular(&self, points: &Points) -> ReadError {
        self.lonely(points).unwrap_or_else(|| {
            let n: Vec<String> = self.lines.iter().map(|lines| lines.at.len().to_string()).collect();
            let message = format!(
                "{} points do not fill the {} crossings of their lines",
                points.at[0].len(),
                n.join(" x ")
            );
            ReadError::new(Kind::Points, message).help("the points must lie on a rectilinear grid")
        })
    }

    /// A point with a coordinate that few others have.
    fn lonely(&self, points: &Points) -> Option<ReadError> {
        for (axis, lines) in self.lines.iter().enumerate() {
            let mut count = vec![0usize; lines.at.len()];
            lines.of_point.iter().for_each(|&line| count[line as usize] += 1);
            let most = *count.iter().max()?;
            let point = lines.of_point.iter().position(|&line| 2 * count[line as usize] < most);
            if let Some(point) = point {
                let name = ["x", "y", "z"][axis];
                let n = count[lines.of_point[point] as usize];
                let message = format!(
                    "{name} = {} m stands in {n} of {} rows, other {name} in up to {most}",
                    points.at[axis][point],
                    points.at[0].len()
                );
                return Some(
                    ReadError::new(Kind::Points, message)
                        .at(points.place(point))
                        .help("the points must lie on a rectilinear grid"),
                );
            }
        }
        None
    }

    /// Cells with the lines in their middle.
    pub(super) fn cells_of_centres(
        &self,
        points: &Points,
        bounds: Option<Bounds>,
    ) -> Result<Cells, ReadError> {
        let mut edges = [vec![0.0, 1.0], vec![0.0, 1.0], vec![0.0, 1.0]];
        for (axis, lines) in self.lines.iter().enumerate() {
            let ends = bounds.map(|(low, high)| (low[axis], high[axis]));
            edges[axis] = edges_around(&lines.at, ends).map_err(|message| {
                let name = ["x", "y", "z"][axis];
                let odd = lines.of_point.iter().position(|&line| line as usize == message.line).unwrap_or(0);
                ReadError::new(Kind::Points, format!("{name} = {} m: {}", points.at[axis][odd], message.text))
                    .at(points.place(odd))
                    .help(message.help)
            })?;
        }
        Cells::new(edges).ok_or_else(|| ReadError::new(Kind::Points, "the edges of the cells do not rise"))
    }
}

struct Odd {
    line: usize,
    text: String,
    help: &'static str,
}

/// Edges with the given values in the middle between them.
///
/// - Equation: `e₀ =` lower end, `e_{i+1} = 2 c_i − e_i`; with equal spacing `e_i = c₀ + (i − ½) w`.
/// - Symbols: `c` middles, `e` edges, `w` spacing.
/// - Range: uneven spacing needs the ends of the domain; the last edge must meet the upper one.
/// - Source: a middle is the mean of its edges.
/// - Shape: one edge more than middles.
fn edges_around(middles: &[f64], ends: Option<(f64, f64)>) -> Result<Vec<f64>, Odd> {
    let n = middles.len();
    let (first, last) = (middles[0], middles[n - 1]);
    let spacing = match ends {
        Some((low, high)) if n == 1 => high - low,
        _ if n == 1 => {
            let help = "give the domain, or at least two points along this axis";
            return Err(Odd { line: 0, text: "one point alone has no size".into(), help });
        }
        _ => (last - first) / (n - 1) as f64,
    };
    let odd = (0..n).find(|&idx| (middles[idx] - (first + spacing * idx as f64)).abs() > EQUAL * spacing);
    let Some(odd) = odd else {
        let equal = equal_edges(first - 0.5 * spacing, last + 0.5 * spacing, n);
        let Some((low, high)) = ends else { return Ok(equal) };
        let fits = (equal[0] - low).abs() <= EQUAL * spacing && (equal[n] - high).abs() <= EQUAL * spacing;
        // The domain's own numbers, which have no rounding of a file.
        return Ok(if fits { equal_edges(low, high, n) } else { equal });
    };
    let Some((low, high)) = ends else {
        let help = "with uneven spacing give the corners of the grid, or faces instead of middles of cells";
        return Err(Odd { line: odd, text: "the spacing is uneven, so edges cannot be told".into(), help });
    };
    let mut edges = vec![low];
    for (line, middle) in middles.iter().enumerate() {
        let edge = 2.0 * middle - edges[line];
        if edge <= *middle {
            let help = "points are middles of cells that fill the domain from its lower end";
            return Err(Odd {
                line,
                text: "no cell around it can begin where the one before ends".into(),
                help,
            });
        }
        edges.push(edge);
    }
    let narrowest = edges.windows(2).map(|pair| pair[1] - pair[0]).fold(f64::INFINITY, f64::min);
    if (edges[n] - high).abs() > 1e-3 * narrowest {
        let text = format!("the last cell would end at {} m, the domain at {high} m", edges[n]);
        return Err(Odd { line: n - 1, text, help: "points are middles of cells that fill the domain" });
    }
    edges[n] = high;
    Ok(edges)
}

fn equal_edges(low: f64, high: f64, n: usize) -> Vec<f64> {
    let width = (high - low) / n as f64;
    (0..=n).map(|idx| if idx == n { high } else { low + width * idx as f64 }).collect()
}

/// Cells whose faces stand on the lines: along its own normal a face is an edge, along the others it lies in
/// the middle between two.
pub(super) fn cells_of_faces(grids: &[Grid], parts: &[Points]) -> Result<Cells, ReadError> {
    let mut edges = [vec![0.0, 1.0], vec![0.0, 1.0], vec![0.0, 1.0]];
    for (axis, grid) in grids.iter().enumerate() {
        edges[axis].clone_from(&grid.lines[axis].at);
    }
    for (axis, (grid, points)) in grids.iter().zip(parts).enumerate() {
        for (other, lines) in grid.lines.iter().enumerate().filter(|(other, _)| *other != axis) {
            let edges = &edges[other];
            let fits = |idx: usize| {
                let Some(pair) = edges.get(idx..idx + 2) else { return false };
                (lines.at[idx] - 0.5 * (pair[0] + pair[1])).abs() <= 1e-3 * (pair[1] - pair[0])
            };
            let n = lines.at.len();
            let odd = (0..n).find(|&idx| !fits(idx)).or((n + 1 != edges.len()).then_some(n - 1));
            let Some(odd) = odd else { continue };
            let point = lines.of_point.iter().position(|&line| line as usize == odd).unwrap_or(0);
            let (own, name) = (["x", "y", "z"][axis], ["x", "y", "z"][other]);
            let message = format!(
                "a face normal to {own} at {name} = {} m, which is not the middle between two faces normal to {name}",
                lines.at[odd]
            );
            return Err(ReadError::new(Kind::Points, message).at(points.place(point)));
        }
    }
    Cells::new(edges).ok_or_else(|| {
        ReadError::new(Kind::Points, "along one axis there is one face only")
            .help("a cell has two faces per axis")
    })
}
