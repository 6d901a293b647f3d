//! What a run's folder promises: whole or absent, the same bytes every time, readable by others.

mod common;
#[path = "common/rows.rs"]
mod rows;

use arrow_array::Array;
use arrow_array::cast::AsArray;
use arrow_array::types::Float64Type;
use lamella::engine::snapshot::{Snapshot, Values};
use lamella::plan::{OutputKind, Plan, Quantity};
use lamella::table::{Summary, TableError, Writer, is_complete, read};
use rows::{with_rows, with_snapshots_of_rows};
use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

fn write(folder: &Path) -> Summary {
    write_plan(folder, &common::plan(), &common::snapshots())
}

fn write_plan(folder: &Path, plan: &Plan, snapshots: &[Snapshot]) -> Summary {
    let mut writer = Writer::create(folder, plan, &common::record()).unwrap();
    for snapshot in snapshots {
        writer.write(snapshot).unwrap();
    }
    writer.finish(vec![common::point()], &common::errors()).unwrap()
}

/// All files below a folder with their bytes.
fn files(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let mut found = BTreeMap::new();
    let mut open = vec![folder.to_path_buf()];
    while let Some(next) = open.pop() {
        for entry in fs::read_dir(next).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                open.push(path);
            } else {
                let name = path.strip_prefix(folder).unwrap().to_string_lossy().into_owned();
                found.insert(name, fs::read(&path).unwrap());
            }
        }
    }
    found
}

#[test]
fn a_run_has_the_published_layout() {
    let folder = tempfile::tempdir().unwrap();
    let summary = write(folder.path());
    let names: Vec<_> = files(folder.path()).into_keys().collect();
    let expected = [
        "columns.parquet",
        "covariance/part-0000.parquet",
        "errors/part-0000.parquet",
        "map/part-0000.parquet",
        "mixing/part-0000.parquet",
        "particles/part-0000.parquet",
        "plan.yaml",
        "points.parquet",
        "profile/part-0000.parquet",
        "scene.lam",
        "total/part-0000.parquet",
    ];
    assert_eq!(names, expected);
    let rows = |name: &str| summary.files.iter().find(|file| file.name.starts_with(name)).unwrap().n_rows;
    // Bins × species × times: 6 × 2 × 2 of the first output and 6 of the second.
    assert_eq!(rows("profile"), 30);
    assert_eq!((rows("map"), rows("covariance"), rows("total")), (12, 12, 6));
    assert_eq!((rows("mixing"), rows("particles"), rows("points"), rows("errors")), (2, 8, 1, 2));
    assert_eq!(fs::read_to_string(folder.path().join("scene.lam")).unwrap(), common::record().scene_source);
}

#[test]
fn data_files_do_not_depend_on_run_or_place() {
    let (first, second) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    let elsewhere = second.path().join("a much longer name/below");
    write(first.path());
    write(&elsewhere);
    let (mut first, mut second) = (files(first.path()), files(&elsewhere));
    // The one file with clock, host and threads.
    assert!(first.remove("points.parquet").is_some() && second.remove("points.parquet").is_some());
    assert_eq!(first.len(), 10);
    assert!(first == second);
}

#[test]
fn an_unfinished_run_leaves_the_earlier_one_untouched() {
    let folder = tempfile::tempdir().unwrap();
    write(folder.path());
    let before = files(folder.path());
    let mut writer = Writer::create(folder.path(), &common::plan(), &common::record()).unwrap();
    for snapshot in common::snapshots() {
        writer.write(&snapshot).unwrap();
    }
    assert!(files(folder.path()).len() > before.len(), "temporary files lie beside");
    drop(writer);
    assert!(files(folder.path()) == before);
}

#[test]
fn an_unfinished_first_run_leaves_nothing() {
    let parent = tempfile::tempdir().unwrap();
    let folder = parent.path().join("results");
    drop(Writer::create(&folder, &common::plan(), &common::record()).unwrap());
    assert!(!folder.exists());
}

