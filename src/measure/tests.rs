//! Comparison of made-up results, whose errors are known, with references.

use super::{Evaluated, evaluate};
use crate::engine::snapshot::{MixingState, Outcome, Snapshot, Values};
use crate::plan::evaluation::{Evaluation, Fact, Field, Measure, Norm, Reference, Scalar, Solution};
use crate::plan::tape::{Binary, Operation, Tape, Unary};
use crate::plan::{
    Axis, NUMERICS_VERSION, Normals, Output, OutputKind, Particles, Placement, Plan, Quantity, Side, Time,
    Walk,
};

fn axis(index: usize, low: f64, high: f64) -> Axis {
    Axis { index, low, high, low_side: Side::Reflect, high_side: Side::Reflect, bins: 1 }
}

fn plan(axes: Vec<Axis>, outputs: Vec<Output>) -> Plan {
    Plan {
        numerics: NUMERICS_VERSION,
        axes,
        walk: Walk { drift: vec![], spread: vec![], normals: Normals::Single },
        particles: Particles { count: 10, placement: Placement::Random, disorder: 0.0, volume: 1.0 },
        species: vec![],
        components: vec![],
        mixing: None,
        exchange: None,
        reactions: vec![],
        chemistry: None,
        transport: None,
        kernels: None,
        time: Time { step: 1.0, n_steps: 1, duration: 1.0 },
        outputs,
        writes_flow: false,
        stages: vec![],
        seed: 1,
    }
}

fn output(kind: OutputKind, quantities: Vec<Quantity>, bins: Vec<usize>, times: &[f64]) -> Output {
    Output { kind, quantities, bins, times: times.to_vec(), unit: None, station: None }
}

fn outcome() -> Outcome {
    Outcome {
        n_steps: 755,
        n_particles: 1000,
        mass_defect: vec![1e-14, 3e-14, 2e-14],
        labour: crate::chemistry::Work::default(),
        loop_wall: 1.0,
        wall: 1.5,
        cpu: 2.5,
        state_bytes: 0,
        flow: None,
    }
}

/// The tape of `x² + t`.
fn parabola() -> Tape {
    Tape {
        operations: vec![
            Operation::Input(0),
            Operation::Binary(Binary::Multiply, 0, 0),
            Operation::Input(3),
            Operation::Binary(Binary::Add, 1, 2),
        ],
    }
}

fn reference(name: &str, outputs: &[OutputKind], target: Quantity, solution: Solution) -> Reference {
    Reference { name: name.into(), outputs: outputs.to_vec(), target, number: 0, solution }
}

const A: Quantity = Quantity::Species(0);

/// Four bins on 0…2: the bin means of x² + t plus 0.1, the last bin empty.
fn parabola_run() -> (Plan, Vec<Snapshot>) {
    let plan = plan(
        vec![axis(0, 0.0, 2.0)],
        vec![
            output(OutputKind::Total, vec![A], vec![], &[1.0]),
            output(OutputKind::Profile, vec![Quantity::Species(1), A], vec![4], &[1.0, 3.0]),
        ],
    );
    // ∫ x² over a bin of width h around m is h (m² + h²/12).
    let means = |t: f64| [0.25, 0.75, 1.25, 1.75].map(|m| m * m + 0.25 / 12.0 + t + 0.1).to_vec();
    let snapshot = |t: f64| Snapshot {
        output_idx: 1,
        t,
        values: Values::Binned {
            mean: vec![vec![0.0; 4], means(t)],
            standard_error: vec![vec![0.0; 4], vec![0.02; 4]],
            n_particles: vec![5, 5, 5, 0],
        },
    };
    (plan, vec![snapshot(1.0), snapshot(3.0)])
}

fn parabola_evaluation(measures: Vec<Measure>) -> Evaluation {
    let kinds = [OutputKind::Profile, OutputKind::Map];
    Evaluation {
        references: vec![reference("parabola", &kinds, A, Solution::Expression(parabola()))],
        measures,
    }
}

