//! Walks on cells of any width, porosity and number of dispersivities.

mod support;

use lamella::engine::Settings;
use lamella::engine::snapshot::Values;
use lamella::flow::darcy::{self, Problem};
use lamella::flow::{Cells, FaceFlow, FlowSeries};
use lamella::plan::burnett_frind::uniform_tensor;
use lamella::plan::tape::{Binary, Operation, Tape};
use lamella::plan::transport::{
    Conductivity, Darcy, DarcySide, Dispersion, Flow, Patch, Population, Region, SideRule, Source, Strength,
    SubSteps, Transport,
};
use lamella::plan::{Axis, OutputKind, Placement, Plan, Quantity, Side};
use std::sync::Arc;
use support::{constant, output, plain, run_with, walk};

/// Numbers in (0, 1) that look random.
struct Numbers(u64);

impl Numbers {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        ((self.0 >> 11) as f64 + 0.5) / 9_007_199_254_740_992.0
    }

    /// Edges from 0 to `high`, whose distances differ by up to a factor of `contrast`.
    fn edges(&mut self, high: f64, n: usize, contrast: f64) -> Vec<f64> {
        let widths: Vec<f64> = (0..n).map(|_| 1.0 + (contrast - 1.0) * self.next()).collect();
        let whole: f64 = widths.iter().sum();
        let mut edges = vec![0.0];
        for width in &widths {
            edges.push(edges[edges.len() - 1] + high * width / whole);
        }
        edges[n] = high;
        edges
    }
}

/// Measured numbers, shown by `cargo test -- --nocapture`.
#[expect(clippy::print_stdout, reason = "tests report what they measured")]
fn tell(report: &str) {
    println!("{report}");
}

/// Flow from left to right through cells of independent conductivities, ln K of variance 1.
fn random_flow(
    edges: [Vec<f64>; 3],
    porosity: impl Fn(&mut Numbers) -> f64,
    numbers: &mut Numbers,
) -> FaceFlow {
    let cells = Cells::new(edges).unwrap();
    let n = cells.n_cells();
    let normal = |numbers: &mut Numbers| (0..12).map(|_| numbers.next()).sum::<f64>() - 6.0;
    let conductivity = (0..n).map(|_| lamella::maths::scalar::exp(normal(numbers))).collect();
    let porosity = (0..n).map(|_| porosity(numbers)).collect();
    let length = cells.edges()[0].last().unwrap() - cells.edges()[0][0];
    let mut sides = [[darcy::Side::NoFlow; 2]; 3];
    sides[0] = [darcy::Side::Head(length), darcy::Side::Head(0.0)];
    let problem = Problem { cells, conductivity, anisotropy: [1.0; 3], porosity, sides, wells: vec![] };
    darcy::solve(problem).unwrap().flow
}

/// A box that water of concentration 1 flows through, on cells that the tests hand over.
fn scene(flow: &FaceFlow, d: usize, dispersion: [f64; 4], n: u64, duration: f64) -> Plan {
    let ends = |axis: usize| (flow.cells.edges()[axis][0], *flow.cells.edges()[axis].last().unwrap());
    let axis = |index: usize| {
        let (low, high) = ends(index);
        Axis { index, low, high, low_side: Side::Reflect, high_side: Side::Reflect, bins: 1 }
    };
    let axes: Vec<Axis> = (0..d).map(axis).collect();
    let low: Vec<f64> = axes.iter().map(|axis| axis.low).collect();
    let high: Vec<f64> = axes.iter().map(|axis| axis.high).collect();
    let patch = |rule: SideRule| vec![Patch { low: low.clone(), high: high.clone(), rule }];
    let mut sides = vec![[patch(SideRule::Inflow(vec![constant(1.0)])), patch(SideRule::Outflow)]];
    sides.extend((1..d).map(|_| [patch(SideRule::Reflect), patch(SideRule::Reflect)]));
    // The porosity is that of the cells: an expression that is none of a single number.
    let porosity = Tape {
        operations: vec![
            Operation::Input(0),
            Operation::Constant(1.0),
            Operation::Binary(Binary::Multiply, 0, 1),
        ],
    };
    let [longitudinal, transverse, transverse_vertical, molecular] = dispersion;
    let transport = Transport {
        flow: Flow::Darcy(Box::new(Darcy {
            cells: flow.cells.n()[..d].to_vec(),
            sides: vec![[DarcySide::NoFlow; 2]; d],
            conductivity: Conductivity::Expression(constant(1.0)),
            anisotropy: vec![1.0; d],
            wells: vec![],
        })),
        changes: vec![],
        dispersion: Dispersion::Velocity { longitudinal, transverse, transverse_vertical, molecular },
        porosity,
        sides,
        sources: vec![],
        populations: vec![Population {
            species: 0,
            count: n,
            retardation: 1.0,
            molecular: None,
            is_mobile: true,
            initial: constant(1.0),
            made: None,
        }],
        decay: None,
        sub_steps: Some(SubSteps { courant: 0.15, dispersion: 0.06 }),
        interfaces: vec![],
        is_of_fluid: false,
        order: None,
    };
    let mut plan = plain(axes, walk(d, d as f64), n, duration, duration);
    plan.particles.placement = Placement::Random;
    Plan { transport: Some(transport), ..plan }
}