#[test]
fn a_new_run_takes_away_what_it_does_not_replace_and_nothing_else() {
    let folder = tempfile::tempdir().unwrap();
    write(folder.path());
    fs::write(folder.path().join("map/notes.txt"), "mine").unwrap();
    fs::write(folder.path().join("total/.part-0000.parquet.tmp-1"), "of a killed run").unwrap();
    let mut plan = common::plan();
    plan.outputs.retain(|output| output.kind == OutputKind::Profile);
    let kept: Vec<_> = common::snapshots().into_iter().filter(|snapshot| snapshot.output_idx < 2).collect();
    write_plan(folder.path(), &plan, &kept);
    let names: Vec<_> = files(folder.path()).into_keys().collect();
    let expected = [
        "columns.parquet",
        "errors/part-0000.parquet",
        "map/notes.txt",
        "plan.yaml",
        "points.parquet",
        "profile/part-0000.parquet",
        "scene.lam",
    ];
    assert_eq!(names, expected);
    assert!(!folder.path().join("total").exists());
}

#[test]
fn two_runs_cannot_share_a_folder() {
    let folder = tempfile::tempdir().unwrap();
    let _first = Writer::create(folder.path(), &common::plan(), &common::record()).unwrap();
    let second = Writer::create(folder.path(), &common::plan(), &common::record());
    assert!(matches!(second.err(), Some(TableError::InUse { .. })));
}

#[test]
fn profiles_read_back_with_centres_units_and_nulls() {
    let folder = tempfile::tempdir().unwrap();
    write(folder.path());
    let rows = read::profile(&folder.path().join("profile/part-0000.parquet")).unwrap();
    let first: Vec<_> = rows.iter().take(6).collect();
    // Six bins over −7.5 … 7.5 cm: centres at ±1.25, ±3.75, ±6.25 cm. The averaged axis has none.
    let centres = [-0.0625, -0.0375, -0.0125, 0.0125, 0.0375, 0.0625];
    for (row, x) in first.iter().zip(centres) {
        assert!((row.position[0].unwrap() - x).abs() < 1e-17);
        assert_eq!((row.position[1], row.position[2]), (None, None));
        assert_eq!((row.species.as_str(), row.unit.as_str(), row.t), ("A", "mol/m^3", 10.0));
    }
    let values: Vec<_> = first.iter().map(|row| row.concentration).collect();
    assert_eq!(values, [Some(1.0), Some(2.0), None, Some(4.0), Some(5.0), Some(6.0)]);
    assert_eq!(first[3].standard_error, None, "one particle has no standard error");
    let milligrams: Vec<_> = rows.iter().filter(|row| row.output == 1).collect();
    assert_eq!(milligrams[0].unit, "mg/L");
    assert_eq!(milligrams[0].concentration, Some(1.0), "1e-3 kg/m³ is 1 mg/L");
}

#[test]
fn points_and_errors_read_back() {
    let folder = tempfile::tempdir().unwrap();
    write(folder.path());
    let points = read::points(&folder.path().join("points.parquet")).unwrap();
    let expected = common::point();
    assert_eq!(points.len(), 1);
    assert_eq!((points[0].seed, points[0].status, points[0].steps), (u64::MAX, expected.status, 10));
    let named: Vec<_> = points[0].values.iter().map(|value| (value.name.as_str(), value.value)).collect();
    let expected = [
        ("chi", Some(1e-3)),
        ("err", Some(0.125)),
        ("measure.host", Some(7.0)),
        ("limit.profile.A.l2", None),
    ];
    assert_eq!(named, expected);
    assert_eq!(points[0].values[1].unit, "mol/m^3");
    let errors = read::errors(&folder.path().join("errors/part-0000.parquet")).unwrap();
    assert_eq!(errors, common::errors());
}

