//! Steps in which pairs of particles meet.
//!
//! Owns the way from flocks to crowds and back. May use the folder. It deliberately knows no chance: `pairs` does.

#![allow(clippy::needless_range_loop)] // An axis belongs to several arrays at once.

use super::super::super::density::End;
use super::super::super::error::RunError;
use super::super::book::Book;
use super::super::flock::Flock;
use super::super::world::Site;
use super::census::{Census, OUTSIDE};
use super::near::{Crowd, Member};
use super::pairs::{Exchanged, Meetings, REACH, Step, meet, place};
use super::{Reactions, Stock, Turn, Variances, merge};
use crate::maths::scalar::sqrt;

/// Of an extent, that a kernel has at least: what does not move meets what is at its place.
const NARROWEST: f64 = 1e-9;

impl<const D: usize> Reactions<D> {
    /// Meetings of a step.
    pub(super) fn meet(
        &mut self,
        site: &Site<D>,
        (meetings, variances): (&Meetings, Variances<D>),
        (flocks, units, book): Stock<D>,
        (when, t, dt): (Turn, f64, f64),
    ) -> Result<(), RunError> {
        let census = self.count(flocks);
        let needs_fields = meetings.need_concentrations();
        let mut spread = Vec::new();
        if !self.is_collocation || needs_fields {
            spread = self.spread(flocks, units, &census, when.step)?;
        }
        let mut crowds = self.crowds(site, flocks, &census, |population, at| variances(population, at, dt));
        let n = crowds.len();
        let mut exchanged = Exchanged { made: vec![0.0; n], taken: vec![0.0; n] };
        let own = &*self;
        let per_mass = |at: [f64; D], species: usize| own.per_mass(site, at, species);
        let concentrations = |at: [f64; D]| own.concentrations(site, &spread, at);
        let mut products = Vec::new();
        for (idx, meeting) in meetings.list.iter().enumerate() {
            let step = Step {
                plan: site.plan,
                stream: &own.stream,
                turn: when.turn,
                t,
                dt,
                per_mass: &per_mass,
                concentrations: needs_fields.then_some(&concentrations),
            };
            products.extend(meet(&step, (idx as u64, meeting), &mut crowds, &mut exchanged));
        }
        for crowd in &crowds {
            for member in &crowd.members {
                flocks[member.place.0].masses[member.place.1] = member.mass;
            }
        }
        flocks.iter_mut().for_each(merge::compact);
        for (population, (made, taken)) in exchanged.made.iter().zip(&exchanged.taken).enumerate() {
            book.react(population, *made, *taken);
        }
        place(products, &mut self.makers, flocks);
        self.join(flocks, when.turn, book);
        Ok(())
    }

    /// Joins what meetings have left of particles.
    fn join(&mut self, flocks: &mut [Flock<D>], turn: u64, book: &mut Book) {
        let census = self.count(flocks);
        for (population, (census, maker)) in census.iter().zip(&self.makers).enumerate() {
            let mut own: Vec<&mut Flock<D>> =
                flocks.iter_mut().filter(|flock| flock.population == population).collect();
            if census.places.is_empty() {
                continue;
            }
            let unit = super::light_unit(maker.unit, &own);
            let gone = merge::merge(&mut own, &census.places, unit, (&self.stream, turn));
            book.react(population, 0.0, gone);
        }
    }

    fn crowds(
        &self,
        site: &Site<D>,
        flocks: &[Flock<D>],
        census: &[Census],
        displaced: impl Fn(usize, [f64; D]) -> [f64; D],
    ) -> Vec<Crowd<D>> {
        let mut lists: Vec<Vec<Member<D>>> = Vec::new();
        for (population, (own, census)) in self.populations.iter().zip(census).enumerate() {
            let mut members = Vec::new();
            let numbers = flocks.iter().enumerate().filter(|(_, flock)| flock.population == population);
            for ((number, flock), places) in numbers.zip(&census.places) {
                for idx in (0..flock.len()).filter(|&idx| places[idx] != OUTSIDE) {
                    let at = flock.position(idx);
                    let mut variances = match (&own.kernels, self.is_collocation) {
                        (Some(kept), false) => {
                            let first = kept.projection.lattice().axes().start;
                            let h = kept.projection.bandwidths(places[idx] as usize);
                            std::array::from_fn(|axis| h[first + axis] * h[first + axis])
                        }
                        _ => displaced(population, at),
                    };
                    for axis in 0..D {
                        let least = NARROWEST * (site.high[axis] - site.low[axis]);
                        variances[axis] = variances[axis].max(least * least);
                    }
                    let (id, mass) = (flock.ids[idx], flock.masses[idx]);
                    members.push(Member { id, at, variances, mass, place: (number, idx) });
                }
            }
            lists.push(members);
        }
        let most =
            |axis: usize| lists.iter().flatten().map(|member| member.variances[axis]).fold(0.0, f64::max);
        let reach: [f64; D] = std::array::from_fn(|axis| REACH * sqrt(2.0 * most(axis)));
        let crowd = |(own, members): (&super::Own, Vec<Member<D>>)| {
            let first = own.finder.lattice.axes().start;
            let ends: [[End; 2]; D] = std::array::from_fn(|axis| own.finder.lattice.ends[first + axis]);
            Crowd::new(own.species, members, (site.low, site.high, ends), reach)
        };
        self.populations.iter().zip(lists).map(crowd).collect()
    }

    fn cell_of(&self, site: &Site<D>, at: [f64; D]) -> usize {
        let lattice = &self.populations[0].finder.lattice;
        let first = lattice.axes().start;
        (0..D).fold(0, |cell, axis| {
            let n = lattice.cells[first + axis];
            let along = ((at[axis] - site.low[axis]) / lattice.edge[first + axis]).max(0.0) as usize;
            cell * n + along.min(n - 1)
        })
    }

    /// 1/(φ R) of a species; 1/φ of none.
    fn per_mass(&self, site: &Site<D>, at: [f64; D], species: usize) -> f64 {
        let volume = self.populations[0].finder.lattice.volume();
        let porosity = self.water[self.cell_of(site, at)] / volume;
        let own = self.populations.iter().find(|own| own.species == species);
        1.0 / (porosity * own.map_or(1.0, |own| own.retardation))
    }

    /// By species, in the cell of a place.
    fn concentrations(&self, site: &Site<D>, spread: &[Vec<f64>], at: [f64; D]) -> Vec<f64> {
        let cell = self.cell_of(site, at);
        let mut all = vec![0.0; self.populations.len()];
        for (own, spread) in self.populations.iter().zip(spread).filter(|(_, spread)| !spread.is_empty()) {
            all[own.species] = (spread[cell] / (self.water[cell] * own.retardation)).max(0.0);
        }
        all
    }
}
