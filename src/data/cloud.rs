//! Places with a weight each.
//!
//! Owns their identity. May use nothing but numbers. It deliberately knows no units: all is in SI.

use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// Rows of a table: coordinates and a weight.
#[derive(Clone)]
pub struct Cloud {
    /// One column per coordinate, then the weights.
    columns: Vec<Vec<f64>>,
    hash: String,
}

/// Clouds of at most so many numbers stand whole in a plan; of others the hash does.
const SHOWN: usize = 1024;

impl Cloud {
    /// One sentence if the columns make no cloud: of one length, finite, weights of zero and more.
    pub fn new(columns: Vec<Vec<f64>>) -> Result<Self, String> {
        let n_rows = columns.first().map_or(0, Vec::len);
        if columns.len() < 2 || n_rows == 0 || columns.iter().any(|column| column.len() != n_rows) {
            return Err("columns of a cloud that differ in length".to_owned());
        }
        let weights = columns.last().into_iter().flatten();
        if columns.iter().flatten().any(|number| !number.is_finite()) || weights.clone().any(|w| *w < 0.0) {
            return Err("a number of a cloud that is none, or a weight below zero".to_owned());
        }
        let mut hasher = blake3::Hasher::new();
        hasher.update(b"cloud");
        for column in &columns {
            hasher.update(&(column.len() as u64).to_le_bytes());
            // One zero.
            for portion in column.chunks(8192) {
                let bytes: Vec<u8> = portion.iter().flat_map(|number| (number + 0.0).to_le_bytes()).collect();
                hasher.update(&bytes);
            }
        }
        let hash = hasher.finalize().to_hex().to_string();
        Ok(Self { columns, hash })
    }

    pub fn n_axes(&self) -> usize {
        self.columns.len() - 1
    }

    pub fn n_rows(&self) -> usize {
        self.columns[0].len()
    }

    /// Coordinates, one column each.
    pub fn coordinates(&self) -> &[Vec<f64>] {
        &self.columns[..self.n_axes()]
    }

    /// Sums of the weights up to each row, with what each addition loses put into the next one.
    pub fn cumulative(&self) -> Vec<f64> {
        let (mut sum, mut lost) = (0.0_f64, 0.0_f64);
        let next = |weight: &f64| {
            let term = weight - lost;
            let next = sum + term;
            lost = (next - sum) - term;
            sum = next;
            sum
        };
        self.weights().iter().map(next).collect()
    }

    pub fn weights(&self) -> &[f64] {
        &self.columns[self.n_axes()]
    }
}

impl PartialEq for Cloud {
    fn eq(&self, other: &Self) -> bool {
        self.hash == other.hash
    }
}

impl std::fmt::Debug for Cloud {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{} places, {}", self.n_rows(), self.hash)
    }
}

/// A cloud in the text of a plan.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Shown {
    hash: String,
    rows: usize,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    columns: Option<Vec<Vec<f64>>>,
}

/// Serde of clouds that are held together.
pub mod shared {
    use super::{Arc, Cloud, SHOWN, Shown};
    use serde::{Deserialize, Deserializer, Serialize, Serializer, de::Error};

    pub fn serialize<S: Serializer>(cloud: &Arc<Cloud>, serializer: S) -> Result<S::Ok, S::Error> {
        let rows = cloud.n_rows();
        let is_shown = rows * cloud.columns.len() <= SHOWN;
        let columns = is_shown.then(|| cloud.columns.clone());
        Shown { hash: cloud.hash.clone(), rows, columns }.serialize(serializer)
    }

    pub fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Arc<Cloud>, D::Error> {
        let shown = Shown::deserialize(deserializer)?;
        let Some(columns) = shown.columns else {
            return Err(D::Error::custom(format!("{} places, which stand in their file only", shown.rows)));
        };
        let cloud = Cloud::new(columns).map_err(D::Error::custom)?;
        if cloud.hash != shown.hash {
            return Err(D::Error::custom("a cloud does not have the hash that it carries"));
        }
        Ok(Arc::new(cloud))
    }
}