fn measure(value: Scalar) -> Measure {
    Measure { name: "m".into(), value, over: None, times: None, unit: "1".into(), doc: None }
}

fn difference() -> Box<Field> {
    let found = Box::new(Field::Output(OutputKind::Profile, A));
    Box::new(Field::Binary(Binary::Subtract, found, Box::new(Field::Reference(0))))
}

fn measured(measure: Measure) -> Result<f64, String> {
    let (plan, snapshots) = parabola_run();
    evaluate(&plan, &parabola_evaluation(vec![measure]), &snapshots, &outcome())
        .map(|evaluated| evaluated.measures[0].value)
}

fn assert_close(value: f64, expected: f64) {
    // Sums of a few numbers near one: rounding only.
    assert!((value - expected).abs() <= 1e-13 * expected.abs().max(1.0), "{value} instead of {expected}");
}

#[test]
fn a_constant_offset_is_found_in_every_norm() {
    let (plan, snapshots) = parabola_run();
    let Evaluated { errors, curves, .. } =
        evaluate(&plan, &parabola_evaluation(vec![]), &snapshots, &outcome()).expect("well-formed");
    assert_eq!(errors.iter().map(|row| row.t).collect::<Vec<_>>(), [Some(1.0), Some(3.0), None]);
    let row = &errors[0];
    assert_eq!((row.n_bins, row.n_empty, row.output_idx), (3, 1, 1));
    // Offset 0.1 on three bins of width 0.5.
    assert_close(row.l1, 0.15);
    assert_close(row.l2, 0.1 * 1.5_f64.sqrt());
    assert_close(row.l_inf, 0.1);
    assert_close(row.rmse, 0.1);
    assert_close(row.noise.expect("profiles have standard errors"), 0.02 * 1.5_f64.sqrt());
    // ∫ x² + 1 over 0…1.5 = 1.125 + 1.5
    assert_close(row.l1_relative.expect("not zero"), 0.15 / 2.625);
    assert_close(errors[2].l1, 0.3);
    assert_close(errors[2].l2, 0.1 * 3.0_f64.sqrt());
    // The curve is drawn at edges and centres, point by point.
    assert_eq!(curves.len(), 2);
    assert_eq!(curves[0].x, [0.0, 0.25, 0.5, 0.75, 1.0, 1.25, 1.5, 1.75, 2.0]);
    assert_close(curves[1].y[8], 7.0);
}

#[test]
fn measures_combine_norms_and_facts() {
    let ratio = Scalar::Binary(
        Binary::Divide,
        Box::new(Scalar::Norm(Norm::L1, 1, difference())),
        Box::new(Scalar::Norm(Norm::L1, 1, Box::new(Field::Reference(0)))),
    );
    // The last bin is empty for the reference, too: ∫ x² + 1 and ∫ x² + 3 over 0…1.5.
    assert_close(measured(measure(ratio)).expect("fits"), 0.3 / (2.625 + 5.625));
    let norm = |norm| measured(measure(Scalar::Norm(norm, 1, difference()))).expect("fits");
    assert_close(norm(Norm::Integral), 0.15);
    assert_close(norm(Norm::Mean), 0.1);
    assert_close(norm(Norm::Maximum), 0.1);
    assert_close(norm(Norm::Minimum), 0.1);
    assert_close(norm(Norm::Rmse), 0.1);
    let fact = |fact| measured(measure(Scalar::Fact(fact))).expect("known");
    assert_eq!(
        [
            fact(Fact::WallTime),
            fact(Fact::CpuTime),
            fact(Fact::MassDefect),
            fact(Fact::Particles),
            fact(Fact::Steps)
        ],
        [1.5, 2.5, 3e-14, 1000.0, 755.0]
    );
    let negated = Scalar::Unary(Unary::Negate, Box::new(Scalar::Number(2.0)));
    assert_eq!(measured(measure(negated)), Ok(-2.0));
}

