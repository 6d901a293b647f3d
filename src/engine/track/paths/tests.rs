//! Exact paths, held to closed forms.
//!
//! Tolerances: everything here is worked out in 64 bits, and a way of a few hundred cells adds up as many roundings;
//! 1e-12 of the size is a hundred times that.

use super::super::drains::Drain;
use super::super::medium::Carrier;
use super::super::monitors::{Crossing, Plane, Watch};
use super::super::noise::Draws;
use super::super::tracker::{Events, Steps, Tracker};
use super::super::uneven::{Lengths, UnevenMedium};
use super::super::walls::{Ends, Exit, Law, Patch, Wall};
use super::{Pathed, Paths};
use crate::flow::{Cells, FaceFlow};
use crate::maths::scalar::{atan, cos, exp, ln, sin};
use crate::maths::wide::Width;

type Medium = Pathed<2, UnevenMedium<2>>;

#[derive(Default)]
struct Log {
    left: Vec<(u64, usize, f64)>,
    crossed: Vec<(u64, usize, bool, f64)>,
}

impl Events for Log {
    fn left(&mut self, id: u64, exit: Exit, t: f64) {
        self.left.push((id, exit.side, t));
    }
    fn crossed(&mut self, id: u64, plane: usize, crossing: Crossing, t: f64) {
        self.crossed.push((id, plane, crossing.is_forward, t));
    }
}

/// A flow whose discharge through the faces normal to x and y is that of two functions of a face's ends.
fn flow(
    edges: [Vec<f64>; 2],
    porosity: impl Fn([f64; 2]) -> f64,
    of_x: impl Fn(f64, [f64; 2]) -> f64,
    of_y: impl Fn(f64, [f64; 2]) -> f64,
) -> FaceFlow {
    let [x, y] = edges;
    let pairs = |edges: &[f64]| edges.windows(2).map(|pair| [pair[0], pair[1]]).collect::<Vec<_>>();
    let (along_x, along_y) = (pairs(&x), pairs(&y));
    let normal_to_x = x.iter().flat_map(|&x| along_y.iter().map(|&y| of_x(x, y)).collect::<Vec<_>>());
    let normal_to_y = along_x.iter().flat_map(|&x| y.iter().map(|&y| of_y(y, x)).collect::<Vec<_>>());
    let flux = [normal_to_x.collect(), normal_to_y.collect(), vec![0.0; 2 * along_x.len() * along_y.len()]];
    let cells = Cells::new([x, y, vec![0.0, 1.0]]).unwrap();
    let centre = |cell: usize| cells.centre(cells.place(cell));
    let porosity = (0..cells.n_cells()).map(|cell| porosity([centre(cell)[0], centre(cell)[1]])).collect();
    FaceFlow { cells, flux, porosity, head: None, conductivity: None, sinks: vec![] }
}

fn tracker(flow: &FaceFlow, laws: [[Law; 2]; 2], drains: Vec<Drain<2>>) -> Tracker<2, Medium> {
    let lengths = Lengths { longitudinal: 0.0, transverse: 0.0, vertical: None, molecular: 0.0 };
    let medium = UnevenMedium::new(flow, [0, 1], lengths);
    let paths = Paths::new(flow, [0, 1], &drains);
    let ends = [0, 1].map(|axis| {
        let edges = &flow.cells.edges()[axis];
        let at = [edges[0], edges[edges.len() - 1]];
        let patch = |law| vec![Patch { low: [-1e9; 2], high: [1e9; 2], law }];
        Ends::Walls([0, 1].map(|end| Some(Wall { at: at[end], patches: patch(laws[axis][end]) })))
    });
    Tracker {
        medium: Pathed { medium, paths, molecular: 0.0 },
        ends,
        drains,
        interfaces: vec![],
        planes: vec![],
        gaps: vec![],
        draws: Draws::new(7, 2, false),
        criteria: None,
        width: Width::baseline(),
    }
}

