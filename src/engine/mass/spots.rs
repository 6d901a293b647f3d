//! Single places that share a mass by their weights.
//!
//! Owns the map from a share of the mass to a place. May use the search beside it. It deliberately moves nothing: a
//! particle begins exactly at a place.

use super::running::Running;
use crate::data::Cloud;

/// Places and the sums of their weights.
#[derive(Debug, Clone, PartialEq)]
pub struct Spots<const D: usize> {
    places: Vec<[f64; D]>,
    weights: Running,
}

impl<const D: usize> Spots<D> {
    pub fn new(cloud: &Cloud) -> Self {
        let at = |row: usize| {
            std::array::from_fn(|axis| cloud.coordinates().get(axis).map_or(0.0, |column| column[row]))
        };
        Self { places: (0..cloud.n_rows()).map(at).collect(), weights: Running::new(cloud.cumulative()) }
    }

    /// The place of the particle before which this share of the mass comes. With shares at equal distances, as
    /// stratified ones are, a place of weight w out of W has `n w/W` of n particles, rounded up or down; where all
    /// weigh the same and n is their number, each has one.
    pub fn at(&self, share: f64) -> [f64; D] {
        let (row, _) = self.weights.find(share * self.weights.total());
        self.places.get(row).copied().unwrap_or([0.0; D])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Particles per place, for stratified shares at a fixed part of their stratum.
    fn counts(weights: &[f64], n: usize, part: f64) -> Vec<usize> {
        let rows = (0..weights.len()).map(|row| row as f64).collect();
        let spots: Spots<1> = Spots::new(&Cloud::new(vec![rows, weights.to_vec()]).expect("a cloud"));
        let mut counts = vec![0; weights.len()];
        for k in 0..n {
            counts[spots.at((k as f64 + part) / n as f64)[0] as usize] += 1;
        }
        counts
    }

    #[test]
    fn equal_weights_have_one_particle_each() {
        for part in [0.01, 0.5, 0.99] {
            assert_eq!(counts(&[0.1; 1000], 1000, part), [1; 1000]);
        }
    }

    #[test]
    fn unequal_weights_have_their_shares_to_one_particle() {
        let weights = [1.0, 0.0, 3.0, 6.0, 2.5];
        for part in [0.1, 0.6, 0.9] {
            let counts = counts(&weights, 1000, part);
            for (count, weight) in counts.iter().zip(weights) {
                assert!((*count as f64 - 1000.0 * weight / 12.5).abs() <= 1.0, "{counts:?}");
            }
            assert_eq!((counts[1], counts.iter().sum::<usize>()), (0, 1000));
        }
    }
}
