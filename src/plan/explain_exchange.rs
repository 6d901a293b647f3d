//! The exchange of a plan in words.
//!
//! Owns these lines. May use the sizes that follow from the plan. It deliberately judges nothing: limits do.

use super::exchange::{Exchange, Integration, Kernel, Sizes, lattice_error, plume_error};
use super::limits::short;
use super::transport::Dispersion;
use super::{Placement, Plan};
use crate::catalog::kernel;
use crate::diagnostic::number;
use crate::maths::scalar::pow;

/// The error that a plume is asked about.
const ASKED: f64 = 0.01;
/// A leading error below this part of the step's own is rounding.
const ROUNDING: f64 = 1e-9;

/// Kernel, lengths and neighbours of the means that zones exchange with; nothing where these are of bins.
pub(super) fn mean_lines(plan: &Plan) -> Vec<String> {
    let Some(mixing) = &plan.mixing else { return Vec::new() };
    let Some(averaging) = &mixing.averaging else { return Vec::new() };
    let exchange = averaging.as_exchange(plan.axes.len());
    let extents = averaging.extents(plan);
    vec![
        kernel_line(&exchange, &exchange.sizes(plan, plan.time.step)),
        format!(
            "bandwidth h = {} m: {} of the distance of parcels of {} m",
            short(extents.bandwidth),
            short(extents.bandwidth / extents.spacing),
            short(extents.spacing)
        ),
        format!(
            "about {} neighbours within {} m ({} bandwidths), as noisy as {} parcels in a bin",
            short(extents.neighbours),
            short(extents.radius * extents.bandwidth),
            short(extents.radius),
            short(extents.effective)
        ),
        format!("normalise {}, integrate exponential", averaging.normalisation.word()),
    ]
}

/// Kernel, lengths, share, dispersion and errors; nothing without an exchange.
pub(super) fn lines(plan: &Plan) -> Vec<String> {
    let Some(exchange) = &plan.exchange else { return Vec::new() };
    let step = plan.time.step.min(plan.time.duration);
    let sizes = exchange.sizes(plan, step);
    let mut lines = vec![
        kernel_line(exchange, &sizes),
        format!(
            "bandwidth h = {} m: {} of the collocation length of {} m, {} of the distance of parcels of {} m",
            short(sizes.bandwidth),
            short(sizes.bandwidth / sizes.collocation),
            short(sizes.collocation),
            short(sizes.bandwidth / sizes.spacing),
            short(sizes.spacing)
        ),
        format!(
            "about {} neighbours within {} m ({} bandwidths)",
            short(sizes.neighbours),
            short(sizes.radius * sizes.bandwidth),
            short(sizes.radius)
        ),
        format!(
            "share exchanged in a step: {}; normalise {}, integrate {}",
            short(sizes.share),
            exchange.normalisation.word(),
            exchange.integration.word()
        ),
        dispersion_line(plan, exchange),
    ];
    lines.extend(place_line(exchange, &sizes));
    lines.extend(cutoff_line(exchange, &sizes));
    lines.push(error_line(plan, exchange.integration, &sizes));
    let is_gaussian = matches!(&exchange.kernel, Kernel::Catalogue(name) if name == "gaussian");
    let is_ordered = plan.particles.placement == Placement::Ordered && plan.particles.disorder == 0.0;
    if is_ordered && is_gaussian && exchange.spreading.is_none() {
        lines.push(format!(
            "sums over ordered parcels, while they rest: right to {} of a mode",
            short(lattice_error(&sizes))
        ));
    }
    lines
}

fn kernel_line(exchange: &Exchange, sizes: &Sizes) -> String {
    let (name, equation, support) = match &exchange.kernel {
        Kernel::Catalogue(name) => {
            let item = kernel::find(name);
            let equation = item.map_or("", |item| item.equation);
            (name, equation, item.map_or(f64::INFINITY, |item| item.support))
        }
        Kernel::Profile { name, support, .. } => (name, "of the scene", *support),
    };
    let end = if sizes.radius < support { "cut off" } else { "ends" };
    format!("kernel {name}: {equation}; {end} at q = {}", short(sizes.radius))
}

fn dispersion_line(plan: &Plan, exchange: &Exchange) -> String {
    let exchanged: Vec<String> = exchange.diffusion.iter().map(|entry| number(*entry)).collect();
    let rest = if walks(plan) { "the rest walks" } else { "nothing walks" };
    let what = match &exchange.spreading {
        None => format!("lower triangle ({}) m^2/s", exchanged.join(", ")),
        Some(Dispersion::Velocity { longitudinal, transverse, transverse_vertical, molecular }) => format!(
            "longitudinal {} m, transverse {} m, vertical {} m, molecular {} m^2/s",
            number(*longitudinal),
            number(*transverse),
            number(*transverse_vertical),
            number(*molecular)
        ),
        Some(_) => "an expression of the place".to_owned(),
    };
    format!("dispersion by exchange: {what}; {rest}")
}

/// What the sizes are of where dispersion varies.
fn place_line(exchange: &Exchange, sizes: &Sizes) -> Option<String> {
    exchange.spreading.as_ref()?;
    Some(format!(
        "each parcel has its own kernel, in the metric of the dispersion where it is; the numbers above and below are those of a \
         typical place, D = {} m^2/s",
        short(sizes.diffusion)
    ))
}

/// Whether any of the dispersion walks.
pub(super) fn walks(plan: &Plan) -> bool {
    match plan.transport.as_ref().map(|transport| &transport.dispersion) {
        None => plan.walk.spread.iter().any(|entry| *entry != 0.0),
        Some(Dispersion::Constant(triangle)) => triangle.iter().any(|entry| *entry != 0.0),
        Some(Dispersion::Isotropic(_)) => true,
        Some(Dispersion::Velocity { longitudinal, transverse, transverse_vertical, molecular }) => {
            [longitudinal, transverse, transverse_vertical, molecular].into_iter().any(|part| *part != 0.0)
        }
    }
}

/// What the end of the kernel takes.
fn cutoff_line(exchange: &Exchange, sizes: &Sizes) -> Option<String> {
    let lost = 1.0 - sizes.fidelity;
    // A profile that ends at zero loses nothing.
    (lost > 1e-12).then(|| {
        let is_back = if exchange.is_compensated { "which is given back" } else { "which is not given back" };
        format!("its end takes {} of the dispersion, {is_back}", short(lost))
    })
}

/// The standard deviation from which a plume is right to a hundredth, by the leading error of the step.
fn error_line(plan: &Plan, integration: Integration, sizes: &Sizes) -> String {
    if plan.exchange.as_ref().is_some_and(|exchange| exchange.spreading.is_some()) {
        return "leading error of step and kernel: of second order in h where dispersion varies, of first order across jumps".to_owned();
    }
    let (d, time) = (plan.axes.len(), &plan.time);
    let dt = time.step.min(time.duration);
    let at_one = plume_error(sizes, integration, (d, time.duration, dt), 1.0);
    let step = 2.0 * sizes.diffusion * dt;
    let is_none = integration == Integration::Explicit
        && (sizes.effective * sizes.effective - step).abs() <= ROUNDING * step;
    if is_none {
        return "no leading error of the step: h is the collocation length".to_owned();
    }
    format!(
        "leading error of step and kernel: below 1 % for a plume whose standard deviation at the end is {} m or more",
        short(pow(at_one / ASKED, 0.25))
    )
}
