//! Flow from files, and the table of its cells.

use crate::program::Folder;
use arrow_array::cast::AsArray;
use arrow_array::types::Float64Type;
use parquet::arrow::arrow_reader::ParquetRecordBatchReaderBuilder;

const SCENE: &str = r#"lamella 1
species A
domain rect x = 0 .. 40 m, z = 10 .. 30 m
boundary left inflow A = 1 mg/L
boundary right outflow
boundary bottom, top reflect
medium porosity 0.5
flow table "flows/field.csv" { at x [m], "depth" [cm]; velocity vx [m/d], vz [m/d]; head h [m] }
dispersion longitudinal 1 m, transverse 0.1 m, molecular 1e-9 m^2/s
particles mass 100
run to 10 d, step 1 d
output budget A at t = 10 d
output flow
"#;

/// 4 x 2 cells of 10 m; layers of 1 and 3 m/d.
fn field() -> String {
    let mut text = String::from("x,depth,vx,vz,h\n");
    for x in [5, 15, 25, 35] {
        for (depth, v) in [(1500, 1), (2500, 3)] {
            text += &format!("{x},{depth},{v},0,{}\n", 10.0 - 0.1 * f64::from(x));
        }
    }
    text
}

fn columns(folder: &Folder, names: &[&str]) -> Vec<Vec<Option<f64>>> {
    let file = std::fs::File::open(folder.path("results/a/flow/part-0000.parquet")).unwrap();
    let batches = ParquetRecordBatchReaderBuilder::try_new(file).unwrap().build().unwrap();
    let mut found = vec![Vec::new(); names.len()];
    for batch in batches {
        let batch = batch.unwrap();
        for (name, values) in names.iter().zip(&mut found) {
            values.extend(batch.column_by_name(name).unwrap().as_primitive::<Float64Type>().iter());
        }
    }
    found
}

#[test]
fn the_cells_of_a_flow_from_a_file_are_a_table() {
    let folder = Folder::new();
    folder.write("a.lam", SCENE);
    std::fs::create_dir(folder.path("flows")).unwrap();
    folder.write("flows/field.csv", field());
    folder.lamella(&["run", "a.lam"]).exits(0);
    let names =
        ["x", "y", "z", "head", "conductivity", "porosity", "discharge_x", "discharge_y", "discharge_z"];
    let table = columns(&folder, &names);
    let whole = |values: [f64; 8]| values.map(Some).to_vec();
    assert_eq!(table[0], whole([5.0, 5.0, 15.0, 15.0, 25.0, 25.0, 35.0, 35.0]));
    assert_eq!(table[2], whole([15.0, 25.0, 15.0, 25.0, 15.0, 25.0, 15.0, 25.0]));
    assert_eq!(table[3], whole([9.5, 9.5, 8.5, 8.5, 7.5, 7.5, 6.5, 6.5]));
    assert_eq!((&table[1], &table[4], &table[7]), (&vec![None; 8], &vec![None; 8], &vec![None; 8]));
    assert_eq!(table[5], vec![Some(0.5); 8]);
    for (q, v) in table[6].iter().zip([1.0, 3.0].iter().cycle()) {
        assert!((q.unwrap() * 86_400.0 - 0.5 * v).abs() < 1e-12, "{q:?}");
    }
    assert_eq!(table[8], vec![Some(0.0); 8]);
    // The file is kept with the results: what happens to the user's own does not matter.
    folder.write("flows/field.csv", "gone");
    folder.lamella(&["verify", "results/a"]).exits(0).gives("the same bytes");
    let plan = folder.read("results/a/plan.yaml");
    let hash = blake3::hash(field().as_bytes()).to_hex().to_string();
    assert!(plan.contains(&hash), "the hash of the file is part of the plan");
    folder.lamella(&["run", "a.lam"]).exits(2).says("[M033]").says("line 1, column 1 of");
}

#[test]
fn another_byte_in_a_file_is_another_plan() {
    let folder = Folder::new();
    folder.write("a.lam", SCENE);
    std::fs::create_dir(folder.path("flows")).unwrap();
    let hash = |text: String| {
        folder.write("flows/field.csv", text);
        let plan = folder.lamella(&["plan", "a.lam"]).exits(0).stdout;
        plan.lines().find(|line| line.contains("hash")).unwrap().to_owned()
    };
    assert_ne!(hash(field()), hash(field() + "\n"));
    assert_eq!(hash(field()), hash(field()));
}