#[test]
fn footers_tell_where_a_file_comes_from() {
    let folder = tempfile::tempdir().unwrap();
    write(folder.path());
    let (record, plan) = (common::record(), common::plan());
    for file in files(folder.path()).keys().filter(|name| name.ends_with(".parquet")) {
        let footer = read::footer(&folder.path().join(file)).unwrap();
        assert!(file.starts_with(&footer.table));
        assert_eq!(footer.plan.hash, record.plan_hash);
        assert_eq!((footer.scene.text, footer.seed), (record.scene_text.clone(), plan.seed));
        assert_eq!(footer.parameters[0].dimension, [2.0, 0.0, -1.0, 0.0, 0.0, 0.0, 0.0]);
        assert_eq!(footer.outputs[5].quantities, [["A", "B"]]);
    }
}

#[test]
fn no_part_of_a_file_counts_as_complete() {
    let folder = tempfile::tempdir().unwrap();
    write(folder.path());
    let path = folder.path().join("profile/part-0000.parquet");
    assert!(is_complete(&path));
    let bytes = fs::read(&path).unwrap();
    let cut = folder.path().join("cut.parquet");
    for n in (0..bytes.len()).step_by(97).chain([bytes.len() - 1]) {
        fs::write(&cut, &bytes[..n]).unwrap();
        assert!(!is_complete(&cut), "{n} of {} bytes", bytes.len());
    }
    assert!(!is_complete(&folder.path().join("absent.parquet")));
}

#[test]
fn more_rows_than_a_row_group_are_streamed() {
    let folder = tempfile::tempdir().unwrap();
    let mut plan = common::plan();
    plan.outputs.retain(|output| output.kind == OutputKind::Particles);
    let n = 300_000;
    let column = |scale: f64| -> Vec<f64> { (0..n).map(|p| f64::from(p) * scale).collect() };
    let particles = Values::Particles {
        positions: vec![column(1e-7), column(1e-8)],
        concentrations: vec![column(1e-3), column(2e-3)],
    };
    let summary = write_plan(folder.path(), &plan, &[Snapshot { output_idx: 0, t: 1.0, values: particles }]);
    assert_eq!(summary.files[0].n_rows, 600_000);
    let path = folder.path().join("particles/part-0000.parquet");
    let file = fs::File::open(path).unwrap();
    let reader = parquet::file::serialized_reader::SerializedFileReader::new(file).unwrap();
    use parquet::file::reader::FileReader;
    let groups = reader.metadata().row_groups();
    let rows: Vec<_> = groups.iter().map(|group| group.num_rows()).collect();
    assert_eq!(rows, [122_880, 122_880, 122_880, 122_880, 108_480]);
    assert!(groups.iter().all(|group| group.columns().iter().all(|column| column.statistics().is_some())));
    assert_eq!(reader.metadata().file_metadata().created_by(), Some("lamella version 1.0.0"));
}

#[test]
fn a_snapshot_that_does_not_fit_is_refused_by_name() {
    let folder = tempfile::tempdir().unwrap();
    let mut writer = Writer::create(folder.path(), &common::plan(), &common::record()).unwrap();
    let values = Values::Total { amount: vec![1.0] };
    let error = writer.write(&Snapshot { output_idx: 4, t: 0.0, values }).unwrap_err();
    assert_eq!(error.to_string(), "output 4 of the plan has 2 quantities, its snapshot has 1");
    let values = Values::Total { amount: vec![1.0] };
    assert!(writer.write(&Snapshot { output_idx: 99, t: 0.0, values }).is_err());
}

#[test]
fn a_place_that_cannot_be_written_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("a_file");
    fs::write(&file, "").unwrap();
    let error = Writer::create(&file.join("below"), &common::plan(), &common::record()).err().unwrap();
    assert!(error.to_string().contains("a_file"), "{error}");
}