/// χ² per bin of a map that should be 1 everywhere, at the end.
fn chi_of_uniform(plan: &mut Plan, flow: FaceFlow, bins: Vec<usize>) -> f64 {
    let n_bins = bins.iter().product::<usize>() as f64;
    plan.outputs = vec![output(OutputKind::Map, vec![Quantity::Species(0)], bins, vec![plan.time.duration])];
    let settings = Settings { flow: Some(FlowSeries::steady(Arc::new(flow))), ..Settings::default() };
    let (outcome, snapshots) = run_with(plan, &settings).unwrap();
    assert!(outcome.worst_defect() < 1e-12);
    let Values::Binned { mean, standard_error, .. } = &snapshots[0].values else { panic!() };
    let worst = mean[0].iter().fold(0.0_f64, |worst, mean| worst.max((mean - 1.0).abs()));
    let chi: f64 = mean[0].iter().zip(&standard_error[0]).map(|(m, e)| ((m - 1.0) / e).powi(2)).sum();
    tell(&format!("χ² per bin {:.3}, worst {worst:.3}", chi / n_bins));
    chi / n_bins
}

/// Cells whose widths differ by up to 4, one porosity.
#[test]
fn uniform_stays_uniform_on_cells_of_any_width() {
    let mut numbers = Numbers(1);
    let edges = [numbers.edges(60.0, 40, 4.0), numbers.edges(30.0, 20, 4.0), vec![0.0, 1.0]];
    let flow = random_flow(edges, |_| 0.25, &mut numbers);
    let mut plan = scene(&flow, 2, [0.5, 0.1, 0.1, 1e-3], 100_000, 20.0);
    let chi = chi_of_uniform(&mut plan, flow, vec![30, 15]);
    // χ² of 450 bins: 4 standard deviations above its mean.
    assert!(chi < 1.0 + 4.0 * (2.0 / 450.0_f64).sqrt());
}

fn equal_cells(n: [u32; 3]) -> [Vec<f64>; 3] {
    n.map(|n| (0..=n).map(f64::from).collect())
}

/// Porosity of each cell anywhere from 0.1 to 0.4, one discharge: dispersion jumps with the velocity. Displacements
/// that take the coefficients of where they begin give 2.7 here.
#[test]
fn uniform_stays_uniform_where_porosity_differs_from_cell_to_cell() {
    let mut numbers = Numbers(2);
    let mut flow = random_flow(equal_cells([40, 20, 1]), |n| 0.1 + 0.3 * n.next(), &mut numbers);
    flow.flux[0].fill(0.25);
    flow.flux[1].fill(0.0);
    let mut plan = scene(&flow, 2, [0.5, 0.1, 0.1, 1e-2], 100_000, 10.0);
    plan.transport.as_mut().unwrap().sub_steps = Some(SubSteps { courant: 0.25, dispersion: 0.1 });
    let chi = chi_of_uniform(&mut plan, flow, vec![40, 20]);
    assert!(chi < 1.0 + 4.0 * (2.0 / 800.0_f64).sqrt());
}

/// Conductivity and porosity of each cell differ from those of the next; steps are those of careful scenes.
#[test]
fn uniform_stays_uniform_in_a_random_flow_of_random_porosity() {
    let mut numbers = Numbers(3);
    let flow = random_flow(equal_cells([40, 20, 1]), |n| 0.2 + 0.1 * n.next(), &mut numbers);
    let mut plan = scene(&flow, 2, [0.5, 0.1, 0.1, 1e-2], 100_000, 10.0);
    plan.transport.as_mut().unwrap().sub_steps = Some(SubSteps { courant: 0.1, dispersion: 0.04 });
    let chi = chi_of_uniform(&mut plan, flow, vec![40, 20]);
    assert!(chi < 1.0 + 4.0 * (2.0 / 800.0_f64).sqrt());
}