#[test]
fn measures_restrict_space_and_time() {
    let within = Measure {
        over: Some((0, 0.5, 1.0)),
        times: Some(vec![3.0]),
        ..measure(Scalar::Norm(Norm::L1, 1, Box::new(Field::Output(OutputKind::Profile, A))))
    };
    // One bin, centre 0.75, at 3 s.
    assert_close(measured(within).expect("fits"), 0.5 * (0.75 * 0.75 + 0.25 / 12.0 + 3.1));
    let axis_left_out =
        Measure { over: Some((1, 5.0, 6.0)), ..measure(Scalar::Norm(Norm::L1, 1, difference())) };
    assert_close(measured(axis_left_out).expect("fits"), 0.3);
}

#[test]
fn measures_that_cannot_be_had_say_why() {
    let no_such_time = Measure { times: Some(vec![2.0]), ..measure(Scalar::Norm(Norm::L1, 1, difference())) };
    let no_such_output = measure(Scalar::Norm(Norm::L1, 2, Box::new(Field::Number(1.0))));
    let other_species = measure(Scalar::Norm(
        Norm::L1,
        1,
        Box::new(Field::Output(OutputKind::Profile, Quantity::Species(7))),
    ));
    let mixed = Field::Binary(
        Binary::Add,
        Box::new(Field::Output(OutputKind::Profile, A)),
        Box::new(Field::Output(OutputKind::Total, A)),
    );
    for wrong in
        [no_such_time, no_such_output, other_species, measure(Scalar::Norm(Norm::L2, 1, Box::new(mixed)))]
    {
        let sentence = measured(wrong).expect_err("cannot be had");
        assert!(
            sentence.starts_with("The measure `m` has no value: ") && sentence.ends_with('.'),
            "{sentence}"
        );
    }
}

#[test]
fn a_map_is_averaged_over_its_cells() {
    // x² z² on 2 × 3 cells of the plane x, z: the mean over a cell is a product of bin means.
    let tape = Tape {
        operations: vec![
            Operation::Input(0),
            Operation::Input(2),
            Operation::Binary(Binary::Multiply, 0, 1),
            Operation::Binary(Binary::Multiply, 2, 2),
        ],
    };
    let plan = plan(
        vec![axis(0, 0.0, 2.0), axis(2, 0.0, 3.0)],
        vec![output(OutputKind::Map, vec![A], vec![2, 3], &[0.0])],
    );
    let mean_of_square = |low: f64| low * low + low + 1.0 / 3.0;
    let mean: Vec<f64> = (0..6)
        .map(|bin| mean_of_square(f64::from(bin / 3)) * mean_of_square(f64::from(bin % 3)) - 0.5)
        .collect();
    let values =
        Values::Binned { mean: vec![mean], standard_error: vec![vec![0.0; 6]], n_particles: vec![1; 6] };
    let evaluation = Evaluation {
        references: vec![reference("product", &[OutputKind::Map], A, Solution::Expression(tape))],
        measures: vec![],
    };
    let snapshots = [Snapshot { output_idx: 0, t: 0.0, values }];
    let evaluated = evaluate(&plan, &evaluation, &snapshots, &outcome()).expect("well-formed");
    assert_close(evaluated.errors[0].l_inf, 0.5);
    assert_close(evaluated.errors[0].l1, 3.0);
    assert!(evaluated.curves.is_empty());
}

