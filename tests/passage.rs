//! What passes planes and sides, moments, dilution and budgets, held to closed forms.

mod support;

use lamella::engine::Settings;
use lamella::engine::snapshot::{Row, Snapshot, Values};
use lamella::maths::scalar::{erfc, exp};
use lamella::plan::transport::{
    Dispersion, Flow, Patch, Population, Region, SideRule, Source, Strength, SubSteps, Transport,
};
use lamella::plan::{Axis, Output, OutputKind, Plan, Quantity, Side, Station};
use std::f64::consts::PI;
use support::{constant, output, plain, run, run_with, walk};

const N: u64 = 100_000;

/// A box of water with one species; uniform flow along the first axis.
fn scene(
    low: &[f64],
    high: &[f64],
    rules: &[[SideRule; 2]],
    v: f64,
    d: f64,
    duration: f64,
    step: f64,
) -> Plan {
    let n_axes = low.len();
    let axis = |index: usize| Axis {
        index,
        low: low[index],
        high: high[index],
        low_side: Side::Reflect,
        high_side: Side::Reflect,
        bins: 1,
    };
    let patch = |rule: &SideRule| vec![Patch { low: low.to_vec(), high: high.to_vec(), rule: rule.clone() }];
    let mut velocity = vec![0.0; n_axes];
    velocity[0] = v;
    let triangle =
        (0..n_axes).flat_map(|row| (0..=row).map(move |column| if row == column { d } else { 0.0 }));
    let transport = Transport {
        flow: Flow::Uniform(velocity),
        changes: vec![],
        dispersion: Dispersion::Constant(triangle.collect()),
        porosity: constant(1.0),
        sides: rules.iter().map(|[a, b]| [patch(a), patch(b)]).collect(),
        sources: vec![],
        populations: vec![Population {
            species: 0,
            count: N,
            retardation: 1.0,
            molecular: None,
            is_mobile: true,
            initial: constant(0.0),
            made: None,
        }],
        is_of_fluid: false,
        decay: None,
        sub_steps: None,
        interfaces: vec![],
        order: None,
    };
    let base = plain((0..n_axes).map(axis).collect(), walk(n_axes, 0.0), N, duration, step);
    Plan { transport: Some(transport), ..base }
}

fn line(v: f64, d: f64, duration: f64, step: f64) -> Plan {
    let mut plan = scene(&[-50.0], &[50.0], &[[SideRule::Open, SideRule::Open]], v, d, duration, step);
    pulse(&mut plan, Region::Point(vec![0.0]), 1.0);
    plan
}

fn transport(plan: &mut Plan) -> &mut Transport {
    plan.transport.as_mut().unwrap()
}

fn pulse(plan: &mut Plan, region: Region, mass: f64) {
    let name = "pulse".to_owned();
    let source = Source { name, species: 0, region, strength: Strength::Pulse(mass), during: (0.0, 0.0) };
    transport(plan).sources.push(source);
}

fn of(kind: OutputKind, bins: Vec<usize>, times: &[f64]) -> Output {
    output(kind, vec![Quantity::Species(0)], bins, times.to_vec())
}

fn at(kind: OutputKind, station: Station, times: &[f64]) -> Output {
    Output { station: Some(station), ..of(kind, vec![], times) }
}

fn plane(at: f64) -> Station {
    Station::Plane { axis: 0, at }
}

fn every(interval: f64, n: u32) -> Vec<f64> {
    (0..=n).map(|k| f64::from(k) * interval).collect()
}

/// The rows of the first species of an output, time by time.
fn rows(snapshots: &[Snapshot], output_idx: usize) -> Vec<(f64, Vec<Row>)> {
    let of_output = snapshots.iter().filter(|snapshot| snapshot.output_idx == output_idx);
    let found: Vec<(f64, Vec<Row>)> = of_output
        .map(|snapshot| {
            let Values::Rows(rows) = &snapshot.values else { panic!("{:?}", snapshot.values) };
            (snapshot.t, rows[0].clone())
        })
        .collect();
    assert!(found.windows(2).all(|pair| pair[0].0 < pair[1].0), "times are not in order");
    found
}

/// The numbers of the only row at each time.
fn course(snapshots: &[Snapshot], output_idx: usize) -> Vec<(f64, Vec<f64>)> {
    let rows = rows(snapshots, output_idx);
    rows.into_iter().map(|(t, rows)| (t, rows[0].numbers.clone())).collect()
}

