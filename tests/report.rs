//! The report of a folder: numbers against closed forms, one page that needs nothing else.

// Snapshots and errors are for the tests of tables.
#[allow(dead_code)]
mod common;

use lamella::engine::snapshot::{MixingState, Snapshot, Values};
use lamella::plan::{OutputKind, Plan, Quantity};
use lamella::report::{
    ExpectationOutcome, ExpectedOrder, Page, SWEEP_VERSION, SweepAxis, SweepDescription, SweepExpectation,
    SweepReplicates, SweepReport, SweepReportKind, report,
};
use lamella::table::{Gatherer, PointRow, Record, Shape, Status, Value};
use std::collections::BTreeMap;
use std::path::Path;

const PARTICLES: [u64; 3] = [100, 1_000, 10_000];
const STEPS: [f64; 3] = [0.5, 1.0, 2.0];
/// Relative distances of the replicates from the mean: their mean is 0, their deviation 0.1.
const DISTANCES: [f64; 3] = [-0.1, 0.0, 0.1];
const N_BINS: usize = 40;

/// err = N^(−1/2) + b Δt; the cost is N / Δt microseconds.
struct Law {
    b: f64,
}

impl Law {
    fn error(&self, n: u64, step: f64) -> f64 {
        (n as f64).powf(-0.5) + self.b * step
    }
}

fn plan() -> Plan {
    let mut plan = common::plan();
    plan.axes.truncate(1);
    let output = |kind, quantity, bins: usize, times: &[f64]| lamella::plan::Output {
        kind,
        quantities: vec![quantity],
        bins: if bins > 0 { vec![bins] } else { Vec::new() },
        times: times.to_vec(),
        unit: None,
        station: None,
    };
    let times = [2.0, 4.0, 8.0, 16.0];
    plan.outputs = vec![
        output(OutputKind::Profile, Quantity::Species(0), N_BINS, &times[2..]),
        output(OutputKind::Total, Quantity::Species(1), 0, &times),
        output(OutputKind::Mixing, Quantity::Pair(0, 1), N_BINS, &times),
    ];
    plan
}

fn record() -> Record {
    Record {
        n_axes: 1,
        scene_text: "lamella 1\ntitle \"<script>alert(1)</script> & more\"\n".to_owned(),
        title: Some("A law <made up>".to_owned()),
        plan_yaml: "document: 2\nleft_out:\n- what: neighbour search\n  why: no kernel\n".to_owned(),
        ..common::record()
    }
}

fn concentration(bin: usize, t: f64) -> f64 {
    1.0 + 0.1 * bin as f64 + t
}

fn snapshots(distance: f64) -> Vec<Snapshot> {
    let factor = 1.0 + distance;
    let mut list = Vec::new();
    for t in [2.0, 4.0, 8.0, 16.0] {
        if t > 4.0 {
            let mean = (0..N_BINS).map(|bin| concentration(bin, t) * factor).collect();
            let (standard_error, n_particles) = (vec![vec![0.01; N_BINS]], vec![9; N_BINS]);
            let values = Values::Binned { mean: vec![mean], standard_error, n_particles };
            list.push(Snapshot { output_idx: 0, t, values });
        }
        let values = Values::Total { amount: vec![2.0 * t * factor] };
        list.push(Snapshot { output_idx: 1, t, values });
        let state = MixingState { m: 1.5, m_mean: 1.0, m_cov: 0.5, gamma: factor / (t * t) };
        list.push(Snapshot { output_idx: 2, t, values: Values::Mixing(vec![state]) });
    }
    list
}

fn row(law: &Law, point: u32, replicate: u32, n: u64, step: f64) -> PointRow {
    let error = law.error(n, step) * (1.0 + DISTANCES[replicate as usize]);
    PointRow {
        point,
        replicate,
        swept: Vec::new(),
        seed: u64::from(point) << 40,
        particles: n,
        step,
        wall: n as f64 / step * 1e-6,
        cpu: n as f64 / step * 1e-6,
        mass_defect: Some(1e-16 * f64::from(1 + point + replicate)),
        values: vec![Value { name: "err".to_owned(), unit: "1".to_owned(), value: Some(error) }],
        ..common::point()
    }
}

