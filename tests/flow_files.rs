//! Flow fields as other programs write them: NumPy, pandas, polars, DuckDB and flopy.
//!
//! Needs `LAMELLA_PYTHON`, a Python with the packages of `tests/python/requirements.txt`.

use lamella::flow::read::modflow6::{self, Files, Period, Series, Settings};
use lamella::flow::read::table::{self, Column, Layout, Rows};
use lamella::flow::read::{Quantity, csv, npy, parquet};
use lamella::flow::{Cells, FaceFlow};
use serde_json::Value;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::LazyLock;

/// The folder that the script fills, once for all tests.
fn written() -> Option<&'static Path> {
    static FOLDER: LazyLock<Option<PathBuf>> = LazyLock::new(write);
    FOLDER.as_deref()
}

#[allow(clippy::print_stderr)] // Whoever runs the tests must see that this one checked nothing.
fn write() -> Option<PathBuf> {
    let Some(python) = std::env::var_os("LAMELLA_PYTHON") else {
        let is_owed = ["CI", "LAMELLA_REQUIRE_PYTHON"].iter().any(|name| std::env::var_os(name).is_some());
        assert!(!is_owed, "LAMELLA_PYTHON is not set, so the files of other programs were not tried");
        eprintln!("NOT CHECKED: LAMELLA_PYTHON is not set; the flow fields of other programs were not tried");
        return None;
    };
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("flow_files");
    std::fs::create_dir_all(&folder).unwrap();
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/python/flow_files.py");
    let output = Command::new(python).arg(script).arg(&folder).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    Some(folder)
}

const DAY: f64 = 86_400.0;
const FOOT: f64 = 0.3048;

fn settings() -> Settings<'static> {
    Settings { length: 1.0, time: 1.0, porosity: &|_, _| 0.25, sides: &[] }
}

fn series(folder: &Path, grid: &str, settings: &Settings) -> Series {
    let read = |name: &str| std::fs::read(folder.join(name)).unwrap();
    let (grid, budget, heads) = (read(grid), read("model.bud"), read("model.hds"));
    modflow6::read(Files { grid: &grid, budget: &budget, heads: Some(&heads) }, settings).unwrap()
}

fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().unwrap().iter().map(|number| number.as_f64().unwrap()).collect()
}

/// Our cell of each of MODFLOW's, found by where flopy says that its middle is.
fn cells_by_place(series: &Series, expected: &Value) -> Vec<[usize; 3]> {
    let [x, y, z] = ["x", "y", "z"].map(|name| numbers(&expected[name]));
    let (sin, cos) = series.rotation.to_radians().sin_cos();
    let edges = series.periods[0].flow.cells.edges();
    let along = |axis: usize, at: f64| {
        let cell = edges[axis].iter().position(|&edge| edge > at).unwrap() - 1;
        let middle = 0.5 * (edges[axis][cell] + edges[axis][cell + 1]);
        assert!((middle - at).abs() < 1e-9, "{middle} {at}");
        cell
    };
    (0..x.len())
        .map(|cell| {
            let (dx, dy) = (x[cell] - series.origin[0], y[cell] - series.origin[1]);
            [along(0, dx * cos + dy * sin), along(1, dy * cos - dx * sin), along(2, z[cell])]
        })
        .collect()
}

fn assert_near(found: f64, expected: f64, what: &str) {
    assert!((found - expected).abs() <= 1e-12 * expected.abs().max(1e-9), "{what}: {found}, {expected}");
}

