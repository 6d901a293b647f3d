//! Pairs of particles that meet by chance.
//!
//! Owns the chances of pairs, who meets whom, and what becomes of them. May use kernels, streams and the plan. It deliberately goes
//! through particles in an order drawn anew in each step: who comes first finds more partners.

use super::super::super::parallel;
use super::super::flock::{self, Flock};
use super::make::Maker;
use super::near::{Crowd, Member};
use crate::maths::scalar::{cos, exp, ln};
use crate::plan::Plan;
use crate::plan::chemistry::{Kinetic, Law};
use crate::plan::tape::Tape;
use crate::state::stream::Stream;

/// Standard deviations of the sum of two kernels within which two particles may meet.
pub const REACH: f64 = 5.5;

/// A reaction of pairs, or of single particles.
#[derive(Debug, Clone)]
pub struct Meeting {
    /// In the plan's kinetics.
    reaction: usize,
    /// Species and how much of each a unit of extent takes; the second one only if there is one.
    pub first: (usize, f64),
    pub second: Option<(usize, f64)>,
    products: Vec<(usize, f64)>,
    law: Factor,
}

/// The rate over the concentrations of what meets.
#[derive(Debug, Clone)]
enum Factor {
    Constant(f64),
    /// Of this rate.
    Varying(Tape),
}

/// Everything that particles do by meeting.
#[derive(Debug, Clone)]
pub struct Meetings {
    pub list: Vec<Meeting>,
}

/// What chances hang on beside places: concentrations at a place, by species.
pub type Concentrations<'a, const D: usize> = &'a (dyn Fn([f64; D]) -> Vec<f64> + Sync);

/// A step, for pairs.
pub struct Step<'a, const D: usize> {
    pub plan: &'a Plan,
    pub stream: &'a Stream,
    pub turn: u64,
    pub t: f64,
    pub dt: f64,
    /// Concentration of a species per mass density: 1/(φ R), at a place.
    pub per_mass: &'a (dyn Fn([f64; D], usize) -> f64 + Sync),
    pub concentrations: Option<Concentrations<'a, D>>,
}

impl Meetings {
    /// Those of a plan whose reactions are of one or two species.
    pub fn new(plan: &Plan) -> Option<Self> {
        let kinetics = plan.chemistry.as_ref()?.kinetics.as_ref()?;
        let of = |component: usize| plan.species_of(component);
        let mut list = Vec::new();
        for (reaction, own) in kinetics.reactions.iter().enumerate() {
            let all: Option<Vec<(usize, f64)>> =
                own.changes.iter().map(|&(component, change)| Some((of(component)?, change))).collect();
            let all = all?;
            let mut taken = all.iter().filter(|(_, change)| *change < 0.0).map(|&(s, nu)| (s, -nu));
            let products = all.iter().copied().filter(|(_, change)| *change > 0.0).collect();
            let first = taken.next()?;
            let mut second = taken.next();
            if taken.next().is_some() {
                return None;
            }
            // Two of one species meet where the rate is of its square.
            if second.is_none() && order_of(&own.law, first.0) == Some(2.0) {
                second = Some(first);
            }
            let law = match constant(first, second, own) {
                Some(constant) => Factor::Constant(constant),
                None => Factor::Varying(kinetics.laws.tape(reaction)),
            };
            list.push(Meeting { reaction, first, second, products, law });
        }
        Some(Self { list })
    }

    /// Whether chances hang on concentrations.
    pub fn need_concentrations(&self) -> bool {
        self.list.iter().any(|meeting| matches!(meeting.law, Factor::Varying(_)))
    }
}

fn order_of(law: &Law, species: usize) -> Option<f64> {
    match law {
        Law::MassAction { orders, .. } => {
            Some(orders.iter().find(|(own, _)| *own == species).map_or(0.0, |(_, n)| *n))
        }
        Law::Saturation { .. } | Law::Expression => None,
    }
}