/// Takes particles through steps; what is left of them, and what happened.
fn go(tracker: &Tracker<2, Medium>, places: &[[f64; 2]], n: u64, dt: f64) -> (Vec<Option<[f64; 2]>>, Log) {
    let (mut bench, mut log) = (tracker.bench(), Log::default());
    let mut ends = Vec::new();
    for (group, places) in places.chunks(64).enumerate() {
        let ids: Vec<u64> = (0..places.len()).map(|k| (64 * group + k) as u64).collect();
        let axis = |axis: usize| places.iter().map(|place| place[axis]).collect::<Vec<f64>>();
        bench.lanes.load(&ids, [&axis(0), &axis(1)]);
        let steps = Steps { first: 0, end: n, t: 0.0, dt };
        tracker.advance(&Carrier::WATER, steps, None, &mut bench, &mut log).unwrap();
        let lanes = &bench.lanes;
        ends.extend((0..places.len()).map(|lane| {
            (lanes.gone >> lane & 1 == 0).then(|| [lanes.positions[0][lane], lanes.positions[1][lane]])
        }));
    }
    (ends, log)
}

const OUTFLOW: [[Law; 2]; 2] = [[Law::Outflow; 2]; 2];

fn plane(axis: usize, at: f64) -> Plane<2> {
    Plane { axis, at, periods: [None; 2], watch: Watch::Times, part: None, draws: 0 }
}

/// `u = (x, −y)`: linear, so that cells hold it exactly. `x = x₀ eᵗ`, `y = y₀ e⁻ᵗ`.
#[test]
fn around_a_corner_paths_are_hyperbolas_whatever_the_step() {
    let edges = [vec![0.0, 0.1, 0.15, 0.5, 0.55, 1.0], vec![0.0, 0.3, 0.4, 1.0]];
    let flow = flow(edges, |_| 1.0, |x, _| x, |y, _| -y);
    let mut tracker = tracker(&flow, OUTFLOW, vec![]);
    tracker.planes = vec![plane(0, 0.7), plane(1, 0.35), plane(0, 0.5)];
    let start = [0.03, 0.9];
    for (n, dt) in [(1, 3.0), (3, 1.0), (3000, 1e-3)] {
        let (ends, log) = go(&tracker, &[start], n, dt);
        let [x, y] = ends[0].unwrap();
        assert!((x / (0.03 * exp(3.0)) - 1.0).abs() < 1e-12 && (y / (0.9 * exp(-3.0)) - 1.0).abs() < 1e-12);
        let times: Vec<(usize, bool)> = log.crossed.iter().map(|crossed| (crossed.1, crossed.2)).collect();
        assert_eq!(times, [(1, false), (2, true)]);
        let exact = [ln(0.9 / 0.35), ln(0.5 / 0.03)];
        log.crossed.iter().zip(exact).for_each(|(found, exact)| assert!((found.3 - exact).abs() < 1e-12));
    }
    let (ends, log) = go(&tracker, &[start], 1, 10.0);
    assert_eq!(ends[0], None);
    let (_, side, t) = log.left[0];
    assert!(side == 1 && (t - ln(1.0 / 0.03)).abs() < 1e-12);
    assert!((log.crossed[2].3 - ln(0.7 / 0.03)).abs() < 1e-12);
}

/// Layers of other discharge and porosity, one of them changed on the way: `t = Σ φ Δx/q`.
#[test]
fn through_layers_times_are_those_of_their_pores() {
    let porosity = |[x, y]: [f64; 2]| {
        if y < 1.0 {
            0.2
        } else if x < 3.0 {
            0.3
        } else {
            0.1
        }
    };
    let edges = [vec![0.0, 1.0, 3.0, 10.0], vec![0.0, 1.0, 2.0]];
    let flow = flow(edges, porosity, |_, y| if y[0] < 0.5 { 0.02 } else { 0.05 }, |_, _| 0.0);
    let tracker = tracker(&flow, OUTFLOW, vec![]);
    let (_, log) = go(&tracker, &[[0.0, 0.5], [0.5, 1.5]], 1, 1000.0);
    let found: Vec<f64> = log.left.iter().map(|left| left.2).collect();
    let exact = [0.2 * 10.0 / 0.02, 0.3 * 2.5 / 0.05 + 0.1 * 7.0 / 0.05];
    found.iter().zip(exact).for_each(|(found, exact)| assert!((found / exact - 1.0).abs() < 1e-13));
}

