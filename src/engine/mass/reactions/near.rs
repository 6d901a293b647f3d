//! Particles of one population by place, and who is near.
//!
//! Owns the cells of the search. May use the lattice's ends. It deliberately decides nothing: it lists.

#![allow(clippy::needless_range_loop)] // An axis belongs to several arrays at once.

use super::super::super::density::End;

/// A particle on its way through a step's meetings.
#[derive(Debug, Clone)]
pub struct Member<const D: usize> {
    pub id: u64,
    pub at: [f64; D],
    /// Of its kernel, along axes, m².
    pub variances: [f64; D],
    pub mass: f64,
    /// Where it lies: flock, and place in it.
    pub place: (usize, usize),
}

/// All particles of a population.
pub struct Crowd<const D: usize> {
    pub species: usize,
    pub members: Vec<Member<D>>,
    low: [f64; D],
    high: [f64; D],
    ends: [[End; 2]; D],
    bins: [usize; D],
    /// Members by bin, and where each bin begins.
    order: Vec<u32>,
    firsts: Vec<u32>,
    /// How far away a partner may be, along each axis.
    reach: [f64; D],
}

/// Bins along an axis at most.
const MOST_BINS: f64 = 4096.0;

impl<const D: usize> Crowd<D> {
    pub fn new(
        species: usize,
        members: Vec<Member<D>>,
        (low, high, ends): ([f64; D], [f64; D], [[End; 2]; D]),
        reach: [f64; D],
    ) -> Self {
        let most = (members.len() as f64).max(1.0);
        let mut bins = [1; D];
        for axis in 0..D {
            let fitting = ((high[axis] - low[axis]) / reach[axis]).floor().clamp(1.0, MOST_BINS);
            bins[axis] = fitting.min(most) as usize;
        }
        // As many as there are particles serve: more would only be empty.
        while bins.iter().product::<usize>() as f64 > 2.0 * most {
            if let Some(largest) = bins.iter_mut().max() {
                *largest = largest.div_ceil(2);
            }
        }
        let mut crowd =
            Self { species, members, low, high, ends, bins, order: Vec::new(), firsts: Vec::new(), reach };
        crowd.sort();
        crowd
    }

    fn bin_of(&self, at: [f64; D]) -> [usize; D] {
        std::array::from_fn(|axis| {
            let part = (at[axis] - self.low[axis]) / (self.high[axis] - self.low[axis]);
            ((part * self.bins[axis] as f64).max(0.0) as usize).min(self.bins[axis] - 1)
        })
    }

    fn number(&self, bin: [usize; D]) -> usize {
        (0..D).fold(0, |number, axis| number * self.bins[axis] + bin[axis])
    }

    fn sort(&mut self) {
        let n_bins: usize = self.bins.iter().product();
        let numbers: Vec<usize> = self.members.iter().map(|own| self.number(self.bin_of(own.at))).collect();
        let mut firsts = vec![0_u32; n_bins + 1];
        numbers.iter().for_each(|&number| firsts[number + 1] += 1);
        for number in 0..n_bins {
            firsts[number + 1] += firsts[number];
        }
        let mut next = firsts.clone();
        let mut order = vec![0_u32; self.members.len()];
        for (idx, &number) in numbers.iter().enumerate() {
            order[next[number] as usize] = idx as u32;
            next[number] += 1;
        }
        (self.order, self.firsts) = (order, firsts);
    }

    fn is_ring(&self, axis: usize) -> bool {
        self.ends[axis].contains(&End::Wrap)
    }

    /// From one particle to another, the shorter way round where there is one.
    pub fn distance(&self, from: &Member<D>, to: &Member<D>) -> [f64; D] {
        std::array::from_fn(|axis| {
            let length = self.high[axis] - self.low[axis];
            let way = to.at[axis] - from.at[axis];
            match self.is_ring(axis) {
                true if way > 0.5 * length => way - length,
                true if way < -0.5 * length => way + length,
                _ => way,
            }
        })
    }