#[test]
fn modflow_flows_are_those_that_flopy_finds() {
    let Some(folder) = written() else { return };
    let text = std::fs::read_to_string(folder.join("expected.json")).unwrap();
    let expected: Value = serde_json::from_str(&text).unwrap();
    let series = series(folder, "model.dis.grb", &settings());
    assert_eq!((series.origin, series.rotation), ([1000.0, 2000.0], 30.0));
    let places = cells_by_place(&series, &expected);
    let ends: Vec<f64> = series.periods.iter().map(|period| period.end).collect();
    assert_eq!(ends, numbers(&expected["times"]));
    assert_eq!((series.periods[0].start, series.periods[1].start), (0.0, 10.0));
    assert_eq!((series.periods[0].has_gap, series.periods[1].has_gap), (false, true));
    let (domain, saturation) = (numbers(&expected["idomain"]), numbers(&expected["saturation"]));
    for (period, step) in series.periods.iter().zip(expected["steps"].as_array().unwrap()) {
        check_faces(&period.flow, step, &places);
        check_packages(period, step, &places);
        for (cell, head) in numbers(&step["heads"]).into_iter().enumerate() {
            let own = period.flow.cells.cell(places[cell]);
            let porosity = if domain[cell] > 0.0 { 0.25 * saturation[cell] } else { 0.0 };
            // JSON is read to the last digit but one.
            assert_near(period.flow.porosity[own], porosity, "porosity");
            let found = period.flow.head.as_ref().unwrap()[own];
            if domain[cell] > 0.0 {
                assert_near(found, head, "head");
            } else {
                assert!(found.is_nan());
            }
        }
        let balance = period.flow.balance();
        assert!(balance.worst_of_through_flow < 1e-12, "{balance:?}");
    }
}

/// Flows that flopy finds at the eastern, southern and lower face of each cell.
fn check_faces(flow: &FaceFlow, step: &Value, places: &[[usize; 3]]) {
    let [right, front, lower] = ["right", "front", "lower"].map(|name| numbers(&step[name]));
    let n = flow.cells.n();
    for (cell, &place) in places.iter().enumerate() {
        let through = |axis: usize, is_upper: bool| {
            let (low, high) = flow.cells.faces(axis, place);
            flow.flux[axis][if is_upper { high } else { low }] * flow.cells.face_area(axis, place)
        };
        // Outer faces carry what packages bring, which flopy does not look at here.
        if place[0] + 1 < n[0] {
            assert_near(through(0, true), right[cell], "east");
        }
        if place[1] > 0 {
            assert_near(through(1, false), -front[cell], "south");
        }
        if place[2] > 0 {
            assert_near(through(2, false), -lower[cell], "below");
        }
    }
    assert!(right.iter().chain(&front).chain(&lower).filter(|flow| flow.abs() > 1e-6).count() > 90);
}

fn check_packages(period: &Period, step: &Value, places: &[[usize; 3]]) {
    let flow = &period.flow;
    let package = |kind: &str| period.packages.iter().find(|package| package.kind == kind).unwrap();
    let names: Vec<_> = period.packages.iter().map(|package| package.name.as_str()).collect();
    assert_eq!(names, ["", "PUMP", "RAIN", "SIDES"]);
    let rows = |kind: &str| -> Vec<(usize, f64)> {
        let row = |row: &Value| (row[0].as_u64().unwrap() as usize, row[1].as_f64().unwrap());
        step[kind].as_array().unwrap().iter().map(row).collect()
    };
    let [(well, rate)] = rows("WEL")[..] else { panic!("one well") };
    let [sink] = flow.sinks[package("WEL").sinks.clone()] else { panic!("one well") };
    assert_eq!((sink.cell, sink.rate, sink.owner), (flow.cells.cell(places[well]), -rate, 1));
    assert!(package("STO-SS").sinks.is_empty() && package("RCH").sinks.is_empty());
    for (cell, rate) in rows("RCH") {
        let (_, top) = flow.cells.faces(2, places[cell]);
        assert_near(flow.flux[2][top] * flow.cells.face_area(2, places[cell]), -rate, "top");
    }
    let mut in_sides = 0.0;
    for (cell, rate) in rows("CHD") {
        let (low, high) = flow.cells.faces(0, places[cell]);
        let area = flow.cells.face_area(0, places[cell]);
        let is_west = places[cell][0] == 0;
        let found = if is_west { flow.flux[0][low] } else { -flow.flux[0][high] };
        assert_near(found * area, rate, "side");
        in_sides += rate;
    }
    assert_near(package("CHD").through_faces, in_sides, "sides");
}