fn axis(name: &str, unit: &str, values: &[f64], group: u32) -> SweepAxis {
    let (name, unit, values) = (name.to_owned(), unit.to_owned(), values.to_vec());
    SweepAxis { column: name.clone(), name, unit, values, group }
}

fn description(n_points: u64) -> SweepDescription {
    let expectation = |text: &str, outcome, order| SweepExpectation {
        text: text.to_owned(),
        outcome,
        detail: String::new(),
        order,
    };
    let order =
        ExpectedOrder { measure: "err".to_owned(), axis: "particles".to_owned(), low: -0.6, high: -0.4 };
    let drawn = |kind, against: &[&str], by: &[&str]| SweepReport {
        kind,
        measure: "err".to_owned(),
        against: against.iter().map(|name| (*name).to_owned()).collect(),
        by: by.iter().map(|name| (*name).to_owned()).collect(),
    };
    SweepDescription {
        version: SWEEP_VERSION,
        name: "law".to_owned(),
        scene: "two_axes".to_owned(),
        axes: vec![axis("particles", "1", &PARTICLES.map(|n| n as f64), 0), axis("step", "s", &STEPS, 1)],
        n_points,
        n_skipped: 2,
        replicates: SweepReplicates { least: 3, most: 3 },
        seed: 20_260_114,
        has_common_random_numbers: false,
        reports: vec![
            drawn(SweepReportKind::WorkPrecision, &["wall_time"], &["step"]),
            drawn(SweepReportKind::Convergence, &["particles", "step"], &[]),
        ],
        expectations: vec![
            expectation("order(err, particles) in -0.6 .. -0.4", ExpectationOutcome::Met, Some(order)),
            expectation("leak < 1e-16", ExpectationOutcome::NotMet, None),
        ],
    }
}

/// Number, particles and step of each point, the first axis slowest.
fn points() -> Vec<(u32, u64, f64)> {
    let pairs = PARTICLES.into_iter().flat_map(|n| STEPS.map(|step| (n, step)));
    pairs.enumerate().map(|(point, (n, step))| (point as u32, n, step)).collect()
}

/// Writes the sweep of a law; replicate 2 of point 8 fails if asked for.
fn write(folder: &Path, law: &Law, has_failure: bool) {
    let rows: Vec<PointRow> = points()
        .into_iter()
        .flat_map(|(point, n, step)| (0..3).map(move |replicate| (point, replicate, n, step)))
        .map(|(point, replicate, n, step)| row(law, point, replicate, n, step))
        .collect();
    let plan = plan();
    let mut gatherer = Gatherer::create(folder, &plan, &record(), Shape::of(&rows)).unwrap();
    for mut row in rows {
        if has_failure && (row.point, row.replicate) == (8, 2) {
            row.status = Status::Failed;
            row.error_code = Some("R102".to_owned());
            row.error_message = Some("step 7: concentration of <A> is \u{1b}[31m−3".to_owned());
            row.values.clear();
            row.mass_defect = None;
            // As of a point that was refused before it ran anywhere.
            (row.key, row.host, row.started, row.finished) = (String::new(), String::new(), 0, 0);
            gatherer.add(&plan, row, &[], Vec::new()).unwrap();
        } else {
            let taken = snapshots(DISTANCES[row.replicate as usize]);
            gatherer.add(&plan, row, &taken, Vec::new()).unwrap();
        }
    }
    let text = description(9).to_json().unwrap();
    gatherer.finish(&[("sweep.json", &text)]).unwrap();
}

fn page_of(law: &Law, has_failure: bool) -> Page {
    let folder = tempfile::tempdir().unwrap();
    write(folder.path(), law, has_failure);
    if let Some(kept) = std::env::var_os("LAMELLA_KEEP_REPORT") {
        write(Path::new(&kept), law, has_failure);
    }
    report(folder.path()).unwrap()
}

/// Rows of a CSV file by the names of their columns; no text here has a comma in quotes.
fn csv(page: &Page, name: &str) -> Vec<BTreeMap<String, String>> {
    let text = &page.files.iter().find(|(other, _)| other == name).unwrap_or_else(|| panic!("{name}")).1;
    let mut lines = text.lines();
    let heads: Vec<&str> = lines.next().unwrap().split(',').collect();
    let row = |line: &str| -> BTreeMap<String, String> {
        heads.iter().map(|head| (*head).to_owned()).zip(line.split(',').map(str::to_owned)).collect()
    };
    lines.map(row).collect()
}