/// Chance that a Brownian motion with drift has been at `a` by `t`: the inverse Gaussian law.
fn has_passed(a: f64, v: f64, d: f64, t: f64) -> f64 {
    let s = (4.0 * d * t).sqrt();
    0.5 * (erfc((a - v * t) / s) + exp(v * a / d) * erfc((a + v * t) / s))
}

/// First passage is exact in law at any step and any time, between steps too.
#[test]
fn first_passage_follows_the_inverse_gaussian_law() {
    let (a, v, d) = (2.0, 1.0, 0.3);
    for step in [6.0, 1.0, 0.07] {
        let mut plan = line(v, d, 6.0, step);
        plan.outputs = vec![at(OutputKind::FirstPassage, plane(a), &every(0.5, 12))];
        let (_, snapshots) = run(&plan);
        let found = course(&snapshots, 0);
        assert_eq!(found.len(), 13);
        let mut n_so_far = 0.0;
        for (t, numbers) in found {
            n_so_far += numbers[2];
            assert!((numbers[0] - n_so_far / N as f64).abs() < 1e-9);
            if t == 0.0 {
                assert!(numbers[0] == 0.0 && numbers[1].is_nan());
                continue;
            }
            let exact = has_passed(a, v, d, t);
            let bound = 4.5 * (exact * (1.0 - exact) / N as f64).sqrt() + 1e-9;
            assert!((numbers[0] - exact).abs() < bound, "step {step} t {t}: {} {exact}", numbers[0]);
        }
    }
}

/// A. Kreft, A. Zuber (1978), doi:10.1016/0009-2509(78)85196-3: a pulse in the resident concentration seen in
/// the flux, `C_F = C (x + vt)/(2vt)`, `C` the Gaussian; steps as long as the bins of time, and longer ones.
#[test]
fn a_pulse_breaks_through_in_the_flux() {
    let (x, v, d, porosity) = (3.0, 1.0, 0.2, 0.3);
    for step in [1.0, 0.25, 0.05] {
        let mut plan = line(v, d, 8.0, step);
        transport(&mut plan).porosity = constant(porosity);
        plan.outputs = vec![at(OutputKind::Breakthrough, plane(x), &every(0.25, 32))];
        let (_, snapshots) = run(&plan);
        let flux = |t: f64| {
            let c = exp(-(x - v * t).powi(2) / (4.0 * d * t)) / (4.0 * PI * d * t).sqrt() / porosity;
            c * (x + v * t) / (2.0 * v * t)
        };
        for (t, numbers) in course(&snapshots, 0).into_iter().skip(1) {
            let exact: f64 =
                (0..1000).map(|k| flux(t - 0.25 + 0.25 * (f64::from(k) + 0.5) / 1000.0)).sum::<f64>()
                    / 1000.0;
            // One passage of a particle is 1/N of the mass in 0.25 s of water.
            let unit = 1.0 / (N as f64 * 0.25 * v * porosity);
            let bound = 4.5 * unit * numbers[3].sqrt().max(1.0);
            assert!((numbers[0] - exact).abs() < bound, "step {step} t {t}: {} {exact}", numbers[0]);
            assert!((numbers[1] - numbers[0] * v * porosity).abs() < 1e-12);
            let beyond = 0.5 * erfc((x - v * t) / (4.0 * d * t).sqrt());
            let bound = 4.5 * (beyond * (1.0 - beyond) / N as f64).sqrt() + 1e-9;
            assert!((numbers[2] - beyond).abs() < bound, "step {step} t {t}: {} {beyond}", numbers[2]);
        }
    }
}

