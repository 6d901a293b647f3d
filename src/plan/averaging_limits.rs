//! Limits of means over the parcels around: how many are in one, and how far zones disperse by them.
//!
//! Owns these numbers (N101, N103, N201, N203, N207). May use the sizes of the mean, and `scenario` for the places. It
//! deliberately asks nothing about single parcels.

use super::averaging::Extents;
use super::exchange_limits::MOST_NEIGHBOURS;
use super::limits::{
    FEW_PER_BIN, Limit, TOO_FEW_PER_BIN, VISIBLE_DISPERSION, VISIBLE_SPREADING, axis_name, dispersion, short,
    short_up,
};
use super::{Plan, ZoneRate};
use crate::diagnostic::Diagnostic;
use crate::diagnostic::codes::{N101, N103, N201, N203, N207};
use crate::maths::scalar::pow;
use crate::scenario::Scenario;
use crate::source::Span;

struct Sized<'a> {
    scenario: &'a Scenario,
    plan: &'a Plan,
    extents: Extents,
    /// Where the bandwidth is written.
    place: Span,
}

/// Works them out; diagnostics tell of those that are passed.
pub(super) fn check(
    scenario: &Scenario,
    plan: &Plan,
    limits: &mut Vec<Limit>,
    diagnostics: &mut Vec<Diagnostic>,
) {
    let averaging = plan.averaging();
    let (Some(averaging), Some(written)) = (averaging, &scenario.averaging) else { return };
    let sized = Sized { scenario, plan, extents: averaging.extents(plan), place: written.bandwidth.span };
    let Extents { spacing, bandwidth, variance, effective, .. } = sized.extents;
    if ![spacing, bandwidth, variance, effective].into_iter().all(|it| it > 0.0 && it.is_finite()) {
        diagnostics.push(sized.no_length());
        return;
    }
    if let Some(refused) = sized.out_of_reach() {
        diagnostics.push(refused);
        return;
    }
    sized.few(limits, diagnostics);
    sized.dispersion(limits, diagnostics);
}

/// What zones disperse by exchange with parcels around, m²/s.
///
/// - Equation: `D_num = Σ_i η_i χ_i σ²/4 / Σ_i η_i` over the zones that set the mean.
/// - Symbols: η_i fraction, χ_i rate, σ² mean square of the kernel's distance along an axis.
/// - Range: any, whether parcels move or rest: an exchange at the rate χ/2 with parcels that far.
/// - Source: methods, section 7.4 (`χ h²/4` for a Gaussian).
/// - Shape: one number, the same along all axes.
fn numerical(plan: &Plan, variance: f64) -> f64 {
    let (mut sum, mut weight) = (0.0, 0.0);
    for zone in plan.mixing.iter().flat_map(|mixing| &mixing.zones) {
        if let ZoneRate::Finite(rate) = zone.rate {
            sum += zone.fraction * rate * variance / 4.0;
            weight += zone.fraction;
        }
    }
    if weight > 0.0 { sum / weight } else { 0.0 }
}