#[test]
fn species_of_one_unit_give_the_column_that_unit() {
    let folder = tempfile::tempdir().unwrap();
    let mut plan = common::plan();
    plan.outputs.truncate(1);
    plan.outputs[0].quantities = vec![Quantity::Species(2)];
    let values = Values::Binned {
        mean: vec![vec![1.0; 6]],
        standard_error: vec![vec![0.1; 6]],
        n_particles: vec![2; 6],
    };
    write_plan(folder.path(), &plan, &[Snapshot { output_idx: 0, t: 10.0, values }]);
    let footer = read::footer(&folder.path().join("profile/part-0000.parquet")).unwrap();
    let unit = |name: &str| footer.columns.iter().find(|column| column.name == name).unwrap().unit.clone();
    assert_eq!((unit("concentration"), unit("x"), unit("t")), ("kg/m^3".into(), "m".into(), "s".into()));
}

/// `/dev/full` answers every write as a full disk does.
#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_is_named_and_the_earlier_run_stays() {
    let folder = tempfile::tempdir().unwrap();
    write(folder.path());
    let before = files(folder.path());
    let mut writer = Writer::create(folder.path(), &common::plan(), &common::record()).unwrap();
    writer.write(&common::snapshots()[0]).unwrap();
    let temporary = folder.path().join(format!(".points.parquet.tmp-{}", std::process::id()));
    std::os::unix::fs::symlink("/dev/full", temporary).unwrap();
    let error = writer.finish(vec![common::point()], &[]).unwrap_err();
    assert!(
        matches!(&error, TableError::DiskFull { file, .. } if file.ends_with("points.parquet")),
        "{error}"
    );
    assert!(error.to_string().contains("the disk is full"), "{error}");
    assert!(files(folder.path()) == before);
}

/// Runs the Python readers over two runs with different plans. Needs `LAMELLA_PYTHON`, a Python with
/// `tests/python/requirements.txt`; without it the test says that nothing was checked, and fails
/// where a check is owed (`CI` or `LAMELLA_REQUIRE_PYTHON` is set).
#[test]
#[allow(clippy::print_stderr)] // Whoever runs the tests must see that this one checked nothing.
fn other_tools_read_every_table() {
    let Some(python) = std::env::var_os("LAMELLA_PYTHON") else {
        let is_owed = ["CI", "LAMELLA_REQUIRE_PYTHON"].iter().any(|name| std::env::var_os(name).is_some());
        assert!(!is_owed, "LAMELLA_PYTHON is not set, so pyarrow, polars, DuckDB and pandas were not tried");
        eprintln!(
            "NOT CHECKED: LAMELLA_PYTHON is not set; pyarrow, polars, DuckDB and pandas were not tried"
        );
        return;
    };
    let parent = tempfile::tempdir().unwrap();
    let (first, second) = (parent.path().join("first"), parent.path().join("it's second"));
    write_plan(&first, &with_rows(common::plan()), &with_snapshots_of_rows());
    write_plan(&second, &with_rows(other_plan()), &with_snapshots_of_rows());
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let output = std::process::Command::new(python)
        .arg(root.join("tests/python/open_tables.py"))
        .arg(root.join("docs/schema/footer-1.json"))
        .args([first, second])
        .output()
        .unwrap();
    let text = String::from_utf8_lossy(&output.stdout);
    assert!(output.status.success(), "{text}{}", String::from_utf8_lossy(&output.stderr));
    assert!(text.contains("12 tables read across 2 runs; 0 failures"), "{text}");
}