/// The rate over the concentrations of what meets, where that is a constant.
fn constant(first: (usize, f64), second: Option<(usize, f64)>, reaction: &Kinetic) -> Option<f64> {
    let Law::MassAction { constant, orders } = &reaction.law else { return None };
    let mut wanted: Vec<(usize, f64)> = vec![(first.0, 1.0)];
    match second {
        Some((species, _)) if species == first.0 => wanted[0].1 = 2.0,
        Some((species, _)) => wanted.push((species, 1.0)),
        None => {}
    }
    let is_same = orders.len() == wanted.len() && wanted.iter().all(|own| orders.contains(own));
    is_same.then_some(*constant)
}

/// `r/(c_A c_B)`, or `r/c_A`, with concentrations of at least a floor.
///
/// - Equation: `f = r(c)/Π c`.
/// - Symbols: `r` rate, `c` concentrations at the place.
/// - Range: any law; below the floors `f` is that at the floors.
/// - Source: methods, section 5.2.
/// - Shape: one number.
fn factor<const D: usize>(step: &Step<D>, meeting: &Meeting, at: [f64; D]) -> f64 {
    let tape = match &meeting.law {
        Factor::Constant(constant) => return *constant,
        Factor::Varying(tape) => tape,
    };
    let Some(concentrations) = step.concentrations else { return 0.0 };
    let mut inputs = vec![0.0; 4];
    step.plan.axes.iter().zip(at).for_each(|(axis, x)| inputs[axis.index] = x);
    inputs[3] = step.t + 0.5 * step.dt;
    let mut species = concentrations(at);
    let floor = |idx: usize| {
        let component = step.plan.species[idx].terms.first().map_or(0, |(component, _)| *component);
        step.plan.chemistry.as_ref().map_or(0.0, |it| it.floors[component])
    };
    let mut below = 1.0;
    for (idx, _) in [Some(meeting.first), meeting.second].into_iter().flatten() {
        species[idx] = species[idx].max(floor(idx));
        below *= species[idx];
    }
    inputs.extend(species);
    tape.evaluate(&inputs) / below
}

/// Density of two kernels meeting, of which walls show images.
///
/// - Equation: `v = Π_i Σ_s N(s_i; 0, H_p + H_q)`, over the way `s` to the other and to its images behind walls.
/// - Symbols: `H` variances along axes, m².
/// - Range: walls farther apart than kernels reach.
/// - Source: methods, (5.3); the overlap of two kernels that are reflected.
/// - Shape: one pair, 1/m^d.
pub fn density<const D: usize>(ways: [[Option<f64>; 3]; D], variances: [f64; D]) -> f64 {
    let mut product = 1.0;
    for axis in 0..D {
        let bell = |way: &f64| exp(-0.5 * way * way / variances[axis]);
        let sum: f64 = ways[axis].iter().flatten().map(bell).sum();
        product *= sum / (2.0 * std::f64::consts::PI * variances[axis]).sqrt();
    }
    product
}

/// Population, place and mass of a particle that is made.
pub type Product<const D: usize> = (usize, [f64; D], f64);

/// What one reaction makes and takes, by population.
pub struct Exchanged {
    pub made: Vec<f64>,
    pub taken: Vec<f64>,
}

/// One meeting in a step: `crowds` by population; masses in them change.
pub fn meet<const D: usize>(
    step: &Step<D>,
    (idx, meeting): (u64, &Meeting),
    crowds: &mut [Crowd<D>],
    exchanged: &mut Exchanged,
) -> Vec<Product<D>> {
    let tools = Tools { step, meeting };
    let (outer, inner) = tools.roles(crowds);
    // Who may react at all, with everybody there: few are looked at again.
    let crowd = &crowds[outer];
    let candidates = parallel::map(crowd.members.len().div_ceil(PORTION), &|portion| {
        let range = portion * PORTION..((portion + 1) * PORTION).min(crowd.members.len());
        let is_chosen = |p: &usize| {
            let uniforms = tools.uniforms(crowd.members[*p].id, idx);
            crowd.members[*p].mass > 0.0
                && uniforms[0] < chance(tools.hazards(crowds, (outer, *p), inner, None))
        };
        range.filter(is_chosen).collect::<Vec<usize>>()
    });
    let mut candidates: Vec<(u64, usize)> = candidates
        .into_iter()
        .flatten()
        .map(|p| (tools.uniforms(crowds[outer].members[p].id, idx)[1].to_bits(), p))
        .collect();
    candidates.sort_unstable();
    let mut products = Vec::new();
    for (_, p) in candidates {
        let uniforms = tools.uniforms(crowds[outer].members[p].id, idx);
        let mut partners = Vec::new();
        let hazards = tools.hazards(crowds, (outer, p), inner, Some(&mut partners));
        // Partners may have been taken by others.
        if crowds[outer].members[p].mass <= 0.0 || uniforms[0] >= chance(hazards) {
            continue;
        }
        let partner = inner.map(|inner| {
            let mut rest = uniforms[2] * hazards;
            let found = partners.iter().find(|(_, hazard)| {
                rest -= hazard;
                rest <= 0.0
            });
            (inner, found.or(partners.last()).map_or(0, |(q, _)| *q))
        });
        tools.react((outer, p), partner, crowds, (exchanged, &mut products));
    }
    products
}