/// The same book: injected with the water and seen in the flux, a step is that of Ogata and Banks; retarded by R,
/// at `v/R` and `D/R`.
#[test]
fn a_step_breaks_through_in_the_flux() {
    let (x, v, d) = (1.0, 1.0, 0.1);
    for (step, retardation) in [(0.5, 1.0), (0.05, 1.0), (0.1, 2.0)] {
        let inflow = SideRule::Inflow(vec![constant(2.0)]);
        let mut plan = scene(&[0.0], &[30.0], &[[inflow, SideRule::Reflect]], v, d, 5.0, step);
        transport(&mut plan).populations[0].retardation = retardation;
        plan.outputs = vec![at(OutputKind::Breakthrough, plane(x), &every(0.5, 10))];
        let (_, snapshots) = run(&plan);
        let flux = |t: f64| 2.0 * has_passed(x, v / retardation, d / retardation, t);
        let unit = 10.0 / N as f64 / 0.5;
        for (t, numbers) in course(&snapshots, 0).into_iter().skip(1) {
            let exact: f64 =
                (0..1000).map(|k| flux(t - 0.5 + 0.5 * (f64::from(k) + 0.5) / 1000.0)).sum::<f64>() / 1000.0;
            let bound = 4.5 * unit * numbers[3].sqrt().max(1.0) + 0.01;
            assert!((numbers[0] - exact).abs() < bound, "step {step} t {t}: {} {exact}", numbers[0]);
        }
    }
}

/// What went through a plane is beyond it, exactly, whatever the sides do.
#[test]
fn what_went_through_a_plane_is_beyond_it() {
    let held = || SideRule::Held(vec![constant(1.0)]);
    let inflow = || SideRule::Inflow(vec![constant(1.0)]);
    for rules in [[held(), SideRule::Reflect], [inflow(), SideRule::Reflect]] {
        for sub_steps in [None, Some(SubSteps { courant: 0.01, dispersion: 0.002 })] {
            let mut plan = scene(&[0.0], &[20.0], std::slice::from_ref(&rules), 0.5, 1.0, 3.1, 0.5);
            transport(&mut plan).sub_steps = sub_steps;
            pulse(&mut plan, Region::Point(vec![0.3]), 0.5);
            let beyond = Station::Box { low: vec![1.0], high: vec![20.0] };
            let times = [0.5, 1.5, 3.0, 3.1];
            plan.outputs = vec![
                at(OutputKind::Breakthrough, plane(1.0), &times),
                at(OutputKind::Breakthrough, beyond, &times),
            ];
            let (_, snapshots) = run(&plan);
            let through = course(&snapshots, 0);
            let boxed = course(&snapshots, 1);
            for ((t, through), (_, boxed)) in through.iter().zip(&boxed) {
                let inside = boxed[0] * 19.0;
                assert!((through[2] - inside).abs() < 1e-12, "{rules:?} t {t}: {} {inside}", through[2]);
                assert!(inside > 0.0 && boxed[1].is_nan() && boxed[2].is_nan());
            }
        }
    }
}

/// Around a period everything goes by again and again: `c v t` in all.
#[test]
fn around_a_period_what_passes_is_counted_again() {
    let periodic = [SideRule::Periodic, SideRule::Periodic];
    for step in [0.75, 0.05] {
        let mut plan = scene(&[0.0], &[1.0], std::slice::from_ref(&periodic), 2.0, 0.1, 3.0, step);
        transport(&mut plan).populations[0].initial = constant(1.0);
        plan.outputs = vec![at(OutputKind::Breakthrough, plane(0.4), &[3.0])];
        let (_, snapshots) = run(&plan);
        let (_, numbers) = &course(&snapshots, 0)[0];
        // A particle comes by 6 times, and once more or less.
        assert!(
            (numbers[2] - 6.0).abs() < 4.5 * (2.0 * 0.1 * 3.0 / N as f64).sqrt() + 1e-4,
            "{}",
            numbers[2]
        );
        assert!((numbers[0] - 1.0).abs() < 2e-3);
    }
}

/// Times at which some fall between steps.
const TIMES: [f64; 4] = [0.0, 3.3, 7.5, 10.0];

