//! Random walks on cells beside those in a uniform medium: ns per particle and step, one core.

#![allow(clippy::print_stdout)] // What a bench is for.

use lamella::engine::track::cells::{CellMedium, Dispersivity};
use lamella::engine::track::medium::{Carrier, Medium};
use lamella::engine::track::monitors::Crossing;
use lamella::engine::track::noise::Draws;
use lamella::engine::track::tracker::{Bench, Events, Steps, Tracker};
use lamella::engine::track::uniform::Uniform;
use lamella::engine::track::walls::{Ends, Exit, Law, Patch, Wall};
use lamella::flow::{Cells, FaceFlow};
use lamella::maths::wide::Width;
use rustix::time::{ClockId, clock_gettime};

/// Processor time of this process, s.
fn cpu() -> f64 {
    let now = clock_gettime(ClockId::ProcessCPUTime);
    now.tv_sec as f64 + 1e-9 * now.tv_nsec as f64
}

struct Nobody;

impl Events for Nobody {
    fn left(&mut self, _: u64, _: Exit, _: f64) {}
    fn crossed(&mut self, _: u64, _: usize, _: Crossing, _: f64) {}
}

struct Go<'a, const D: usize, M: Medium<D>> {
    tracker: &'a Tracker<D, M>,
    steps: Steps,
    bench: &'a mut Bench<D, M>,
}

impl<const D: usize, M: Medium<D>> pulp::NullaryFnOnce for Go<'_, D, M> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let _ = self.tracker.advance(&Carrier::WATER, self.steps, None, self.bench, &mut Nobody);
    }
}

fn walls<const D: usize>(high: [f64; D]) -> [Ends<D>; D] {
    std::array::from_fn(|axis| {
        let wall = |at: f64| {
            let patches = vec![Patch { low: [0.0; D], high, law: Law::Reflect }];
            Some(Wall { at, patches })
        };
        Ends::Walls([wall(0.0), wall(high[axis])])
    })
}

/// Takes a million particles through steps, eight at a time, and tells the time.
fn time<const D: usize, M: Medium<D>>(name: &str, medium: M, high: [f64; D], dt: f64) {
    let wanted = std::env::args().nth(1).filter(|wanted| !wanted.starts_with("--"));
    if wanted.is_some_and(|wanted| !name.contains(&wanted)) {
        return;
    }
    let n = 1_000_000;
    let mut state = 1_u64;
    let mut next = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / 9_007_199_254_740_992.0
    };
    let ids: Vec<u64> = (0..n).collect();
    let mut positions: [Vec<f64>; D] =
        std::array::from_fn(|axis| ids.iter().map(|_| next() * high[axis]).collect());
    if name.contains("sorted") {
        let mut order: Vec<usize> = (0..ids.len()).collect();
        let cell = |x: f64| (x * 2.0) as usize;
        order.sort_by_key(|&idx| positions.each_ref().map(|axis| cell(axis[idx])));
        positions = positions.map(|axis| order.iter().map(|&idx| axis[idx]).collect());
    }
    let width = Width::widest();
    let draws = Draws::new(42, D, false);
    let tracker = Tracker {
        medium,
        ends: walls(high),
        planes: Vec::new(),
        gaps: Vec::new(),
        drains: Vec::new(),
        interfaces: Vec::new(),
        draws,
        criteria: None,
        width,
    };
    let mut bench = tracker.bench();
    let (tile, n_tiles) = (16 / D as u64, 4);
    let mut best = f64::INFINITY;
    for tile_idx in 0..n_tiles {
        let start = cpu();
        let steps = Steps { first: tile_idx * tile, end: (tile_idx + 1) * tile, t: 0.0, dt };
        for first in (0..ids.len()).step_by(64) {
            let range = first..(first + 64).min(ids.len());
            bench.lanes.load(&ids[range.clone()], positions.each_ref().map(|axis| &axis[range.clone()]));
            width.run(Go { tracker: &tracker, steps, bench: &mut bench });
            for (to, from) in positions.iter_mut().zip(&bench.lanes.positions) {
                to[range.clone()].copy_from_slice(&from[..range.len()]);
            }
        }
        best = best.min((cpu() - start) / (ids.len() as f64 * tile as f64));
    }
    println!("{name:40} {:6.2} ns per particle and step", best * 1e9);
}

/// A flow without sources from a stream function of waves.
fn flow(n: [usize; 3]) -> FaceFlow {
    let high = [n[0] as f64 * 0.5, n[1] as f64 * 0.5, n[2] as f64 * 0.5];
    let cells = Cells::equal([0.0; 3], high, n).expect("cells");
    let flux = [0, 1, 2].map(|axis| {
        (0..cells.n_faces(axis))
            .map(|idx| if axis == 0 { 1e-5 } else { 1e-7 * ((idx % 17) as f64 - 8.0) })
            .collect()
    });
    let porosity = vec![0.3; cells.n_cells()];
    FaceFlow { cells, flux, porosity, head: None, conductivity: None, sinks: Vec::new() }
}

fn main() {
    let uniform = Uniform { velocity: [1e-5], dispersion: [[1e-6]], molecular: 0.0, width: [1.0] };
    time("uniform, 1-D", uniform, [100.0], 100.0);
    let uniform = Uniform {
        velocity: [1e-5, 0.0],
        dispersion: [[1e-6, 0.0], [0.0, 1e-7]],
        molecular: 0.0,
        width: [1.0; 2],
    };
    time("uniform, 2-D", uniform, [200.0, 80.0], 100.0);
    let dispersivity = Dispersivity { longitudinal: 0.5, transverse: 0.05, molecular: 1e-9 };
    let medium = CellMedium::<2>::new(&flow([400, 160, 1]), [0, 1], dispersivity).expect("medium");
    time("400 x 160 cells, 2-D", medium.clone(), [200.0, 80.0], 1000.0);
    time("400 x 160 cells, 2-D, sorted", medium, [200.0, 80.0], 1000.0);
    let medium = CellMedium::<3>::new(&flow([100, 50, 50]), [0, 1, 2], dispersivity).expect("medium");
    time("100 x 50 x 50 cells, 3-D", medium.clone(), [50.0, 25.0, 25.0], 1000.0);
    time("100 x 50 x 50 cells, 3-D, sorted", medium, [50.0, 25.0, 25.0], 1000.0);
}