fn number(row: &BTreeMap<String, String>, column: &str) -> f64 {
    row[column].parse().unwrap_or_else(|_| panic!("{column}: {row:?}"))
}

fn assert_near(found: f64, expected: f64, what: &str) {
    assert!((found - expected).abs() <= 1e-12 * expected.abs().max(1e-3), "{what}: {found}, not {expected}");
}

/// Without the term in Δt the law is a power law: its order is −1/2 and the interval has no width.
#[test]
fn a_power_law_has_its_order() {
    let page = page_of(&Law { b: 0.0 }, false);
    let rows = csv(&page, "orders-err-particles.csv");
    assert_eq!(rows.len(), STEPS.len() + 1);
    for row in &rows {
        for column in ["order", "order_low", "order_high"] {
            assert_near(number(row, column), -0.5, column);
        }
        assert_eq!((number(row, "expected_low"), number(row, "expected_high")), (-0.6, -0.4));
    }
    assert_eq!(number(&rows[3], "points"), 9.0);
    let flat = csv(&page, "orders-err-step.csv");
    assert!(number(&flat[3], "order").abs() < 1e-12, "the law does not depend on the step");
    assert!(page.html.contains("its interval lies in the expected −0.6 … −0.4"), "the verdict");
}

/// At three places at equal distances h the slope is (y₃ − y₁) / 2h and Σ r² = (y₁ − 2 y₂ + y₃)² / 6; the
/// common slope is the mean of the three, and Σ r² grows by 2h² (slope − common)² for each.
#[test]
fn orders_and_their_intervals_are_the_closed_forms() {
    let law = Law { b: 0.01 };
    let page = page_of(&law, false);
    let rows = csv(&page, "orders-err-particles.csv");
    let h = 10f64.ln();
    let t_one = (0.475 * std::f64::consts::PI).tan();
    // Quantile of Student's t for 0.975 and five degrees, from scipy.
    let t_five = 2.570_581_835_636_314;
    let (mut slopes, mut rss_all) = (Vec::new(), 0.0);
    for (row, step) in rows.iter().zip(STEPS) {
        let y = PARTICLES.map(|n| law.error(n, step).ln());
        let slope = (y[2] - y[0]) / (2.0 * h);
        let rss = (y[0] - 2.0 * y[1] + y[2]).powi(2) / 6.0;
        let half = t_one * (rss / (2.0 * h * h)).sqrt();
        assert_eq!(number(row, "step"), step);
        assert_near(number(row, "order"), slope, "order");
        assert_near(number(row, "order_low"), slope - half, "order_low");
        assert_near(number(row, "order_high"), slope + half, "order_high");
        slopes.push(slope);
        rss_all += rss;
    }
    let common = slopes.iter().sum::<f64>() / 3.0;
    rss_all += slopes.iter().map(|slope| (slope - common).powi(2) * 2.0 * h * h).sum::<f64>();
    let half = t_five * (rss_all / 5.0 / (3.0 * 2.0 * h * h)).sqrt();
    assert_eq!(rows[3]["series"], "all");
    assert_near(number(&rows[3], "order"), common, "common order");
    assert_near(number(&rows[3], "order_low"), common - half, "low end of the common order");
    assert_near(number(&rows[3], "order_high"), common + half, "high end of the common order");
}