/// Three dimensions, three dispersivities.
#[test]
fn uniform_stays_uniform_where_vertical_dispersion_is_its_own() {
    let mut numbers = Numbers(4);
    let edges = [numbers.edges(24.0, 16, 2.0), numbers.edges(12.0, 8, 2.0), numbers.edges(8.0, 6, 2.0)];
    let flow = random_flow(edges, |_| 0.25, &mut numbers);
    let mut plan = scene(&flow, 3, [0.5, 0.2, 0.02, 1e-3], 60_000, 10.0);
    let chi = chi_of_uniform(&mut plan, flow, vec![8, 6, 4]);
    assert!(chi < 1.0 + 4.0 * (2.0 / 192.0_f64).sqrt());
}

/// Covariances of a pulse in uniform flow at an angle to all axes: `2 D t` with the tensor of Burnett and Frind, on
/// cells and by expressions.
#[test]
fn a_pulse_spreads_in_three_ways_across_an_oblique_flow() {
    let velocity = [0.6, -0.3, 0.4];
    let lengths = [0.5, 0.1, 0.01];
    let mut flow = random_flow(equal_cells([20, 20, 20]), |_| 0.25, &mut Numbers(5));
    for (q, v) in flow.flux.iter_mut().zip(velocity) {
        q.fill(0.25 * v);
    }
    let exact = uniform_tensor(velocity, [lengths[0], lengths[1], lengths[2], 1e-3]);
    let on_cells = scene(&flow, 3, [lengths[0], lengths[1], lengths[2], 1e-3], 100_000, 4.0);
    let mut by_expressions = on_cells.clone();
    let transport = by_expressions.transport.as_mut().unwrap();
    transport.flow = Flow::Expression(velocity.map(constant).to_vec());
    transport.porosity = constant(0.25);
    for mut plan in [on_cells, by_expressions] {
        let transport = plan.transport.as_mut().unwrap();
        transport.populations[0].initial = constant(0.0);
        transport.sources.push(Source {
            name: "pulse".into(),
            species: 0,
            region: Region::Point(vec![8.0, 11.0, 9.0]),
            strength: Strength::Pulse(1.0),
            during: (0.0, 0.0),
        });
        transport.sides.iter_mut().flatten().flatten().for_each(|patch| patch.rule = SideRule::Reflect);
        plan.outputs = vec![output(OutputKind::Particles, vec![Quantity::Species(0)], vec![], vec![4.0])];
        let settings =
            Settings { flow: Some(FlowSeries::steady(Arc::new(flow.clone()))), ..Settings::default() };
        let (_, snapshots) = run_with(&plan, &settings).unwrap();
        let Values::Particles { positions, .. } = &snapshots[0].values else { panic!() };
        let n = positions[0].len() as f64;
        let mean = [0, 1, 2].map(|axis| positions[axis].iter().sum::<f64>() / n);
        for i in 0..3 {
            for j in 0..=i {
                let product = |(a, b): (&f64, &f64)| (a - mean[i]) * (b - mean[j]);
                let found = positions[i].iter().zip(&positions[j]).map(product).sum::<f64>() / n;
                let at = |i: usize, j: usize| 8.0 * exact[i][j];
                // Four standard deviations of a covariance of normal numbers.
                let bound = 4.0 * ((at(i, i) * at(j, j) + at(i, j) * at(i, j)) / n).sqrt();
                assert!((found - at(i, j)).abs() < bound, "{i} {j}: {found} for {}", at(i, j));
            }
        }
    }
}

/// A coefficient of dispersion of its own on cells of random porosity: what is uniform stays so.
#[test]
fn dispersion_may_be_a_number_where_flow_is_on_cells() {
    let mut numbers = Numbers(6);
    let mut flow = random_flow(equal_cells([40, 20, 1]), |n| 0.1 + 0.3 * n.next(), &mut numbers);
    flow.flux[0].fill(0.1);
    flow.flux[1].fill(0.0);
    let mut plan = scene(&flow, 2, [0.0; 4], 100_000, 10.0);
    plan.transport.as_mut().unwrap().dispersion = Dispersion::Constant(vec![0.3, 0.1, 0.2]);
    plan.transport.as_mut().unwrap().sub_steps = Some(SubSteps { courant: 0.1, dispersion: 0.04 });
    let chi = chi_of_uniform(&mut plan, flow, vec![40, 20]);
    assert!(chi < 1.0 + 4.0 * (2.0 / 800.0_f64).sqrt());
}