#[test]
fn moments_grow_as_the_equation_says() {
    let sides = [[SideRule::Open, SideRule::Open], [SideRule::Open, SideRule::Open]];
    for step in [10.0, 2.0] {
        let mut plan = scene(&[-50.0, -50.0], &[50.0, 50.0], &sides, 1.0, 0.1, 10.0, step);
        transport(&mut plan).dispersion = Dispersion::Constant(vec![0.1, 0.04, 0.05]);
        pulse(&mut plan, Region::Gaussian(vec![1.0, -2.0], vec![0.5, 0.3]), 2.0);
        plan.outputs = vec![of(OutputKind::Moments, vec![], &TIMES)];
        let (_, snapshots) = run(&plan);
        let found = course(&snapshots, 0);
        assert_eq!(found.len(), TIMES.len());
        for (t, numbers) in found {
            let n = N as f64;
            assert!((numbers[0] - 2.0).abs() < 1e-12);
            let [xx, yy, xy] = [0.25 + 0.2 * t, 0.09 + 0.1 * t, 0.08 * t];
            assert!((numbers[1] - 1.0 - t).abs() < 4.5 * (xx / n).sqrt(), "t {t}: {}", numbers[1]);
            assert!((numbers[2] + 2.0).abs() < 4.5 * (yy / n).sqrt(), "t {t}: {}", numbers[2]);
            assert!((numbers[4] / xx - 1.0).abs() < 4.5 * (2.0 / n).sqrt(), "t {t}: {} {xx}", numbers[4]);
            assert!((numbers[5] / yy - 1.0).abs() < 4.5 * (2.0 / n).sqrt(), "t {t}: {} {yy}", numbers[5]);
            assert!(
                (numbers[7] - xy).abs() < 4.5 * ((xx * yy + xy * xy) / n).sqrt(),
                "t {t}: {}",
                numbers[7]
            );
            assert!([3, 6, 8, 9].iter().all(|&idx| numbers[idx].is_nan()));
        }
    }
}

/// P. K. Kitanidis (1994): a Gaussian in d dimensions fills `(4πe Dt)^{d/2}`.
#[test]
fn a_gaussian_is_as_dilute_as_it_should_be() {
    let open = [SideRule::Open, SideRule::Open];
    for n_axes in [1, 2] {
        let (low, high) = (vec![-10.0; n_axes], vec![10.0; n_axes]);
        let mut plan = scene(&low, &high, &vec![open.clone(); n_axes], 0.0, 0.5, 2.0, 2.0);
        transport(&mut plan).populations[0].count = 1_000_000;
        pulse(&mut plan, Region::Point(vec![0.0; n_axes]), 1.0);
        plan.outputs = vec![of(OutputKind::Dilution, vec![80; n_axes], &[1.0, 2.0])];
        let (_, snapshots) = run(&plan);
        for (t, numbers) in course(&snapshots, 0) {
            // Means over bins widen the Gaussian by h²/12 along each axis, and entropies of 10⁶ particles in
            // thousands of bins are too small by about (bins − 1)/2n: both under half a percent.
            let exact = (4.0 * PI * 0.5 * t * std::f64::consts::E).powf(0.5 * n_axes as f64);
            assert!((numbers[0] / exact - 1.0).abs() < 0.01, "{n_axes} axes t {t}: {} {exact}", numbers[0]);
            assert!((numbers[2] * 20_f64.powi(n_axes as i32) / numbers[0] - 1.0).abs() < 1e-12);
            let volume = 0.25_f64.powi(n_axes as i32);
            assert!((exp(numbers[1]) * volume / numbers[0] - 1.0).abs() < 1e-12);
        }
    }
}

/// A column with everything: an initial mass, a source over time, inflow, outflow, an absorbing side.
fn column() -> Plan {
    let inflow = SideRule::Inflow(vec![constant(0.5)]);
    let rules = [[inflow, SideRule::Outflow], [SideRule::Absorb, SideRule::Reflect]];
    let mut plan = scene(&[0.0, 0.0], &[4.0, 1.0], &rules, 1.0, 0.05, 6.0, 0.25);
    transport(&mut plan).populations[0].count = 30_000;
    transport(&mut plan).populations[0].initial = constant(0.25);
    transport(&mut plan).sources.push(Source {
        name: "leak".into(),
        species: 0,
        region: Region::Point(vec![1.0, 0.5]),
        strength: Strength::Rate(0.2),
        during: (1.0, 5.0),
    });
    plan
}