#[test]
fn gamma_and_totals_are_compared_over_time() {
    let pair = Quantity::Pair(0, 1);
    let plan =
        plan(vec![axis(0, -1.0, 1.0)], vec![output(OutputKind::Mixing, vec![pair], vec![], &[0.0, 100.0])]);
    let snapshot = |t: f64, gamma: f64| Snapshot {
        output_idx: 0,
        t,
        values: Values::Mixing(vec![MixingState { m: 1.0, m_mean: 1.0, m_cov: 0.0, gamma }]),
    };
    let solution = Solution::Catalogue { name: "front_gamma".into(), arguments: vec![0.5, 0.01] };
    let evaluation = Evaluation {
        // The pair in the other order is the same pair.
        references: vec![reference("gamma", &[OutputKind::Mixing], Quantity::Pair(1, 0), solution)],
        measures: vec![],
    };
    let snapshots = [snapshot(0.0, -0.25), snapshot(100.0, 0.0)];
    let evaluated = evaluate(&plan, &evaluation, &snapshots, &outcome()).expect("well-formed");
    // γ(χt = 1) = −η² F(1), F(1) = 0.5380795069127684 (mpmath).
    assert_eq!(evaluated.errors.len(), 1);
    assert_close(evaluated.errors[0].l_inf, 0.25 * 0.538_079_506_912_768_4);
    assert_eq!((evaluated.errors[0].n_bins, evaluated.errors[0].noise), (2, None));
    assert_eq!((evaluated.curves[0].t, &evaluated.curves[0].x[..]), (None, &[0.0, 100.0][..]));
}

#[test]
fn a_zero_reference_has_no_relative_error() {
    let (plan, snapshots) = parabola_run();
    let zero = Tape { operations: vec![Operation::Constant(0.0)] };
    let evaluation = Evaluation {
        references: vec![reference("zero", &[OutputKind::Profile], A, Solution::Expression(zero))],
        measures: vec![],
    };
    let evaluated = evaluate(&plan, &evaluation, &snapshots, &outcome()).expect("well-formed");
    let row = &evaluated.errors[0];
    assert!(row.l2 > 0.0);
    assert_eq!((row.l1_relative, row.l2_relative, row.l_inf_relative), (None, None, None));
}

#[test]
fn a_reference_with_wrong_arguments_is_refused_with_a_sentence() {
    let (plan, snapshots) = parabola_run();
    for (name, arguments) in [("nowhere", vec![]), ("step_front", vec![1.0]), ("front_gamma", vec![2.0, 1.0])]
    {
        let solution = Solution::Catalogue { name: name.into(), arguments };
        let evaluation = Evaluation {
            references: vec![reference("r", &[OutputKind::Profile], A, solution)],
            measures: vec![],
        };
        let sentence = evaluate(&plan, &evaluation, &snapshots, &outcome()).expect_err("wrong");
        assert!(sentence.ends_with('.'), "{sentence}");
    }
}

/// Through any number of names; the clock of one leaves the others alone.
#[test]
fn what_names_a_timed_measure_is_timed() {
    let of = |value| measure(value);
    let sum = |a, b| Scalar::Binary(Binary::Add, Box::new(Scalar::Measure(a)), Box::new(Scalar::Measure(b)));
    let evaluation = parabola_evaluation(vec![
        of(sum(1, 2)),
        of(Scalar::Unary(Unary::Abs, Box::new(Scalar::Measure(3)))),
        of(Scalar::Fact(Fact::SubSteps)),
        of(Scalar::Fact(Fact::CpuTime)),
        of(sum(2, 2)),
    ]);
    assert_eq!(evaluation.is_timed(), [true, true, false, true, false]);
}

/// No scene has these, but a file that someone has changed may.
#[test]
fn a_measure_that_names_itself_or_none_is_refused() {
    let (plan, snapshots) = parabola_run();
    for wrong in
        [vec![Scalar::Measure(0)], vec![Scalar::Measure(1), Scalar::Measure(0)], vec![Scalar::Measure(7)]]
    {
        let evaluation = parabola_evaluation(wrong.into_iter().map(measure).collect());
        let found = evaluate(&plan, &evaluation, &snapshots, &outcome());
        assert!(found.is_err_and(|reason| reason.contains("names a measure")));
    }
}