/// Columns of rows: places by word and position, unknown numbers null, units by species.
#[test]
fn outputs_in_rows_have_places_and_units() {
    let folder = tempfile::tempdir().unwrap();
    write_plan(folder.path(), &with_rows(common::plan()), &with_snapshots_of_rows());
    let text = |table: &str| shown(&folder.path().join(table).join("part-0000.parquet"));
    let through = text("breakthrough");
    // Two outputs, two times, two species.
    assert_eq!(through.len(), 8);
    let first = "t=0 place=plane x=0.05 y= z= species=A concentration=0 rate= cumulative=2 n_particles=3 amount_unit=mol/m unit=mol/m^3 output=7";
    assert_eq!(through[0], first);
    let boxed = "t=20 place=box x=0 y=-0.0025 z= species=biomass concentration=20 rate=21 cumulative=22 n_particles=23 amount_unit=kg/m unit=kg/m^3 output=8";
    assert_eq!(through[7], boxed);
    let budget = text("budget");
    assert_eq!(budget.len(), 28);
    assert!(
        budget[0].starts_with("t=0 place=initial species=A amount=0 entered= left=2 unit=mol/m"),
        "{}",
        budget[0]
    );
    assert!(budget[6].starts_with("t=0 place=defect"), "{}", budget[6]);
    assert!(
        text("dilution")[3].starts_with("t=20 species=biomass index=20 entropy=21 reactor_ratio=22 unit=m^2")
    );
    assert!(text("moments")[0].starts_with("t=0 species=A amount=0 mean_x= mean_y=2"));
    assert!(
        text("first_passage")[0].contains("cumulative=0 rate= n_particles=2 amount_unit=mol/m unit=mol/m")
    );
}

/// Rows as text, without point and replicate.
fn shown(file: &Path) -> Vec<String> {
    let reader =
        parquet::arrow::arrow_reader::ParquetRecordBatchReaderBuilder::try_new(fs::File::open(file).unwrap());
    let mut rows = Vec::new();
    for batch in reader.unwrap().build().unwrap() {
        let batch = batch.unwrap();
        let schema = batch.schema();
        for row in 0..batch.num_rows() {
            let cells = schema.fields().iter().zip(batch.columns()).skip(2).map(|(field, column)| {
                use arrow_array::types::{UInt16Type, UInt64Type};
                let value = if column.is_null(row) {
                    String::new()
                } else if let Some(values) = column.as_primitive_opt::<Float64Type>() {
                    values.value(row).to_string()
                } else if let Some(values) = column.as_primitive_opt::<UInt64Type>() {
                    values.value(row).to_string()
                } else if let Some(values) = column.as_primitive_opt::<UInt16Type>() {
                    values.value(row).to_string()
                } else {
                    let words = column.as_dictionary::<UInt16Type>();
                    words.values().as_string::<i32>().value(words.keys().value(row).into()).to_owned()
                };
                format!("{}={value}", field.name())
            });
            rows.push(cells.collect::<Vec<_>>().join(" "));
        }
    }
    rows
}

/// The same outputs with the species in another order and one more in front, so that every number in
/// a dictionary means another word.
fn other_plan() -> Plan {
    let mut plan = common::plan();
    plan.species.rotate_left(1);
    let more = plan.species[0].clone();
    plan.species.insert(0, lamella::plan::Species { name: "nitrate NO₃⁻".to_owned(), ..more });
    plan.outputs[1].unit = None;
    plan
}

/// Table, column, species and unit of each row of `columns.parquet`, with the exponents of m, kg, s and mol.
type Meaning = ([Option<String>; 4], [Option<f64>; 4]);

fn meanings(folder: &Path) -> Vec<Meaning> {
    let file = fs::File::open(folder.join("columns.parquet")).unwrap();
    let batches = parquet::arrow::arrow_reader::ParquetRecordBatchReaderBuilder::try_new(file).unwrap();
    let mut found = Vec::new();
    for batch in batches.build().unwrap().map(Result::unwrap) {
        let text = |name: &str, row: usize| {
            let column = batch.column_by_name(name).unwrap().as_string::<i32>();
            column.is_valid(row).then(|| column.value(row).to_owned())
        };
        let number = |name: &str, row: usize| {
            let column = batch.column_by_name(name).unwrap().as_primitive::<Float64Type>();
            column.is_valid(row).then(|| column.value(row))
        };
        found.extend((0..batch.num_rows()).map(|row| {
            let texts = ["table", "column", "species", "unit"].map(|name| text(name, row));
            (texts, ["length", "mass", "time", "amount"].map(|name| number(name, row)))
        }));
    }
    found
}

