//! Means, lines and fronts of a few numbers.
//!
//! Owns what a report computes from aggregates. May use `maths`. It deliberately knows no names and
//! no units.

use crate::maths::student::quantile;

/// Number, mean and spread of values that are seen once.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Moments {
    pub n: u64,
    pub mean: f64,
    /// Sum of squared distances from the mean.
    squares: f64,
}

impl Moments {
    /// Values that are not finite are left out.
    ///
    /// Source: Welford, Technometrics 4 (1962) 419: no difference of large sums
    pub fn add(&mut self, value: f64) {
        if value.is_finite() {
            self.n += 1;
            let from_old = value - self.mean;
            self.mean += from_old / self.n as f64;
            self.squares += from_old * (value - self.mean);
        }
    }

    /// The mean, if there is a value.
    pub fn mean(&self) -> Option<f64> {
        (self.n > 0).then_some(self.mean)
    }

    /// Standard deviation with n − 1; none of a single value.
    pub fn deviation(&self) -> Option<f64> {
        (self.n > 1).then(|| (self.squares / (self.n - 1) as f64).sqrt())
    }

    /// Standard error of the mean.
    pub fn standard_error(&self) -> Option<f64> {
        self.deviation().map(|deviation| deviation / (self.n as f64).sqrt())
    }
}

/// A slope that is common to several series, each with its own intercept.
#[derive(Debug, Clone, PartialEq)]
pub struct Slope {
    pub slope: f64,
    /// Half of the 95 % confidence interval; none where there is no degree of freedom.
    pub half_width: Option<f64>,
    /// For each series; none of one that adds nothing.
    pub intercepts: Vec<Option<f64>>,
    pub n: usize,
}

/// Least squares of y = intercept of the series + slope × x, from the residuals alone.
///
/// Equation: b = Σ (x − x̄ₛ)(y − ȳₛ) / Σ (x − x̄ₛ)²; half width t₀.₉₅(ν) √(Σ r² / ν / Σ (x − x̄ₛ)²)
/// Symbols: x̄ₛ, ȳₛ means over series s; r residuals; ν = points − series − 1
/// Dimensions and range: plain numbers, here logarithms; series with one place of x add nothing
/// Source: Draper and Smith, Applied Regression Analysis, 3rd ed., chapters 1 and 14
/// Shape: a line per series, all with one slope
pub fn fit(series: &[Vec<(f64, f64)>]) -> Option<Slope> {
    let is_usable = |points: &Vec<(f64, f64)>| points.iter().any(|point| point.0 != points[0].0);
    let mean = |points: &[(f64, f64)], of: fn(&(f64, f64)) -> f64| {
        points.iter().map(of).sum::<f64>() / points.len() as f64
    };
    let (mut sxx, mut sxy, mut n, mut n_series) = (0.0, 0.0, 0, 0);
    let means: Vec<Option<(f64, f64)>> = series
        .iter()
        .map(|points| is_usable(points).then(|| (mean(points, |p| p.0), mean(points, |p| p.1))))
        .collect();
    for (points, middle) in series.iter().zip(&means) {
        let Some((mx, my)) = middle else { continue };
        n += points.len();
        n_series += 1;
        sxx += points.iter().map(|(x, _)| (x - mx) * (x - mx)).sum::<f64>();
        sxy += points.iter().map(|(x, y)| (x - mx) * (y - my)).sum::<f64>();
    }
    if n_series == 0 || sxx <= 0.0 {
        return None;
    }
    let slope = sxy / sxx;
    let intercepts: Vec<Option<f64>> =
        means.iter().map(|middle| middle.map(|(mx, my)| my - slope * mx)).collect();
    let residuals = series.iter().zip(&intercepts).filter_map(|(points, a)| a.map(|a| (points, a)));
    let rss: f64 = residuals
        .flat_map(|(points, a)| points.iter().map(move |(x, y)| y - a - slope * x))
        .map(square)
        .sum();
    let degrees = n.saturating_sub(n_series + 1);
    let half_width = (degrees > 0).then(|| {
        let degrees = u32::try_from(degrees).unwrap_or(u32::MAX);
        quantile(0.95, degrees) * (rss / f64::from(degrees) / sxx).sqrt()
    });
    Some(Slope { slope, half_width, intercepts, n })
}