#[test]
fn means_and_deviations_are_those_of_the_replicates() {
    let law = Law { b: 0.01 };
    let page = page_of(&law, true);
    let rows = csv(&page, "convergence-err-particles.csv");
    assert_eq!(rows.len(), 9);
    for row in &rows {
        let error = law.error(number(row, "particles") as u64, number(row, "step"));
        let (n, mean, deviation) = if number(row, "point") == 8.0 {
            // Of −0.1 and 0: mean −0.05, deviation 0.1 / √2.
            (2.0, 0.95 * error, 0.1 * error / 2f64.sqrt())
        } else {
            (3.0, error, 0.1 * error)
        };
        assert_eq!(number(row, "err.n"), n);
        assert_near(number(row, "err.mean"), mean, "mean");
        assert_near(number(row, "err.standard_deviation"), deviation, "deviation");
        assert_near(number(row, "err.standard_error"), deviation / n.sqrt(), "standard error");
    }
    // Bands: the concentrations of the replicates have the deviation of their distances, too.
    let rows = csv(&page, "profile.csv");
    assert_eq!(rows.len(), 4 * N_BINS, "four points at their last time");
    for (idx, row) in rows.iter().filter(|row| row["point"] == "0").enumerate() {
        let expected = concentration(idx, 16.0);
        assert_eq!((row["time"].as_str(), row["unit"].as_str()), ("16", "mol/m^3"));
        assert_near(number(row, "place"), -0.075 + 0.15 * (idx as f64 + 0.5) / N_BINS as f64, "place");
        assert_near(number(row, "mean"), expected, "mean of the profile");
        assert_near(number(row, "standard_deviation"), 0.1 * expected, "deviation of the profile");
    }
    let total = &csv(&page, "total.csv")[2];
    assert_eq!((total["t"].as_str(), total["unit"].as_str()), ("8", "mol/m^2"));
    assert_near(number(total, "mean"), 16.0, "total");
}

/// A point is on the front if no other is at most as dear and at most as wrong.
#[test]
fn the_front_is_what_nothing_beats() {
    let law = Law { b: 0.2 };
    let page = page_of(&law, false);
    let values: Vec<(f64, f64)> =
        points().iter().map(|(_, n, step)| (*n as f64 / step * 1e-6, law.error(*n, *step))).collect();
    let is_beaten =
        |own: &(f64, f64)| values.iter().any(|other| other != own && other.0 <= own.0 && other.1 <= own.1);
    let mut n_front = 0;
    for row in csv(&page, "work_precision-err-wall_time.csv") {
        let own = &values[number(&row, "point") as usize];
        assert_near(number(&row, "wall_time.mean"), own.0, "cost");
        assert_near(number(&row, "err.mean"), own.1, "error");
        assert_eq!(row["is_pareto"], (!is_beaten(own)).to_string(), "{row:?}");
        n_front += u32::from(row["is_pareto"] == "true");
    }
    assert!((2..9).contains(&n_front), "{n_front}: the law has points on and off the front");
    assert!(page.html.contains(&format!("{n_front} of 9 points")), "the caption tells it");
}

#[test]
fn the_page_tells_everything_and_needs_nothing() {
    let page = page_of(&Law { b: 0.01 }, true);
    let html = &page.html;
    for text in [
        "<title>A law &lt;made up&gt;: sweep law</title>",
        "9 points with 3 replicates each: 27 runs, 26 done, 1 failed. 2 points were skipped by the scene.",
        "The worst mass defect is 10⁻¹⁵ (point 7, replicate 2).",
        "1 of 2 expectations are met, <strong>1 not</strong>.",
        "wall time (s)",
        "particles (–)",
        "step (s)",
        "err (–)",
        "concentration (mol/m³)",
        "amount (mol/m²)",
        "γ (–)",
        "expected order −0.6 … −0.4",
        "concentration of &lt;A&gt; is \u{fffd}[31m−3",
        "neighbour search",
        "no kernel",
        "a-machine",
        "<td>first started</td><td class=\"n\">2026-01-14 12:00:00 UTC</td>",
        "&lt;script&gt;alert(1)&lt;/script&gt; &amp; more",
        "doi:10.1021/es0157144",
        "20260114",
    ] {
        assert!(html.contains(text), "the page lacks: {text}");
    }
    assert!(html.contains(&"5f".repeat(32)), "the plan hash");
    let needs =
        ["<script", "<link", "<img", "@import", "url(", " src=", "href=\"http", "<iframe", "javascript:"];
    needs.iter().for_each(|text| assert!(!html.contains(text), "{text}"));
    let links = html.matches("http").count();
    assert_eq!(links, html.matches("xmlns=\"http://www.w3.org/2000/svg\"").count(), "only names of formats");
    assert!(html.len() < 5_000_000, "{} bytes", html.len());
    assert_balanced(html);
    assert_eq!(page, page_of(&Law { b: 0.01 }, true), "the same tables, the same bytes");
}