    /// The ways to a particle and to its images behind walls.
    pub fn images(&self, from: &Member<D>, to: &Member<D>, way: [f64; D]) -> [[Option<f64>; 3]; D] {
        std::array::from_fn(|axis| {
            if self.is_ring(axis) {
                let length = self.high[axis] - self.low[axis];
                return [Some(way[axis]), Some(way[axis] - length), Some(way[axis] + length)];
            }
            let behind = |wall: f64| (wall - from.at[axis]) + (wall - to.at[axis]);
            let low = (self.ends[axis][0] == End::Mirror).then(|| behind(self.low[axis]));
            let high = (self.ends[axis][1] == End::Mirror).then(|| behind(self.high[axis]));
            let is_near = |way: &f64| way.abs() <= self.reach[axis];
            [Some(way[axis]), low.filter(is_near), high.filter(is_near)]
        })
    }

    /// A place brought inside, as sides do.
    pub fn inside(&self, mut at: [f64; D]) -> [f64; D] {
        for axis in 0..D {
            let (low, high) = (self.low[axis], self.high[axis]);
            let length = high - low;
            let along = at[axis] - low;
            if (0.0..=length).contains(&along) {
                continue;
            }
            at[axis] = match self.is_ring(axis) {
                true => low + along.rem_euclid(length),
                false => {
                    let turned = along.rem_euclid(2.0 * length);
                    low + if turned > length { 2.0 * length - turned } else { turned }
                }
            };
        }
        at
    }

    /// Calls `work` with everybody near: number, particle, and the way to it.
    pub fn near(&self, own: &Member<D>, mut work: impl FnMut(usize, &Member<D>, [f64; D])) {
        let centre = self.bin_of(own.at);
        let mut around = [[0_usize; 3]; D];
        let mut counts = [0_usize; D];
        for axis in 0..D {
            let n = self.bins[axis];
            for step in [-1_isize, 0, 1] {
                let bin = centre[axis] as isize + step;
                let bin = match self.is_ring(axis) {
                    true => bin.rem_euclid(n as isize),
                    false if bin < 0 || bin >= n as isize => continue,
                    false => bin,
                } as usize;
                // Of two bins or one each is a neighbour on both sides.
                if !around[axis][..counts[axis]].contains(&bin) {
                    around[axis][counts[axis]] = bin;
                    counts[axis] += 1;
                }
            }
        }
        let n: usize = counts.iter().product();
        for mut number in 0..n {
            let mut bin = [0; D];
            for axis in 0..D {
                bin[axis] = around[axis][number % counts[axis]];
                number /= counts[axis];
            }
            let number = self.number(bin);
            let range = self.firsts[number] as usize..self.firsts[number + 1] as usize;
            for &other in &self.order[range] {
                let member = &self.members[other as usize];
                let way = self.distance(own, member);
                if (0..D).all(|axis| way[axis].abs() <= self.reach[axis]) {
                    work(other as usize, member, way);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_that_are_near_are_found_once() {
        let at = |k: usize| [(k * 37 % 101) as f64 / 101.0, (k * 53 % 97) as f64 / 97.0];
        let member =
            |k: usize| Member { id: k as u64, at: at(k), variances: [1.0; 2], mass: 1.0, place: (0, k) };
        for (ends, reach) in [(End::Mirror, 0.1), (End::Wrap, 0.1), (End::Wrap, 0.4), (End::Mirror, 2.0)] {
            let crowd = Crowd::new(
                0,
                (0..300).map(member).collect(),
                ([0.0; 2], [1.0; 2], [[ends; 2]; 2]),
                [reach; 2],
            );
            for own in &crowd.members[..40] {
                let mut found = Vec::new();
                crowd.near(own, |idx, _, _| found.push(idx));
                found.sort_unstable();
                let is_near = |other: &Member<2>| {
                    let way = crowd.distance(own, other);
                    way.iter().all(|x| x.abs() <= reach)
                };
                let all: Vec<usize> = (0..300).filter(|&k| is_near(&crowd.members[k])).collect();
                assert_eq!(found, all, "{ends:?} {reach}");
            }
        }
    }
}
