//! A function of one to three coordinates by its values on a rectangular grid.
//!
//! Owns interpolation, its slopes, and its identity. May use nothing but numbers. It deliberately knows no units: all
//! is in SI.

use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// What a table is between its rows.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Rule {
    /// Straight lines along every axis.
    Linear,
    /// A value holds until the next row; one coordinate only.
    Steps,
}

/// What a table is beyond its first and last rows.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Beyond {
    /// The value at the edge.
    #[default]
    Hold,
    /// No number.
    Nothing,
}

/// What is asked of a table.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Lookup {
    Value,
    /// The derivative along an axis.
    Slope(u8),
}

/// Values on a grid.
#[derive(Clone)]
pub struct Table {
    axes: Vec<Vec<f64>>,
    /// The last axis fastest.
    values: Vec<f64>,
    rule: Rule,
    hash: String,
    lowest: f64,
    highest: f64,
}

/// Tables of at most so many numbers stand whole in a plan; of others the hash does.
const SHOWN: usize = 1024;

impl Table {
    /// One sentence if the parts make no table: one to three axes that rise, a finite value at each point.
    pub fn new(axes: Vec<Vec<f64>>, values: Vec<f64>, rule: Rule) -> Result<Self, String> {
        let rises = |axis: &Vec<f64>| !axis.is_empty() && axis.windows(2).all(|pair| pair[0] < pair[1]);
        let n_axes = axes.len();
        if !(1..=3).contains(&n_axes) || (rule == Rule::Steps && n_axes > 1) {
            return Err(format!("a table of {n_axes} coordinates"));
        }
        if !axes.iter().all(rises) || !axes.iter().flatten().chain(&values).all(|number| number.is_finite()) {
            return Err("coordinates of a table that do not rise, or numbers that are none".to_owned());
        }
        let n_points = axes.iter().try_fold(1_usize, |n, axis| n.checked_mul(axis.len()));
        if n_points != Some(values.len()) {
            return Err(format!("{} values on a grid of another size", values.len()));
        }
        let hash = hash(&axes, &values, rule);
        let lowest = values.iter().copied().fold(f64::INFINITY, f64::min);
        let highest = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        Ok(Self { axes, values, rule, hash, lowest, highest })
    }

    pub fn axes(&self) -> &[Vec<f64>] {
        &self.axes
    }

    pub fn n_axes(&self) -> usize {
        self.axes.len()
    }

    pub fn values(&self) -> &[f64] {
        &self.values
    }

    pub fn rule(&self) -> Rule {
        self.rule
    }

    /// BLAKE3 of rule, coordinates and values.
    pub fn hash(&self) -> &str {
        &self.hash
    }

    /// The smallest and the largest value.
    pub fn range(&self) -> (f64, f64) {
        (self.lowest, self.highest)
    }

    /// From where to where the table speaks along an axis. A row of a grid may stand for the middle of a cell, so
    /// that it speaks for half a spacing beyond its last row; steps hold on for ever.
    pub fn extent(&self, axis: usize) -> (f64, f64) {
        let points = &self.axes[axis];
        let (first, last) = (points[0], points[points.len() - 1]);
        match (self.rule, points.len()) {
            (Rule::Steps, _) => (first, f64::INFINITY),
            (Rule::Linear, 1) => (first, last),
            (Rule::Linear, n) => (first - 0.5 * (points[1] - first), last + 0.5 * (last - points[n - 2])),
        }
    }

    /// Whether the table speaks of all coordinates between two, but for the rounding of half a spacing.
    pub fn speaks_of(&self, axis: usize, low: f64, high: f64) -> bool {
        let (first, last) = self.extent(axis);
        let slack = if last.is_finite() { 1e-9 * (last - first) } else { 0.0 };
        first - slack <= low && high <= last + slack
    }

    /// The value, or a slope, at a place; `beyond` says what there is outside of the rows.
    pub fn look(&self, lookup: Lookup, at: [f64; 3], beyond: Beyond) -> f64 {
        let is_inside = |axis: usize| {
            let (points, x) = (&self.axes[axis], at[axis]);
            points[0] <= x && (x <= points[points.len() - 1] || self.rule == Rule::Steps)
        };
        if beyond == Beyond::Nothing && !(0..self.n_axes()).all(is_inside) {
            return f64::NAN;
        }
        match lookup {
            Lookup::Value => self.value(at),
            Lookup::Slope(axis) => self.slope(usize::from(axis), at),
        }
    }

    /// The value at a place.
    ///
    /// - Equation: `f(x) = Σ_c Π_i w_i v_c` over the corners c of the cell that holds x, with `w = 1 − f` at its
    ///   lower and `f` at its upper end, `f = (x − x_k)/(x_{k+1} − x_k)`; of steps the value of the last row at or
    ///   before x.
    /// - Symbols: `v` values, `x_k` coordinates of rows.
    /// - Range: any place; beyond the edge that of the edge; no number where a coordinate is none.
    /// - Source: definition; piecewise linear along each axis, hence exact at rows and continuous.
    /// - Shape: one number.
    pub fn value(&self, at: [f64; 3]) -> f64 {
        self.sum(at, None)
    }

    /// The derivative of [`Table::value`] along an axis: towards larger coordinates at a row, zero beyond the edge.
    ///
    /// - Equation: as the value, with `w = ∓1/(x_{k+1} − x_k)` along the axis.
    /// - Symbols: as there.
    /// - Range: any place; zero of steps.
    /// - Source: definition.
    /// - Shape: one number.
    pub fn slope(&self, axis: usize, at: [f64; 3]) -> f64 {
        if self.rule == Rule::Steps { 0.0 } else { self.sum(at, Some(axis)) }
    }