/// Every tag that is opened is closed in order.
fn assert_balanced(html: &str) {
    let mut open: Vec<&str> = Vec::new();
    for piece in html.split('<').skip(1) {
        let tag = piece.split('>').next().unwrap();
        let name = tag.trim_start_matches('/').split([' ', '\n', '/']).next().unwrap();
        if tag.starts_with('!') || name == "meta" || tag.ends_with('/') {
            continue;
        }
        if tag.starts_with('/') {
            assert_eq!(open.pop(), Some(name), "…{}", &piece[..piece.len().min(40)]);
        } else {
            open.push(name);
        }
    }
    assert!(open.is_empty(), "{open:?}");
}

/// Many points and long profiles: the page stays small, and what is not drawn stands in the files.
#[test]
fn a_large_sweep_has_a_small_page() {
    let folder = tempfile::tempdir().unwrap();
    let law = Law { b: 0.01 };
    let plan = plan();
    let n_points = 1500;
    let rows = |point: u32| (0..2).map(move |replicate| (point, replicate));
    let all = (0..n_points).flat_map(rows).map(|(point, replicate)| {
        row(&Law { b: 0.01 }, point, replicate, 100 + 10 * u64::from(point / 30), 0.5 + f64::from(point % 30))
    });
    let all: Vec<PointRow> = all.collect();
    let mut gatherer = Gatherer::create(folder.path(), &plan, &record(), Shape::of(&all)).unwrap();
    for row in all {
        let taken = snapshots(DISTANCES[row.replicate as usize]);
        gatherer.add(&plan, row, &taken, Vec::new()).unwrap();
    }
    let text = description(u64::from(n_points)).to_json().unwrap();
    gatherer.finish(&[("sweep.json", &text)]).unwrap();
    let page = report(folder.path()).unwrap();
    assert!(page.html.len() < 5_000_000, "{} bytes", page.html.len());
    assert_balanced(&page.html);
    assert_eq!(csv(&page, "work_precision-err-wall_time.csv").len(), n_points as usize);
    let replicates = csv(&page, "profile.csv").iter().map(|row| number(row, "n")).collect::<Vec<_>>();
    assert_eq!(replicates, vec![2.0; 4 * N_BINS], "points of several row groups");
    let rows = csv(&page, "orders-err-particles.csv");
    assert_eq!(rows.len(), 31);
    let expected: Vec<f64> = (0..30).map(|k| 0.5 + f64::from(k)).collect();
    assert_eq!(rows[..30].iter().map(|row| number(row, "step")).collect::<Vec<_>>(), expected);
    assert!(number(&rows[0], "order") < number(&rows[29], "order"), "{}", law.b);
}

fn lamella(arguments: &[&str], folder: &Path) -> std::process::Output {
    let program = env!("CARGO_BIN_EXE_lamella");
    std::process::Command::new(program).args(arguments).current_dir(folder).output().unwrap()
}

/// A run of its own, from the command line: measures, errors, profiles at their times, provenance.
#[test]
fn a_single_run_has_a_report_too() {
    let folder = tempfile::tempdir().unwrap();
    let scene = include_str!("scenes/gramling_column.lam").replace("1_000_000", "20_000");
    std::fs::write(folder.path().join("column.lam"), scene).unwrap();
    let run = lamella(&["run", "column.lam", "--threads", "1"], folder.path());
    assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
    let made = lamella(&["report", "results/column"], folder.path());
    let told = String::from_utf8_lossy(&made.stdout);
    assert!(made.status.success(), "{}", String::from_utf8_lossy(&made.stderr));
    assert!(told.contains("results/column/report.html"), "{told}");
    let html = std::fs::read_to_string(folder.path().join("results/column/report.html")).unwrap();
    assert!(html.contains("One run, done."), "{html:.2000}");
    for id in ["errors", "results", "mass", "left-out", "provenance"] {
        assert!(html.contains(&format!("<section id=\"{id}\">")), "{id}");
    }
    assert_balanced(&html);
    assert!(folder.path().join("results/column/report/profile.csv").is_file());

    // A file of the user's own stays, numbers of an earlier report go.
    let beside = folder.path().join("results/column/report");
    std::fs::write(beside.join("mine.csv"), "1").unwrap();
    std::fs::write(beside.join("convergence-old.csv"), "1").unwrap();
    assert!(lamella(&["report", "results/column"], folder.path()).status.success());
    assert!(beside.join("mine.csv").is_file() && !beside.join("convergence-old.csv").exists());
}