impl Sized<'_> {
    fn no_length(&self) -> Diagnostic {
        let found = format!("a bandwidth of {} m", short(self.extents.bandwidth));
        Diagnostic::refused(N207, "the bandwidth of the mean is no length to average over")
            .at(self.place, found.clone())
            .found(format!("{found} for parcels {} m apart", short(self.extents.spacing)))
            .expected("a length above zero, of a size that numbers can hold")
            .help("write a length that fits the parcels, such as `bandwidth 3 * spacing`")
    }

    fn parcels(&self, message: Diagnostic) -> Diagnostic {
        let apart = format!("parcels {} m apart", short(self.extents.spacing));
        message.also(self.scenario.particles.count_span, apart)
    }

    fn out_of_reach(&self) -> Option<Diagnostic> {
        let Extents { neighbours, radius, bandwidth, .. } = self.extents;
        (neighbours > MOST_NEIGHBOURS).then(|| {
            let share = pow(MOST_NEIGHBOURS / neighbours, 1.0 / self.plan.axes.len() as f64);
            let message = Diagnostic::refused(N207, "each mean would be over too many parcels")
                .at(self.place, format!("the kernel ends {} m away", short(radius * bandwidth)))
                .found(format!("{} parcels around each", short(neighbours)))
                .expected(format!("at most {}", short(MOST_NEIGHBOURS)))
                .help(format!(
                    "use a bandwidth of {} m or less, an earlier `cutoff`, fewer particles, or `average bins`",
                    short(share * bandwidth)
                ));
            self.parcels(message)
        })
    }

    /// As few parcels in a mean as bins with as much noise have.
    fn few(&self, limits: &mut Vec<Limit>, diagnostics: &mut Vec<Diagnostic>) {
        let Extents { effective, bandwidth, .. } = self.extents;
        limits.push(Limit {
            name: "parcels in a mean, as noisy as that of a bin".into(),
            formula: "(int W)^2 / (int W^2) N / V",
            value: effective,
            advice: "at least 50; above 1000 the bias of products is below 0.1 %",
        });
        if effective >= FEW_PER_BIN {
            return;
        }
        let d = self.plan.axes.len();
        let wider = short_up(bandwidth * pow(FEW_PER_BIN / effective, 1.0 / d as f64));
        let more = (self.plan.particles.count as f64 * FEW_PER_BIN / effective).ceil();
        let (code, title) = match effective < TOO_FEW_PER_BIN {
            true => (N201, "a kernel that reaches nobody has no mean to exchange with"),
            false => (N101, "means over few particles are mostly noise"),
        };
        let message = match effective < TOO_FEW_PER_BIN {
            true => Diagnostic::refused(code, title),
            false => Diagnostic::warning(code, title),
        };
        let message = message
            .at(self.place, format!("a bandwidth of {} m", short(bandwidth)))
            .found(format!("the mean of {} parcels", short(effective)))
            .expected(format!("at least {FEW_PER_BIN}"))
            .help(format!("use a bandwidth of `{wider} m` or more, or at least {more} particles"));
        diagnostics.push(self.parcels(message));
    }

    fn dispersion(&self, limits: &mut Vec<Limit>, diagnostics: &mut Vec<Diagnostic>) {
        let added = numerical(self.plan, self.extents.variance);
        if added == 0.0 {
            return;
        }
        let along = (0..self.plan.axes.len()).map(|idx| (idx, dispersion(self.plan, idx)));
        let Some((idx, least)) = along.min_by(|a, b| a.1.total_cmp(&b.1)) else { return };
        let axis = &self.plan.axes[idx];
        let name = axis_name(axis.index);
        let (value, formula, visible) = if least > 0.0 {
            (added / least, "chi h^2 / 4 / D for a Gaussian", VISIBLE_DISPERSION)
        } else {
            let spread = (2.0 * added * self.plan.time.duration).sqrt() / (axis.high - axis.low);
            (spread, "sqrt(2 chi h^2 / 4 T) / extent for a Gaussian", VISIBLE_SPREADING)
        };
        limits.push(Limit {
            name: format!("dispersion along {name} by means over the parcels around"),
            formula,
            value,
            advice: "below 0.02 of that of the scene, or 0.01 of the extent without any; falls with the bandwidth",
        });
        if value <= visible {
            return;
        }
        let times = if least > 0.0 { (visible / value).sqrt() } else { visible / value };
        let of_what =
            if least > 0.0 { "of the dispersion coefficient" } else { "of the extent, as a spread" };
        let (code, message) = match least > 0.0 && value > 1.0 {
            true => (
                N203,
                format!("means over the parcels around disperse more along {name} than the scene does"),
            ),
            false => (N103, format!("means over the parcels around add dispersion along {name}")),
        };
        let message = match code == N203 {
            true => Diagnostic::refused(code, message),
            false => Diagnostic::warning(code, message),
        };
        diagnostics.push(
            message
                .at(self.place, format!("a bandwidth of {} m", short(self.extents.bandwidth)))
                .found(format!("{} {of_what}", short(value)))
                .expected(format!("at most {visible}"))
                .help(format!(
                    "use a bandwidth of `{} m` or less, with as many parcels in it, or `rate instant`, which adds none",
                    short(times * self.extents.bandwidth)
                )),
        );
    }
}
