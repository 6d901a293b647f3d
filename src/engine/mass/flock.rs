//! Particles of one species in blocks that shrink and grow.
//!
//! Owns the arrays. May use `state`' size of a block. It deliberately gives no meaning to the place of a
//! particle: its identity is its number.

use crate::state::particles::BLOCK;

/// Bits of a particle's number that count within its origin.
pub const COUNT_BITS: u32 = 40;

/// Number of a particle: where it came from, and which one it is.
pub fn id(origin: usize, count: u64) -> u64 {
    (origin as u64) << COUNT_BITS | count
}

/// Where a particle came from.
pub fn origin(id: u64) -> usize {
    (id >> COUNT_BITS) as usize
}

/// Which one of its origin it is.
pub fn count(id: u64) -> u64 {
    id & ((1 << COUNT_BITS) - 1)
}

/// Up to [`BLOCK`] particles of one population.
#[derive(Debug, Clone, PartialEq)]
pub struct Flock<const D: usize> {
    pub population: usize,
    pub ids: Vec<u64>,
    /// m
    pub positions: [Vec<f64>; D],
    /// mol or kg, where reactions change them; empty where a particle's number says what it weighs.
    pub masses: Vec<f64>,
}

impl<const D: usize> Flock<D> {
    pub fn new(population: usize) -> Self {
        Self { population, ids: Vec::new(), positions: [const { Vec::new() }; D], masses: Vec::new() }
    }

    pub fn len(&self) -> usize {
        self.ids.len()
    }

    pub fn push(&mut self, id: u64, position: [f64; D]) {
        self.ids.push(id);
        for (axis, x) in self.positions.iter_mut().zip(position) {
            axis.push(x);
        }
    }

    /// The same with a mass of its own.
    pub fn push_weighed(&mut self, id: u64, position: [f64; D], mass: Option<f64>) {
        self.push(id, position);
        self.masses.extend(mass);
    }

    pub fn position(&self, idx: usize) -> [f64; D] {
        std::array::from_fn(|axis| self.positions[axis][idx])
    }

    pub fn set(&mut self, idx: usize, id: u64, position: [f64; D]) {
        self.ids[idx] = id;
        for (axis, x) in self.positions.iter_mut().zip(position) {
            axis[idx] = x;
        }
    }

    /// Puts what is at one place to another one before it.
    pub fn keep(&mut self, to: usize, from: usize) {
        self.ids[to] = self.ids[from];
        self.positions.iter_mut().for_each(|axis| axis[to] = axis[from]);
        if let Some(&mass) = self.masses.get(from) {
            self.masses[to] = mass;
        }
    }

    /// Mass of each particle, by what it is or by what its number says.
    pub fn weights<'a>(&'a self, units: &'a [f64]) -> impl Fn(usize) -> f64 + 'a {
        let is_own = !self.masses.is_empty();
        move |idx| if is_own { self.masses[idx] } else { units[origin(self.ids[idx])] }
    }

    pub fn truncate(&mut self, len: usize) {
        self.masses.truncate(len);
        self.ids.truncate(len);
        self.positions.iter_mut().for_each(|axis| axis.truncate(len));
    }
}

/// Adds a particle to the last flock of its population, or to a new one.
pub fn add<const D: usize>(flocks: &mut Vec<Flock<D>>, population: usize, id: u64, position: [f64; D]) {
    add_weighed(flocks, population, (id, position, None));
}

/// The same with a mass of its own.
pub fn add_weighed<const D: usize>(
    flocks: &mut Vec<Flock<D>>,
    population: usize,
    (id, position, mass): (u64, [f64; D], Option<f64>),
) {
    let last = flocks.iter_mut().rev().find(|flock| flock.population == population);
    match last {
        Some(flock) if flock.len() < BLOCK => flock.push_weighed(id, position, mass),
        _ => {
            let mut flock = Flock::new(population);
            flock.push_weighed(id, position, mass);
            flocks.push(flock);
        }
    }
}

/// Adds particles of any population to flocks that have room, and to new ones.
pub fn spread<const D: usize>(flocks: &mut Vec<Flock<D>>, mut list: Vec<(usize, u64, [f64; D])>) {
    list.sort_by_key(|(population, ..)| *population);
    let mut rest = &list[..];
    while let Some(&(population, ..)) = rest.first() {
        let n = rest.iter().take_while(|(other, ..)| *other == population).count();
        let (own, others) = rest.split_at(n);
        rest = others;
        let mut particles = own.iter();
        for flock in flocks.iter_mut().filter(|flock| flock.population == population) {
            let room = BLOCK - flock.len().min(BLOCK);
            particles.by_ref().take(room).for_each(|&(_, id, position)| flock.push(id, position));
        }
        for &(_, id, position) in particles {
            add(flocks, population, id, position);
        }
    }
}

/// Fills flocks up again when they are half empty on the whole.
pub fn gather<const D: usize>(flocks: &mut Vec<Flock<D>>) {
    flocks.retain(|flock| flock.len() > 0);
    let n_particles: usize = flocks.iter().map(Flock::len).sum();
    if flocks.len() < 16 || n_particles * 2 > flocks.len() * BLOCK {
        return;
    }
    let mut filled: Vec<Flock<D>> = Vec::new();
    flocks.sort_by_key(|flock| flock.population);
    for mut flock in flocks.drain(..) {
        let room = filled
            .last_mut()
            .filter(|last| last.population == flock.population && last.len() + flock.len() <= BLOCK);
        match room {
            Some(last) => {
                last.ids.append(&mut flock.ids);
                last.masses.append(&mut flock.masses);
                last.positions.iter_mut().zip(&mut flock.positions).for_each(|(to, from)| to.append(from));
            }
            None => filled.push(flock),
        }
    }
    *flocks = filled;
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_turns_finds_room_in_its_new_flocks() {
        let mut flocks: Vec<Flock<1>> = vec![Flock::new(0), Flock::new(1), Flock::new(0)];
        (0..BLOCK as u64 - 2).for_each(|k| flocks[0].push(id(0, k), [k as f64]));
        let moved = (0..5).map(|k| (if k == 3 { 2 } else { 0 }, id(1, k), [k as f64])).collect();
        spread(&mut flocks, moved);
        let lengths: Vec<(usize, usize)> =
            flocks.iter().map(|flock| (flock.population, flock.len())).collect();
        assert_eq!(lengths, [(0, BLOCK), (1, 0), (0, 2), (2, 1)]);
        assert_eq!((flocks[2].ids[1], flocks[3].ids[0]), (id(1, 4), id(1, 3)));
    }

    #[test]
    fn nothing_is_lost_when_flocks_are_gathered() {
        let mut flocks: Vec<Flock<1>> = Vec::new();
        for idx in 0..40 {
            let mut flock = Flock::new(idx % 3);
            (0..100 * idx).for_each(|k| flock.push(id(idx, k as u64), [k as f64]));
            flocks.push(flock);
        }
        let mut before: Vec<(usize, u64)> =
            flocks.iter().flat_map(|flock| flock.ids.iter().map(|&id| (flock.population, id))).collect();
        gather(&mut flocks);
        let mut after: Vec<(usize, u64)> =
            flocks.iter().flat_map(|flock| flock.ids.iter().map(|&id| (flock.population, id))).collect();
        before.sort_unstable();
        after.sort_unstable();
        assert_eq!(before, after);
        assert!(flocks.len() < 16 && flocks.iter().all(|flock| flock.len() <= BLOCK));
        assert_eq!((origin(id(7, 9)), count(id(7, 9))), (7, 9));
    }
}
