//! What would make the errors smaller for the least time.
//!
//! Owns the comparison of remedies. May use the error bars. It deliberately changes no run.

use super::ErrorBar;
use crate::maths::scalar::{exp, ln};

/// A change of the scene.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Remedy {
    TwiceTheParticles,
    HalfTheStep,
    TwiceTheBins,
}

impl Remedy {
    const ALL: [Self; 3] = [Self::TwiceTheParticles, Self::HalfTheStep, Self::TwiceTheBins];

    /// Time of the run, as a multiple. Bins cost next to nothing; a little, so that a gain of nothing
    /// is not the best one.
    fn cost(self) -> f64 {
        match self {
            Self::TwiceTheParticles | Self::HalfTheStep => 2.0,
            Self::TwiceTheBins => 1.1,
        }
    }

    pub fn text(self) -> &'static str {
        match self {
            Self::TwiceTheParticles => "twice the particles",
            Self::HalfTheStep => "half the step",
            Self::TwiceTheBins => "twice the bins along each axis",
        }
    }
}

/// The remedy with the largest gain for its cost.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Advice {
    pub remedy: Remedy,
    /// What all error bars are multiplied with, in the geometric mean.
    pub factor: f64,
    /// What the time of the run is multiplied with.
    pub cost: f64,
}

/// Over the error bars of all times; `None` if nothing helps.
pub fn advice(bars: &[ErrorBar]) -> Option<Advice> {
    let whole: Vec<&ErrorBar> = bars.iter().filter(|bar| bar.t.is_none() && bar.parts.total > 0.0).collect();
    let advice = |(idx, remedy): (usize, Remedy)| {
        let logarithms = whole.iter().map(|bar| ln((bar.parts.remedied[idx] / bar.parts.total).max(1e-3)));
        let factor = exp(logarithms.sum::<f64>() / whole.len() as f64);
        Advice { remedy, factor, cost: remedy.cost() }
    };
    let gain = |advice: &Advice| -ln(advice.factor) / ln(advice.cost);
    Remedy::ALL
        .into_iter()
        .enumerate()
        .map(advice)
        .filter(|advice| advice.factor < 0.98)
        .max_by(|a, b| gain(a).total_cmp(&gain(b)))
}

#[cfg(test)]
mod tests {
    use super::super::Parts;
    use super::*;
    use crate::plan::{OutputKind, Quantity};

    fn bar(remedied: [f64; 3]) -> ErrorBar {
        let parts = Parts { total: 1.0, remedied, ..Parts::default() };
        let quantity = Quantity::Species(0);
        ErrorBar { output_idx: 0, kind: OutputKind::Total, quantity, t: None, n: 1, size: 1.0, parts }
    }

    #[test]
    fn the_largest_gain_for_its_cost_wins() {
        let of = |remedied| advice(&[bar(remedied)]).map(|advice| advice.remedy);
        assert_eq!(of([0.71, 1.0, 1.0]), Some(Remedy::TwiceTheParticles));
        assert_eq!(of([0.9, 0.6, 1.0]), Some(Remedy::HalfTheStep));
        assert_eq!(of([0.71, 1.0, 0.8]), Some(Remedy::TwiceTheBins));
        assert_eq!(of([1.0, 1.0, 1.3]), None);
        assert_eq!(advice(&[]), None);
    }
}