const PORTION: usize = 256;

fn chance(hazard: f64) -> f64 {
    1.0 - exp(-hazard)
}

struct Tools<'a, const D: usize> {
    step: &'a Step<'a, D>,
    meeting: &'a Meeting,
}

impl<const D: usize> Tools<'_, D> {
    /// The population that is gone through, and the one that is searched: particles of the former give less, so that a meeting
    /// is the end of one, and of the heavier ones many lighter ones take their part.
    fn roles(&self, crowds: &[Crowd<D>]) -> (usize, Option<usize>) {
        let population =
            |species: usize| crowds.iter().position(|crowd| crowd.species == species).unwrap_or(0);
        let first = population(self.meeting.first.0);
        match self.meeting.second.map(|(species, _)| population(species)) {
            Some(second) if self.extent(&crowds[second]) < self.extent(&crowds[first]) => {
                (second, Some(first))
            }
            second => (first, second),
        }
    }

    /// Mean extent that a particle is enough for.
    fn extent(&self, crowd: &Crowd<D>) -> f64 {
        let mass: f64 = crowd.members.iter().map(|member| member.mass).sum();
        mass / (crowd.members.len().max(1) as f64 * self.share(crowd.species))
    }

    fn uniforms(&self, id: u64, idx: u64) -> [f64; 8] {
        self.step.stream.uniforms_of(id, (1 << 48) + (self.step.turn << 8) + idx)
    }

    /// How much of a unit of extent a population gives.
    fn share(&self, species: usize) -> f64 {
        match self.meeting.second {
            // Two of one kind share what a unit takes.
            Some((second, nu)) if second == self.meeting.first.0 => 0.5 * nu,
            Some((second, nu)) if second == species => nu,
            _ => self.meeting.first.1,
        }
    }

    /// Chance, as an exponent, that a particle reacts in the step, and that of each partner.
    fn hazards(
        &self,
        crowds: &[Crowd<D>],
        (outer, p): (usize, usize),
        inner: Option<usize>,
        mut partners: Option<&mut Vec<(usize, f64)>>,
    ) -> f64 {
        let own = &crowds[outer].members[p];
        let Some(inner) = inner else {
            let part = (self.step.per_mass)(own.at, crowds[outer].species);
            // In water alone.
            let retarded = part * (self.step.per_mass)(own.at, usize::MAX).recip();
            let share = self.share(crowds[outer].species);
            return share * factor(self.step, self.meeting, own.at) * retarded * self.step.dt;
        };
        let is_like = inner == outer;
        let mut sum = 0.0;
        crowds[inner].near(own, |q, other, distance| {
            if other.mass <= 0.0 || (is_like && q == p) {
                return;
            }
            let hazard = self.hazard(crowds, (own, outer), (other, inner), distance);
            sum += hazard;
            if let Some(partners) = &mut partners {
                partners.push((q, hazard));
            }
        });
        sum
    }

    /// A pair's chance in the step, as an exponent.
    ///
    /// - Equation: `Λ = Δt f m_p m_q v/(e φ R_A R_B)`, `e = min(m/ν)`; two of one kind look for each other, once from either side.
    /// - Symbols: `f = r/(c_A c_B)` at the middle of the two kernels, `e` the extent if they meet.
    /// - Range: constant f: exact for Gaussian kernels; else f is that of the middle.
    /// - Source: methods, (5.2); with equal masses `f m v Δt/φ`.
    /// - Shape: one pair.
    fn hazard(
        &self,
        crowds: &[Crowd<D>],
        (own, outer): (&Member<D>, usize),
        (other, inner): (&Member<D>, usize),
        distance: [f64; D],
    ) -> f64 {
        let variances = std::array::from_fn(|axis| own.variances[axis] + other.variances[axis]);
        let (species, others) = (crowds[outer].species, crowds[inner].species);
        let middle = middle(own, other, distance);
        let extent = (own.mass / self.share(species)).min(other.mass / self.share(others));
        let parts = (self.step.per_mass)(middle, species) * (self.step.per_mass)(middle, others);
        // Rates are per volume of water.
        let water = 1.0 / (self.step.per_mass)(middle, usize::MAX);
        let f = factor(self.step, self.meeting, middle);
        let overlap = density(crowds[inner].images(own, other, distance), variances);
        f * own.mass * other.mass * overlap * parts * water * self.step.dt / extent
    }

    /// Takes what meets, and places what it makes.
    fn react(
        &self,
        (outer, p): (usize, usize),
        partner: Option<(usize, usize)>,
        crowds: &mut [Crowd<D>],
        (exchanged, products): (&mut Exchanged, &mut Vec<Product<D>>),
    ) {
        let own = crowds[outer].members[p].clone();
        let own_share = self.share(crowds[outer].species);
        let mut extent = own.mass / own_share;
        let (mut at, mut deviations) = (own.at, [0.0; D]);
        if let Some((inner, q)) = partner {
            let other = crowds[inner].members[q].clone();
            let share = self.share(crowds[inner].species);
            extent = extent.min(other.mass / share);
            let distance = crowds[inner].distance(&own, &other);
            at = middle(&own, &other, distance);
            deviations = std::array::from_fn(|axis| {
                let (one, two) = (own.variances[axis], other.variances[axis]);
                (one * two / (one + two)).sqrt()
            });
            take(&mut crowds[inner].members[q], share * extent);
            exchanged.taken[inner] += share * extent;
        }
        take(&mut crowds[outer].members[p], own_share * extent);
        exchanged.taken[outer] += own_share * extent;
        for (k, &(species, nu)) in self.meeting.products.iter().enumerate() {
            let population = crowds.iter().position(|crowd| crowd.species == species).unwrap_or(0);
            let number =
                (1 << 56) + (self.step.turn << 12) + (self.meeting.reaction as u64 % 256) * 16 + k as u64;
            let draws = self.step.stream.uniforms_of(own.id, number);
            let place = std::array::from_fn(|axis| {
                at[axis] + deviations[axis] * normal(draws[2 * axis], draws[2 * axis + 1])
            });
            exchanged.made[population] += nu * extent;
            products.push((population, crowds[population].inside(place), nu * extent));
        }
    }
}