#[test]
fn budgets_add_up() {
    let mut plan = column();
    let times = every(0.6, 10);
    plan.outputs = vec![
        of(OutputKind::Budget, vec![], &times),
        of(OutputKind::Total, vec![], &times),
        at(OutputKind::Breakthrough, Station::Side(1), &[6.0]),
    ];
    let places = plan.places(&plan.outputs[0]);
    assert_eq!(places, ["initial", "leak", "left", "right", "bottom", "top", "inside", "defect"]);
    let (outcome, snapshots) = run(&plan);
    assert!(outcome.worst_defect() < 1e-12);
    let totals: Vec<f64> = snapshots
        .iter()
        .filter_map(
            |snapshot| if let Values::Total { amount } = &snapshot.values { Some(amount[0]) } else { None },
        )
        .collect();
    let found = rows(&snapshots, 0);
    assert_eq!((found.len(), totals.len()), (11, 11));
    for ((t, rows), total) in found.iter().zip(&totals) {
        let number = |place: usize, idx: usize| rows[place].numbers[idx];
        let sum: f64 = (0..6).map(|place| number(place, 0)).sum();
        assert!((sum - number(6, 0)).abs() < 1e-12 && number(7, 0).abs() < 1e-12, "t {t}: {sum}");
        assert_eq!(number(6, 0), *total);
        assert!((number(0, 1) - 1.0).abs() < 1e-12 && number(0, 2) == 0.0);
        // Particles of 2.5e-4: the last one may be due.
        assert!((number(1, 1) - 0.2 * (t - 1.0).clamp(0.0, 4.0)).abs() < 5e-4, "t {t}: {}", number(1, 1));
        assert!((number(2, 1) - 0.5 * t).abs() < 5e-4, "t {t}: {}", number(2, 1));
        assert!((0..6).all(|place| number(place, 0) == number(place, 1) - number(place, 2)));
        assert!(*t == 0.0 || (number(3, 2) > 0.0 && number(4, 2) > 0.0 && number(5, 2) == 0.0));
    }
    let (_, through) = &course(&snapshots, 2)[0];
    assert!((through[2] - found[10].1[3].numbers[2]).abs() < 1e-12);
}

/// Column flushed for long: what leaves has the concentration of what comes, and so has the water inside.
#[test]
fn at_the_end_of_a_column_comes_what_went_in() {
    let inflow = SideRule::Inflow(vec![constant(2.0)]);
    let mut plan = scene(&[0.0], &[4.0], &[[inflow, SideRule::Outflow]], 1.0, 0.3, 30.0, 0.5);
    transport(&mut plan).porosity = constant(0.4);
    plan.outputs = vec![
        at(OutputKind::Breakthrough, Station::Side(1), &[20.0, 30.0]),
        at(OutputKind::Breakthrough, Station::Box { low: vec![1.0], high: vec![3.0] }, &[30.0]),
        at(OutputKind::Breakthrough, Station::Side(0), &[30.0]),
    ];
    let (_, snapshots) = run(&plan);
    let (_, right) = &course(&snapshots, 0)[1];
    assert!((right[0] - 2.0).abs() < 0.03, "{}", right[0]);
    let (_, inside) = &course(&snapshots, 1)[0];
    assert!((inside[0] - 2.0).abs() < 4.5 * 2.0 / inside[3].sqrt(), "{}", inside[0]);
    // Out of the left side comes less than nothing, and so does water.
    let (_, left) = &course(&snapshots, 2)[0];
    assert!((left[0] - 2.0).abs() < 1e-3 && left[2] < 0.0, "{left:?}");
}

/// An output more, between steps or at planes, changes no other; nor do threads and width.
#[test]
fn outputs_threads_and_width_change_no_byte() {
    let mut plan = column();
    plan.outputs = vec![
        of(OutputKind::Particles, vec![], &[3.0, 6.0]),
        at(OutputKind::Breakthrough, plane(2.0), &every(0.5, 12)),
        of(OutputKind::Moments, vec![], &[1.1, 6.0]),
    ];
    let with = |plan: &Plan, threads: usize, is_narrow: bool| {
        let settings = Settings { threads: Some(threads), is_narrow, ..Settings::default() };
        format!("{:?}", run_with(plan, &settings).unwrap().1)
    };
    let reference = with(&plan, 1, false);
    assert_eq!(reference, with(&plan, 2, false));
    assert_eq!(reference, with(&plan, 7, true));
    let mut more = plan.clone();
    more.outputs.extend([
        at(OutputKind::FirstPassage, plane(2.5), &every(0.1, 60)),
        of(OutputKind::Budget, vec![], &[0.1, 1.1, 5.9]),
        of(OutputKind::Dilution, vec![8, 4], &[0.33, 1.1]),
        of(OutputKind::Profile, vec![8, 1], &[0.9]),
        at(OutputKind::Breakthrough, plane(1.0), &every(0.5, 12)),
    ]);
    let (_, snapshots) = run(&more);
    let own: Vec<Snapshot> = snapshots.into_iter().filter(|snapshot| snapshot.output_idx < 3).collect();
    assert_eq!(reference, format!("{own:?}"));
}