/// Discharge of a well through a part of a line: its share of the angle around it.
fn through(distance: f64, [from, to]: [f64; 2]) -> f64 {
    if distance == 0.0 {
        return 0.0;
    }
    let angle = atan(to / distance) - atan(from / distance);
    -angle / (2.0 * std::f64::consts::PI) / (to - from)
}

fn well(cell: f64) -> Vec<Drain<2>> {
    // Q = 1, φ = 0.25.
    vec![Drain { low: [-cell / 2.0; 2], high: [cell / 2.0; 2], rate: 1.0 / (0.25 * cell * cell), side: 4 }]
}

/// Times to a well are `π r² φ/Q`: those of the water that lies between. Faces have the exact discharge of the well;
/// within cells velocities are linear, which is off by the square of their size.
#[test]
fn water_comes_to_a_well_when_what_lies_before_it_is_gone() {
    let mut worst = [0.0_f64; 2];
    for (finer, worst) in [1, 2].iter().zip(&mut worst) {
        let n = 41 * finer - (finer - 1);
        let width = 41.0 / f64::from(n);
        let edges: Vec<f64> = (0..=n).map(|k| (f64::from(k) - 0.5 * f64::from(n)) * width).collect();
        let flow = flow([edges.clone(), edges], |_| 0.25, through, through);
        let tracker = tracker(&flow, OUTFLOW, well(width));
        let places: Vec<[f64; 2]> =
            (0..64).map(|k| 0.1 * f64::from(k) + 0.05).map(|a| [15.0 * cos(a), 15.0 * sin(a)]).collect();
        let (_, log) = go(&tracker, &places, 10, 100.0);
        assert!(log.left.len() == 64 && log.left.iter().all(|left| left.1 == 4));
        let exact = std::f64::consts::PI * 225.0 * 0.25;
        let mean = log.left.iter().map(|left| left.2).sum::<f64>() / 64.0;
        assert!((mean / exact - 1.0).abs() < 2e-3, "{mean} for {exact}");
        *worst = log.left.iter().map(|left| (left.2 / exact - 1.0).abs()).fold(0.0, f64::max);
    }
    assert!(worst[0] < 0.01 && worst[1] < 0.5 * worst[0], "{worst:?}");
}

/// In the cell of a well alone: water that is uniform stays so until it is taken out, evenly in time.
#[test]
fn a_cell_gives_its_water_evenly() {
    let edges = || vec![-0.5, 0.5];
    let flow = flow([edges(), edges()], |_| 0.25, |x, _| -0.5 * x, |y, _| -0.5 * y);
    let mut drains = well(1.0);
    let places: Vec<[f64; 2]> = (0..4096)
        .map(|k| [(f64::from(k % 64) + 0.5) / 64.0 - 0.5, (f64::from(k / 64) + 0.5) / 64.0 - 0.5])
        .collect();
    let total = flow.flux[0][0] - flow.flux[0][1] + flow.flux[1][0] - flow.flux[1][1];
    drains[0].rate = total / 0.25;
    let tracker = tracker(&flow, OUTFLOW, drains);
    let (_, log) = go(&tracker, &places, 7, 0.25 / total / 5.0);
    assert_eq!(log.left.len(), 4096);
    let mut times: Vec<f64> = log.left.iter().map(|left| left.2 * total / 0.25).collect();
    times.sort_by(f64::total_cmp);
    for (k, t) in times.iter().enumerate() {
        // A grid of 64 × 64 places has rings of up to 252 at one distance.
        assert!((t - (k as f64 + 0.5) / 4096.0).abs() < 0.033, "{k}: {t}");
    }
}