/// Box and Muller.
fn normal(radius: f64, angle: f64) -> f64 {
    (-2.0 * ln(radius)).sqrt() * cos(2.0 * std::f64::consts::PI * angle)
}

/// Nothing of rounding stays of what is used up.
fn take<const D: usize>(member: &mut Member<D>, mass: f64) {
    let left = member.mass - mass;
    member.mass = if left <= 1e-12 * member.mass { 0.0 } else { left };
}

/// `x̄ = (H_p⁻¹ + H_q⁻¹)⁻¹ (H_p⁻¹ X_p + H_q⁻¹ X_q)`, on the shorter way between the two.
fn middle<const D: usize>(own: &Member<D>, other: &Member<D>, distance: [f64; D]) -> [f64; D] {
    std::array::from_fn(|axis| {
        let (one, two) = (own.variances[axis], other.variances[axis]);
        own.at[axis] + distance[axis] * one / (one + two)
    })
}

/// Puts what was made into flocks.
pub fn place<const D: usize>(products: Vec<Product<D>>, makers: &mut [Maker], flocks: &mut Vec<Flock<D>>) {
    for (population, at, mass) in products {
        let maker = &mut makers[population];
        let id = flock::id(maker.origin, maker.n_made);
        maker.n_made += 1;
        flock::add_weighed(flocks, population, (id, at, Some(mass)));
    }
}