/// Fluid particles have moments and dilution, too: water that carries a Gaussian.
#[test]
fn fluid_particles_have_moments_and_dilution() {
    use lamella::plan::tape::{Binary, Operation, Tape, Unary};
    let axes = vec![support::axis(0, -20.0, 20.0, Side::Reflect, 1)];
    let mut plan = plain(axes, walk(1, 0.1), 400_000, 10.0, 2.0);
    plan.walk.drift = vec![0.3];
    // exp(−x²): variance 1/2, amount √π.
    plan.components[0].initial = Tape {
        operations: vec![
            Operation::Input(0),
            Operation::Binary(Binary::Multiply, 0, 0),
            Operation::Unary(Unary::Negate, 1),
            Operation::Unary(Unary::Exp, 2),
        ],
    };
    plan.outputs = vec![
        of(OutputKind::Moments, vec![], &[0.0, 5.0, 10.0]),
        of(OutputKind::Dilution, vec![400], &[10.0]),
    ];
    let (_, snapshots) = run(&plan);
    for (t, numbers) in course(&snapshots, 0) {
        let variance = 0.5 + 0.2 * t;
        assert!((numbers[0] / PI.sqrt() - 1.0).abs() < 1e-3, "{}", numbers[0]);
        // Of 400,000 particles some 20,000 carry the Gaussian.
        assert!((numbers[1] - 0.3 * t).abs() < 4.5 * (variance / 2e4).sqrt(), "t {t}: {}", numbers[1]);
        assert!((numbers[4] / variance - 1.0).abs() < 4.5 * (2.0 / 2e4_f64).sqrt(), "t {t}: {}", numbers[4]);
    }
    let (_, numbers) = &course(&snapshots, 1)[0];
    let exact = (2.0 * PI * std::f64::consts::E * 2.5).sqrt();
    assert!((numbers[0] / exact - 1.0).abs() < 0.01, "{} {exact}", numbers[0]);
}

/// Places of outputs are read, and laid out as they are written.
#[test]
fn places_are_read_and_laid_out() {
    use lamella::source::FileId;
    use lamella::syntax::tree::{Place, StatementKind};
    use lamella::syntax::{format, parse};
    let text = "lamella 1
output breakthrough  S, O at x = 150 m every 1 d in mg/L
output breakthrough  S    at right flux_weighted at t = 1 d
output breakthrough  S    at y = 1 m every 1 d resident on 200
output breakthrough  S in box(5 m .. 10 m, 30 m .. 50 m) every 1 d in mg/L
output first_passage S every 1 d at x = 2 * w
output breakthrough  S    at x = 100 m, y = 20 .. 40 m, z = 0 .. 2 m every 1 d
output breakthrough  S    at right y = 20 .. 40 m every 1 d
output first_passage S    at well pump every 1 d
";
    let (file, problems) = parse(FileId(0), text);
    assert!(problems.is_empty(), "{problems:?}");
    assert_eq!(format(&file, text), text);
    let outputs: Vec<_> = file
        .statements
        .iter()
        .filter_map(
            |statement| if let StatementKind::Output(output) = &statement.kind { Some(output) } else { None },
        )
        .collect();
    let place = |idx: usize| outputs[idx].place.as_ref().unwrap();
    assert!(matches!(place(0), Place::Plane(name, _, part) if name.value == "x" && part.is_empty()));
    assert!(matches!(place(1), Place::Side(name, part) if name.value == "right" && part.is_empty()));
    assert!(matches!(place(3), Place::Box(_, ranges) if ranges.len() == 2));
    assert!(matches!(place(5), Place::Plane(_, _, part) if part.len() == 2));
    assert!(matches!(place(6), Place::Side(_, part) if part.len() == 1));
    assert!(matches!(place(7), Place::Well(name) if name.value == "pump"));
    let word = |idx: usize| outputs[idx].averaging.as_ref().map(|name| name.value.as_str());
    assert_eq!([word(0), word(1), word(2)], [None, Some("flux_weighted"), Some("resident")]);
    assert_eq!(outputs[3].unit.as_ref().unwrap().value, "mg/L");
    assert!(outputs.iter().all(|output| output.times.is_some()));
}