/// A well that takes a third of the water of a cell: `1 − e^{−λt}` of what passes.
#[test]
fn a_well_takes_its_share_of_what_passes() {
    let flow = flow([vec![0.0, 1.0], vec![0.0, 1.0]], |_| 0.5, |x, _| 1.5 - 0.5 * x, |_, _| 0.0);
    let drain = Drain { low: [0.0; 2], high: [1.0; 2], rate: 0.5 / 0.5, side: 4 };
    let places: Vec<[f64; 2]> = (0..20_000).map(|k| [0.0, (f64::from(k) + 0.5) / 20_000.0]).collect();
    for (n, dt) in [(1, 2.0), (20, 0.1)] {
        let (_, log) = go(&tracker(&flow, OUTFLOW, vec![drain.clone()]), &places, n, dt);
        let taken = log.left.iter().filter(|left| left.1 == 4).count() as f64 / 20_000.0;
        // Four standard deviations.
        assert!((taken - 1.0 / 3.0).abs() < 4.0 * (2.0 / 9.0 / 2e4_f64).sqrt(), "{taken}");
        // v = 3 − x: the others pass in ln(3/2).
        let passed = log.left.iter().filter(|left| left.1 == 1);
        passed.for_each(|left| assert!((left.2 - ln(1.5)).abs() < 1e-12));
    }
}

#[test]
fn without_a_way_out_they_stay() {
    let edges = || vec![0.0, 1.0];
    let closed = flow([edges(), edges()], |_| 1.0, |x, _| 1.0 - 2.0 * x, |_, _| 0.0);
    let (ends, log) = go(&tracker(&closed, OUTFLOW, vec![]), &[[0.1, 0.2], [0.5, 0.3]], 5, 100.0);
    assert!(log.left.is_empty());
    for end in ends {
        assert!((end.unwrap()[0] - 0.5).abs() < 1e-12);
    }
    // Into walls that let nothing through, in a corner.
    let reflect = [[Law::Reflect; 2]; 2];
    let wrong = flow([edges(), edges()], |_| 1.0, |_, _| 1.0, |_, _| 1.0);
    let (ends, _) = go(&tracker(&wrong, reflect, vec![]), &[[0.1, 0.2]], 5, 1.0);
    assert_eq!(ends, [Some([1.0, 1.0])]);
}

/// Around a period planes are crossed again and again, one at the seam, too.
#[test]
fn around_a_period_they_come_again() {
    let flow = flow([vec![0.0, 0.5, 2.0], vec![0.0, 1.0]], |_| 0.5, |_, _| -0.25, |_, _| 0.0);
    let mut tracker = tracker(&flow, OUTFLOW, vec![]);
    tracker.ends[0] = Ends::Periodic { low: 0.0, high: 2.0 };
    let periodic = |at: f64| Plane { periods: [Some((0.0, 2.0)), None], ..plane(0, at) };
    tracker.planes = vec![periodic(0.0), periodic(1.0), periodic(2.0)];
    let (ends, log) = go(&tracker, &[[0.25, 0.5]], 3, 3.0);
    assert!((ends[0].unwrap()[0] - (0.25 + 4.0 + 2.0 - 4.5 - 2.0 + 2.0)).abs() < 1e-14);
    let of = |wanted: usize| -> Vec<f64> {
        log.crossed.iter().filter(|(_, plane, ..)| *plane == wanted).map(|crossed| crossed.3).collect()
    };
    assert!(log.crossed.iter().all(|crossed| !crossed.2));
    for (plane, exact) in [(0, [0.5, 4.5, 8.5]), (2, [0.5, 4.5, 8.5])] {
        let found = of(plane);
        assert_eq!(found.len(), 3);
        found.iter().zip(exact).for_each(|(found, exact)| assert!((found - exact).abs() < 1e-13));
    }
    assert_eq!(of(1).len(), 2);
}
