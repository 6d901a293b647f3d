//! Seconds for densities of clouds, one thread: as many particles and cells with particles as in measured runs of another
//! program (0.72 s, 4.8 s; 47 s in space, with its reading of text).

#![allow(clippy::print_stdout)] // What a bench is for.

#[path = "../tests/support/draws.rs"]
mod draws;

use draws::Draws;
use lamella::engine::density::{
    Adaptive, End, Lattice, Orientation, Rule, Shape, Tally, Weighing, estimate, global, histogram,
};
use lamella::maths::scalar::sin;
use lamella::maths::wide::Width;
use std::time::Instant;

/// A third of the particles is spread more widely, and the cloud is bent.
fn cloud(n: usize, cells: &[usize], deviations: &[f64]) -> (Lattice, Tally) {
    let axes: Vec<(usize, f64, [End; 2])> =
        cells.iter().map(|&cells| (cells, 1.0, [End::Mirror; 2])).collect();
    let lattice = Lattice::new(&axes).unwrap();
    let mut draws = Draws(7);
    let mut positions = vec![Vec::with_capacity(n); cells.len()];
    for particle in 0..n {
        let wide = if particle % 3 == 0 { 1.6 } else { 1.0 };
        let mut bend = 0.0;
        for (axis, own) in positions.iter_mut().enumerate() {
            let x = 0.5 * cells[axis] as f64 + wide * deviations[axis] * draws.normal() + bend;
            bend = if cells.len() == 2 { 10.0 * sin(0.05 * x) } else { 0.0 };
            own.push(x.clamp(0.0, cells[axis] as f64));
        }
    }
    let positions: Vec<&[f64]> = positions.iter().map(|own| &own[..]).collect();
    let tally = Tally::of(&lattice, &vec![0.0; cells.len()], &positions, None);
    (lattice, tally)
}

fn main() {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    let clouds: [(usize, &[usize], &[f64], usize); 3] = [
        (70_000, &[400, 200], &[20.0, 8.6], 10),
        (1_000_000, &[400, 200], &[20.0, 9.4], 7),
        (28_000, &[500, 150, 100], &[8.0, 3.3, 2.5], 16),
    ];
    for (n, cells, deviations, loops) in clouds {
        let (lattice, tally) = cloud(n, cells, deviations);
        let seconds = |work: &(dyn Fn() -> usize + Sync)| {
            let mut least = (f64::INFINITY, 0);
            for _ in 0..3 {
                let start = Instant::now();
                let loops = pool.install(work);
                least = (least.0.min(start.elapsed().as_secs_f64()), loops);
            }
            least
        };
        let adaptive = |most_loops: usize, tolerance: f64, orientation: Orientation| {
            let adaptive = Adaptive { most_loops, tolerance, orientation, ..Adaptive::default() };
            seconds(&|| estimate(&lattice, &tally, &adaptive, Width::widest()).history.len() - 1)
        };
        let (fixed, _) = adaptive(loops, 0.0, Orientation::Axes);
        let (turned, _) = adaptive(loops, 0.0, Orientation::All([0.3, 1.0, 0.3]));
        let (settled, settled_loops) = adaptive(20, 0.02, Orientation::Axes);
        let rule = Rule::PlugIn(Shape::Stretched);
        let (plug_in, _) = seconds(&|| {
            global(&lattice, &tally, rule, Weighing::OfAll, Width::widest()).map_or(0, |found| found.n_loops)
        });
        let (bare, _) = seconds(&|| histogram(&lattice, &tally).0.len());
        println!(
            "{}-D {n:>8} particles in {:>6} cells: {loops} loops {fixed:.3} s, along a direction {turned:.3} s; settled after {settled_loops} in \
             {settled:.3} s; plug-in {plug_in:.3} s; histogram {bare:.4} s",
            cells.len(),
            tally.cells.len(),
        );
    }
}
