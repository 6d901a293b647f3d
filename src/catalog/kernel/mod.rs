//! Radial kernels: each is one file and one line in [`ALL`].
//!
//! Owns profiles, their slopes and their sources. May use `maths`. It deliberately normalises nothing: an exchange divides by
//! sums over particles, and the constants of a kernel cancel.

mod epanechnikov;
mod gaussian;
mod spline;
#[cfg(test)]
mod tests;
mod wendland;

pub use epanechnikov::Epanechnikov;
pub use gaussian::Gaussian;
pub use spline::{CubicSpline, QuinticSpline};
pub use wendland::{WendlandC2, WendlandC4, WendlandC6};

/// Every kernel that a scene can name. A scene may define a kernel of such a name itself; then its own holds.
pub const ALL: &[Item] = &[
    gaussian::ITEM,
    spline::CUBIC,
    spline::QUINTIC,
    wendland::C2,
    wendland::C4,
    wendland::C6,
    epanechnikov::ITEM,
];

/// The item of that name.
pub fn find(name: &str) -> Option<&'static Item> {
    ALL.iter().find(|item| item.name == name)
}

/// A profile as inner loops take it. `q` is a distance over the bandwidth, within the support.
pub trait Radial: Copy {
    /// Whether `−W′/q` is `W`, to the last bit.
    const IS_ITS_OWN_FORCE: bool = false;
    /// Whether it is worked out faster in two parts.
    const HAS_PARTS: bool = false;
    /// `W(q)`.
    fn value(self, q2: f64) -> f64;
    /// `−W′(q)/q`: what two particles exchange by.
    fn force(self, q2: f64) -> f64;
    /// Two numbers: the first, times [`Self::of_rest`] of the second, is `W(q)` to the last bit.
    #[inline(always)]
    fn parts(self, q2: f64) -> (f64, f64) {
        (1.0, q2)
    }
    #[inline(always)]
    fn of_rest(self, rest: f64) -> f64 {
        self.value(rest)
    }
}

/// One kernel of the catalogue.
#[derive(Clone, Copy)]
pub struct Item {
    pub name: &'static str,
    /// Where it ends, in bandwidths; infinite if nowhere.
    pub support: f64,
    /// `W` and `−W′/q` over `q²`.
    pub value: fn(f64) -> f64,
    pub force: fn(f64) -> f64,
    /// As users write it.
    pub equation: &'static str,
    /// Author, year, place.
    pub source: &'static str,
}