#[test]
fn every_unit_is_told_as_exponents_too() {
    let folder = tempfile::tempdir().unwrap();
    write(folder.path());
    let meanings = meanings(folder.path());
    for (texts, exponents) in &meanings {
        let has_unit =
            texts[3].as_ref().is_some_and(|unit| !["see column unit", "byte", "UTC"].contains(&&**unit));
        assert!(exponents.iter().all(|exponent| exponent.is_some() == has_unit), "{texts:?}: {exponents:?}");
    }
    let of = |table: &str, column: &str, species: Option<&str>| -> Vec<(&str, [f64; 4])> {
        let is_it = |(texts, _): &&Meaning| {
            [texts[0].as_deref(), texts[1].as_deref(), texts[2].as_deref()]
                == [Some(table), Some(column), species]
        };
        let found = meanings.iter().filter(is_it);
        found
            .map(|(texts, exponents)| (texts[3].as_deref().unwrap(), exponents.map(Option::unwrap)))
            .collect()
    };
    assert_eq!(of("points", "chi", None), [("1/s", [0.0, 0.0, -1.0, 0.0])]);
    assert_eq!(of("points", "err", None), [("mol/m^3", [-3.0, 0.0, 0.0, 1.0])]);
    assert_eq!(of("points", "limit.profile.A.l2", None), [("mol/m^2.5", [-2.5, 0.0, 0.0, 1.0])]);
    assert_eq!(of("profile", "concentration", Some("biomass")), [("mg/L", [-3.0, 1.0, 0.0, 0.0])]);
    assert_eq!(of("errors", "l1", Some("A")), [("mol/m^2", [-2.0, 0.0, 0.0, 1.0])]);
    assert_eq!(of("errors", "l2", Some("A")), [("mol/m^2.5", [-2.5, 0.0, 0.0, 1.0])]);
    assert_eq!(of("errors", "rmse", Some("A, B")), [("mol/m^3", [-3.0, 0.0, 0.0, 1.0])]);
    assert_eq!(of("errors", "relative_l1", None), [("1", [0.0; 4])]);
}

#[test]
fn error_bars_are_a_table_with_units() {
    let folder = tempfile::tempdir().unwrap();
    let bar = lamella::table::ErrorBarRow {
        point: 0,
        replicate: 0,
        t: None,
        output: 0,
        kind: "profile".to_owned(),
        species_a: "A".to_owned(),
        species_b: None,
        n: 5,
        size: 4.0,
        total: 0.5,
        from_step: 0.25,
        from_particles: 0.125,
        from_bins: None,
        relative: Some(0.125),
        unit: "mol/m^3".to_owned(),
    };
    let mut writer = Writer::create(folder.path(), &common::plan(), &common::record()).unwrap();
    writer.error_bars(vec![bar]);
    writer.finish(vec![common::point()], &[]).unwrap();
    let path = folder.path().join("error_bars/part-0000.parquet");
    assert_eq!(read::footer(&path).unwrap().table, "error_bars");
    let file = std::fs::File::open(&path).unwrap();
    let mut batches = parquet::arrow::arrow_reader::ParquetRecordBatchReaderBuilder::try_new(file)
        .unwrap()
        .build()
        .unwrap();
    let batch = batches.next().unwrap().unwrap();
    let number = |name: &str| {
        let column = batch.column_by_name(name).unwrap().as_primitive::<Float64Type>();
        column.is_valid(0).then(|| column.value(0))
    };
    let names = ["t", "size", "total", "from_step", "from_particles", "from_bins", "relative"];
    let expected = [None, Some(4.0), Some(0.5), Some(0.25), Some(0.125), None, Some(0.125)];
    assert_eq!(names.map(number), expected);
    let meanings = meanings(folder.path());
    let told = |(texts, exponents): &&Meaning| {
        let [table, column, species, unit] = texts.each_ref().map(|text| text.as_deref());
        (table, column, species) == (Some("error_bars"), Some("total"), Some("A"))
            && unit == Some("mol/m^2.5")
            && exponents.map(Option::unwrap) == [-2.5, 0.0, 0.0, 1.0]
    };
    assert_eq!(meanings.iter().filter(told).count(), 1);
}