fn square(value: f64) -> f64 {
    value * value
}

/// Indices of the points that no other beats in both coordinates, less being better, by rising cost. Of
/// equal points the first.
pub fn pareto(points: &[(f64, f64)]) -> Vec<usize> {
    let is_number = |idx: &usize| points[*idx].0.is_finite() && points[*idx].1.is_finite();
    let mut order: Vec<usize> = (0..points.len()).filter(is_number).collect();
    order.sort_by(|&a, &b| {
        points[a].0.total_cmp(&points[b].0).then(points[a].1.total_cmp(&points[b].1)).then(a.cmp(&b))
    });
    let mut least = f64::INFINITY;
    order.retain(|&idx| {
        let is_better = points[idx].1 < least;
        least = least.min(points[idx].1);
        is_better
    });
    order
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn moments_are_those_of_the_closed_form() {
        let mut moments = Moments::default();
        // 1e9 + 1 … 5: mean 1e9 + 3, variance 10 / 4.
        for k in 1..=5 {
            moments.add(1e9 + f64::from(k));
        }
        moments.add(f64::NAN);
        assert_eq!((moments.n, moments.mean()), (5, Some(1e9 + 3.0)));
        assert_eq!(moments.deviation(), Some(2.5f64.sqrt()));
        assert_eq!(moments.standard_error(), Some(2.5f64.sqrt() / 5f64.sqrt()));
        assert_eq!(Moments::default().mean(), None);
    }

    /// Three points at equal distances h: slope (y₃ − y₁) / 2h, Σ r² = (y₁ − 2 y₂ + y₃)² / 6, one degree.
    #[test]
    fn a_line_through_three_points_is_the_closed_form() {
        let found = fit(&[vec![(0.0, 1.0), (2.0, 2.5), (4.0, 3.0)]]).unwrap();
        let rss = (1.0f64 - 5.0 + 3.0).powi(2) / 6.0;
        let half = libm::tan(0.475 * std::f64::consts::PI) * (rss / 8.0).sqrt();
        assert!((found.slope - 0.5).abs() < 1e-15);
        assert!((found.half_width.unwrap() / half - 1.0).abs() < 1e-12, "{found:?}");
        assert_eq!(fit(&[vec![(0.0, 1.0), (2.0, 2.0)]]).unwrap().half_width, None);
        assert_eq!(fit(&[vec![(1.0, 1.0), (1.0, 2.0)], vec![]]), None);
    }

    /// Each series has its level: a fit through all points at once would give another slope.
    #[test]
    fn series_have_one_slope_and_their_own_levels() {
        let line = |level: f64, start: f64| {
            (0..3).map(move |k| start + f64::from(k)).map(move |x| (x, level - 0.5 * x))
        };
        let found = fit(&[line(3.0, 0.0).collect(), line(9.0, 5.0).collect(), vec![(7.0, 1.0)]]).unwrap();
        assert!((found.slope + 0.5).abs() < 1e-15 && found.half_width.unwrap() < 1e-14, "{found:?}");
        assert_eq!((found.intercepts[0], found.intercepts[2], found.n), (Some(3.0), None, 6));
    }

    #[test]
    fn the_front_holds_what_nothing_beats() {
        let points =
            [(4.0, 1.0), (1.0, 8.0), (2.0, 8.0), (2.0, 3.0), (3.0, 3.0), (5.0, f64::NAN), (4.0, 1.0)];
        assert_eq!(pareto(&points), [1, 3, 0]);
    }
}