    fn sum(&self, at: [f64; 3], along: Option<usize>) -> f64 {
        let n_axes = self.n_axes();
        let mut corners = [0_usize; 8];
        let mut weights = [1.0_f64; 8];
        let mut n_corners = 1;
        for (axis, points) in self.axes.iter().enumerate() {
            if at[axis].is_nan() {
                return f64::NAN;
            }
            let (cell, weight) = match along {
                Some(own) if own == axis => steepness(points, at[axis]),
                _ => self.share(points, at[axis]),
            };
            let upper = (cell + 1).min(points.len() - 1);
            for corner in 0..n_corners {
                let (base, own) = (corners[corner] * points.len(), weights[corner]);
                corners[corner] = base + cell;
                weights[corner] = own * weight[0];
                corners[corner + n_corners] = base + upper;
                weights[corner + n_corners] = own * weight[1];
            }
            n_corners *= 2;
        }
        debug_assert_eq!(n_corners, 1 << n_axes);
        let terms = corners.iter().zip(&weights).take(n_corners).filter(|(_, weight)| **weight != 0.0);
        terms.map(|(&corner, &weight)| self.values[corner] * weight).sum()
    }

    /// The cell of a coordinate and the weights of its two ends.
    fn share(&self, points: &[f64], x: f64) -> (usize, [f64; 2]) {
        let cell = cell_of(points, x);
        if self.rule == Rule::Steps || points.len() == 1 {
            // `cell_of` holds the last cell for what is at the last row.
            let cell =
                if points.len() > 1 && x >= points[points.len() - 1] { points.len() - 1 } else { cell };
            return (cell, [1.0, 0.0]);
        }
        let (from, to) = (points[cell], points[cell + 1]);
        let part = ((x - from) / (to - from)).clamp(0.0, 1.0);
        (cell, [1.0 - part, part])
    }
}

/// The last cell that begins at or before a coordinate; the first or the last one beyond the edges.
fn cell_of(points: &[f64], x: f64) -> usize {
    let after = points.partition_point(|&point| point <= x);
    after.saturating_sub(1).min(points.len().saturating_sub(2))
}

/// The cell of a coordinate, and what its ends give to the slope.
fn steepness(points: &[f64], x: f64) -> (usize, [f64; 2]) {
    let cell = cell_of(points, x);
    if points.len() == 1 || x < points[0] || x >= points[points.len() - 1] {
        return (cell, [0.0, 0.0]);
    }
    let inverse = 1.0 / (points[cell + 1] - points[cell]);
    (cell, [-inverse, inverse])
}

fn hash(axes: &[Vec<f64>], values: &[f64], rule: Rule) -> String {
    let mut hasher = blake3::Hasher::new();
    hasher.update(&[rule as u8, axes.len() as u8]);
    for numbers in axes.iter().map(Vec::as_slice).chain([values]) {
        hasher.update(&(numbers.len() as u64).to_le_bytes());
        for portion in numbers.chunks(8192) {
            // One zero.
            let bytes: Vec<u8> = portion.iter().flat_map(|number| (number + 0.0).to_le_bytes()).collect();
            hasher.update(&bytes);
        }
    }
    hasher.finalize().to_hex().to_string()
}

/// Two tables with one hash are one.
impl PartialEq for Table {
    fn eq(&self, other: &Self) -> bool {
        self.hash == other.hash
    }
}

impl std::fmt::Debug for Table {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let shape: Vec<String> = self.axes.iter().map(|axis| axis.len().to_string()).collect();
        write!(f, "{:?} table of {}, {}", self.rule, shape.join(" x "), self.hash)
    }
}

/// A table in the text of a plan.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Shown {
    hash: String,
    rule: Rule,
    /// Numbers along each axis.
    shape: Vec<usize>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    axes: Option<Vec<Vec<f64>>>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    values: Option<Vec<f64>>,
}

/// Serde of tables that several expressions share.
pub mod shared {
    use super::{Arc, SHOWN, Shown, Table};
    use serde::{Deserialize, Deserializer, Serialize, Serializer, de::Error};

    pub fn serialize<S: Serializer>(table: &Arc<Table>, serializer: S) -> Result<S::Ok, S::Error> {
        let is_shown = table.values.len() <= SHOWN;
        let shown = Shown {
            hash: table.hash.clone(),
            rule: table.rule,
            shape: table.axes.iter().map(Vec::len).collect(),
            axes: is_shown.then(|| table.axes.clone()),
            values: is_shown.then(|| table.values.clone()),
        };
        shown.serialize(serializer)
    }

    pub fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Arc<Table>, D::Error> {
        let shown = Shown::deserialize(deserializer)?;
        let (Some(axes), Some(values)) = (shown.axes, shown.values) else {
            let size: Vec<String> = shown.shape.iter().map(usize::to_string).collect();
            let text = format!("a table of {} numbers, which stand in its file only", size.join(" x "));
            return Err(D::Error::custom(text));
        };
        let table = Table::new(axes, values, shown.rule).map_err(D::Error::custom)?;
        if table.hash != shown.hash {
            return Err(D::Error::custom("a table does not have the hash that it carries"));
        }
        Ok(Arc::new(table))
    }
}