#[test]
fn units_of_a_model_scale_its_flow() {
    let Some(folder) = written() else { return };
    let plain = series(folder, "model.dis.grb", &settings());
    let scaled = Settings { length: FOOT, time: DAY, ..settings() };
    let scaled = series(folder, "model_crs.dis.grb", &scaled);
    let (plain, scaled) = (&plain.periods[1], &scaled.periods[1]);
    assert_eq!(scaled.end, plain.end * DAY);
    for axis in 0..3 {
        for (scaled, plain) in scaled.flow.flux[axis].iter().zip(&plain.flow.flux[axis]) {
            assert_near(*scaled, plain * FOOT / DAY, "specific discharge");
        }
    }
    assert_near(scaled.flow.sinks[0].rate, plain.flow.sinks[0].rate * FOOT.powi(3) / DAY, "well");
    assert_near(scaled.flow.through_flow(), plain.flow.through_flow() * FOOT.powi(3) / DAY, "all");
}

fn frame() -> npy::Frame<'static> {
    npy::Frame {
        low: [0.0; 3],
        high: [2.0, 1.5, 1.0],
        axes: 2,
        factor: 1.0,
        quantity: Quantity::Discharge,
        porosity: &|_, _| 0.25,
    }
}

/// q = (x + 2 y, 3 - 2 x) has the same value at a face's middle, and no straight line through middles of
/// cells turns around.
fn check_field(flow: &FaceFlow, tolerance: f64, what: &str) {
    let cells = Cells::equal([0.0; 3], [2.0, 1.5, 1.0], [4, 3, 1]).unwrap();
    for (own, expected) in flow.cells.edges().iter().flatten().zip(cells.edges().iter().flatten()) {
        assert!((own - expected).abs() < 1e-12, "{what}");
    }
    for cell in 0..cells.n_cells() {
        let place = cells.place(cell);
        let [x, y, _] = cells.centre(place);
        let near = |axis: usize, face: usize, expected: f64| {
            let found = flow.flux[axis][face];
            assert!((found - expected).abs() < tolerance, "{what}: {found}, {expected}");
        };
        let (low, high) = cells.faces(0, place);
        near(0, low, x - 0.25 + 2.0 * y);
        near(0, high, x + 0.25 + 2.0 * y);
        let (low, high) = cells.faces(1, place);
        near(1, low, 3.0 - 2.0 * x);
        near(1, high, 3.0 - 2.0 * x);
    }
}

#[test]
fn one_field_in_every_form() {
    let Some(folder) = written() else { return };
    let read = |name: &str| std::fs::read(folder.join(name)).unwrap();
    for (name, tolerance) in [
        ("c_f8.npy", 1e-13),
        ("f_f8.npy", 1e-13),
        ("c_big.npy", 1e-13),
        ("f_f4.npy", 1e-6),
        ("version_2.npy", 1e-6),
        ("version_3.npy", 1e-6),
    ] {
        let flow = npy::centred(&npy::array(&read(name)).unwrap(), &frame()).unwrap();
        check_field(&flow, tolerance, name);
    }
    let columns = |names: [&str; 2]| names.map(|name| Column::new(name, 1.0)).to_vec();
    let rows = Rows::Centres { q: columns(["qx", "qy"]), quantity: Quantity::Discharge };
    let at = columns(["x", "y"]);
    let layout = Layout { at, rows, porosity: None, head: None, conductivity: None };
    let frame = table::Frame { bounds: None, porosity: &|_, _| 0.25 };
    for name in ["pandas.csv", "polars.csv", "duckdb.csv"] {
        check_field(&csv::flow(&read(name), &layout, &frame).unwrap(), 1e-13, name);
    }
    for name in ["pandas.parquet", "polars.parquet", "duckdb.parquet"] {
        check_field(&parquet::flow(read(name), &layout, &frame).unwrap(), 1e-13, name);
    }
}