#[test]
fn what_holds_no_results_is_told_as_such() {
    let folder = tempfile::tempdir().unwrap();
    let none = lamella(&["report", "nowhere"], folder.path());
    let told = String::from_utf8_lossy(&none.stderr);
    assert_eq!(none.status.code(), Some(2), "{told}");
    assert!(told.contains("[F101]") && told.contains("points.parquet"), "{told}");

    write(folder.path(), &Law { b: 0.01 }, false);
    let total = folder.path().join("total/part-0000.parquet");
    let bytes = std::fs::read(&total).unwrap();
    std::fs::write(&total, &bytes[..bytes.len() - 9]).unwrap();
    let damaged = lamella(&["report", "."], folder.path());
    let told = String::from_utf8_lossy(&damaged.stderr);
    assert_eq!(damaged.status.code(), Some(1), "{told}");
    assert!(told.contains("total/part-0000.parquet"), "{told}");
    assert!(!folder.path().join("report.html").exists(), "no page from half of the tables");

    std::fs::write(&total, bytes).unwrap();
    std::fs::write(folder.path().join("sweep.json"), "{\"version\": 7}").unwrap();
    let later = lamella(&["report", "."], folder.path());
    assert_eq!(later.status.code(), Some(1));
    assert!(String::from_utf8_lossy(&later.stderr).contains("version 7"));
}

/// The scripts of docs/analysis over one sweep: each finds the common order and the largest mean
/// concentration of the closed forms. Needs `LAMELLA_PYTHON`, as the test of the tables does.
#[test]
#[allow(clippy::print_stderr)] // Whoever runs the tests must see that this one checked nothing.
fn scripts_of_other_tools_find_the_same_order() {
    let Some(python) = std::env::var_os("LAMELLA_PYTHON") else {
        let is_owed = ["CI", "LAMELLA_REQUIRE_PYTHON"].iter().any(|name| std::env::var_os(name).is_some());
        assert!(!is_owed, "LAMELLA_PYTHON is not set, so the scripts of docs/analysis were not tried");
        eprintln!("NOT CHECKED: LAMELLA_PYTHON is not set; the scripts of docs/analysis were not tried");
        return;
    };
    let parent = tempfile::tempdir().unwrap();
    let folder = parent.path().join("it's a sweep");
    let law = Law { b: 0.01 };
    write(&folder, &law, false);
    // sweep.json is what its published schema says.
    let judge = "import json,sys,jsonschema; s,d=[json.load(open(p)) for p in sys.argv[1:]]; jsonschema.validate(d,s)";
    let schema = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/schema/sweep-1.json");
    let mut check = std::process::Command::new(&python);
    let judged = check.args(["-c", judge]).arg(schema).arg(folder.join("sweep.json")).output().unwrap();
    assert!(judged.status.success(), "{}", String::from_utf8_lossy(&judged.stderr));
    let slope = |step: f64| (law.error(10_000, step) / law.error(100, step)).ln() / (2.0 * 10f64.ln());
    let order = STEPS.map(slope).iter().sum::<f64>() / 3.0;
    for script in ["with_pandas.py", "with_polars.py", "with_duckdb.py"] {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/analysis").join(script);
        let output = std::process::Command::new(&python).arg(path).arg(&folder).output().unwrap();
        let told = String::from_utf8_lossy(&output.stdout);
        assert!(output.status.success(), "{script}: {}", String::from_utf8_lossy(&output.stderr));
        let found = |what: &str| -> f64 {
            let line =
                told.lines().find_map(|line| line.strip_prefix(what)).unwrap_or_else(|| panic!("{told}"));
            line.trim_start_matches(": ").parse().unwrap()
        };
        // Twelve decimals are printed.
        assert!((found("order of err by particles") - order).abs() < 1e-12, "{script}: {told}");
        let largest = concentration(N_BINS - 1, 16.0);
        assert!((found("largest mean concentration of point 0") - largest).abs() < 1e-11, "{script}: {told}");
        assert!(told.contains("step in s, err in 1\n"), "{script}: {told}");
    }
}
