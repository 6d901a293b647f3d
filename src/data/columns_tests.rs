//! Files of every kind that people have, and what is wrong with others.

use super::{Column, DataFile, Kind, Place, ReadError, Rule};
use crate::units::Unit;
use ::parquet::arrow::ArrowWriter;
use ::parquet::file::metadata::KeyValue;
use arrow_array::{ArrayRef, Float32Array, Float64Array, Int32Array, RecordBatch, StringArray};
use std::sync::Arc;

fn column(name: &str, unit: &str) -> Column {
    Column {
        name: name.to_owned(),
        unit: if unit.is_empty() { Unit::ONE } else { Unit::parse(unit).expect("a unit") },
    }
}

fn wanted() -> Vec<Column> {
    vec![column("t", "d"), column("c", "mg/L")]
}

fn read(text: &str) -> Result<Vec<Vec<f64>>, ReadError> {
    DataFile::new("f.csv", text.to_owned()).columns(&wanted()).map(|columns| columns.numbers.clone())
}

fn wrong(text: &str) -> (Kind, Option<Place>, String) {
    let error = read(text).expect_err(text);
    (error.kind, error.place, error.to_string())
}

fn line(line: usize, column: usize) -> Option<Place> {
    Some(Place::Text { line, column })
}

#[test]
fn texts_of_every_form_are_read() {
    let expected = vec![vec![0.0, 86_400.0], vec![1e-3, 2.5e-3]];
    for text in [
        "t,c\n0,1\n1,2.5\n",
        "0,1\n1,2.5",
        "# made by hand\r\nt;c\r\n\r\n0;1\r\n# later\r\n1;2.5\r\n",
        "note\tc\tt\nfirst\t1\t0\nlast, of all\t2.5\t1\n",
        "\u{feff}\"t\", c \n0,1\n+1.0,25e-1\n",
        "t [d],c (mg/L)\n0,1\n1,2.5\n",
        "t,c (as measured)\n0,1\n1,2.5\n",
        "t,\"c\"\n0.,1\n1,\"2.50\"\n",
    ] {
        assert_eq!(read(text).unwrap_or_else(|error| panic!("{text}: {error}")), expected, "{text}");
    }
}

#[test]
fn mistakes_are_told_with_their_places() {
    assert_eq!(
        wrong("t,c\n0,1\n1,nan\n"),
        (Kind::Value, line(3, 3), "line 3, column 3: `nan` in column `c` is no finite number".into())
    );
    assert_eq!(wrong("nan,1\n1,2\n").1, line(1, 1));
    assert_eq!(wrong("t,c\n0,\n").1, line(2, 3));
    assert_eq!(wrong("t,c\n0,1\n1,2,3\n").0, Kind::Damaged);
    assert_eq!(wrong("t,c\n0,1\n1\n").1, line(3, 1));
    assert!(wrong("t;c\n0;1,5\n").2.contains("write a decimal point"));
    assert!(wrong("t,conc\n0,1\n").2.contains("there is no column `c`"));
    assert!(wrong("t,C\n0,1\n").2.contains("did you mean `C`?"));
    assert_eq!(wrong("t,c,c\n0,1,2\n").1, line(1, 5));
    assert_eq!(wrong("0,1,2\n1,2,3\n").1, line(1, 3));
    assert!(wrong("0,1,2\n1,2,3\n").2.contains("3 fields here, and 2 columns declared"));
    assert!(wrong("t [h],c\n0,1\n").2.contains("says that column `t` is in h"));
    assert_eq!(wrong("").0, Kind::Missing);
    assert_eq!(wrong("# nothing\n").0, Kind::Missing);
    assert_eq!(wrong("t,c\n").2, "the table has no row");
    assert_eq!(wrong("t,c\n0,1e400\n").1, line(2, 3));
    assert_eq!(wrong("t,c\n0,\"1\n").0, Kind::Damaged);
    let bytes = DataFile::new("f.csv", vec![b't', 0xff]);
    assert_eq!(bytes.columns(&wanted()).expect_err("no text").kind, Kind::Foreign);
}

/// Centimetres and metres, hours and days: the same numbers, bit by bit, and one table.
#[test]
fn units_of_columns_make_no_difference() {
    let hash = |text: &str, unit: &str| {
        let file = DataFile::new("f.csv", text.to_owned());
        let table = file.table(&[column("x", unit), column("c", "")], 1, 1, Rule::Linear).expect("a table");
        table.hash().to_owned()
    };
    assert_eq!(hash("7.5,1\n12.3,2\n", "cm"), hash("0.075,1\n0.123,2\n", "m"));
    assert_eq!(hash("7.5,1\n12.3,2\n", "cm"), hash("75,1\n123,2\n", "mm"));
    assert_ne!(hash("7.5,1\n12.3,2\n", "cm"), hash("7.5,1\n12.3,2\n", "mm"));
}

fn parquet(columns: Vec<(&str, ArrayRef)>) -> Vec<u8> {
    let batch = RecordBatch::try_from_iter(columns).expect("columns of one length");
    let mut bytes = Vec::new();
    let mut writer = ArrowWriter::try_new(&mut bytes, batch.schema(), None).expect("a writer");
    writer.write(&batch).expect("written");
    writer.close().expect("closed");
    bytes
}

#[test]
fn parquet_gives_the_same_numbers() {
    let file = parquet(vec![
        ("note", Arc::new(Int32Array::from(vec![7, 8]))),
        ("c", Arc::new(Float32Array::from(vec![1.0, 2.5]))),
        ("t", Arc::new(Int32Array::from(vec![0, 1]))),
    ]);
    let columns = DataFile::new("f.parquet", file).columns(&wanted()).expect("columns");
    assert_eq!(columns.numbers[0], [0.0, 86_400.0]);
    // A factor of 1e-3 is rounded once.
    assert!((columns.numbers[1][1] - 2.5e-3).abs() < 1e-18);
    let holes = parquet(vec![
        ("c", Arc::new(Float64Array::from(vec![1.0, f64::NAN]))),
        ("t", Arc::new(Float64Array::from(vec![0.0, 1.0]))),
    ]);
    let error = DataFile::new("f.parquet", holes).columns(&wanted()).expect_err("a hole");
    assert_eq!((error.kind, error.place), (Kind::Value, Some(Place::Row(2))));
}

/// A table of ours: its columns carry notes of their units.
fn noted(columns: Vec<(&str, ArrayRef)>, notes: &str) -> DataFile {
    let batch = RecordBatch::try_from_iter(columns).expect("columns of one length");
    let mut bytes = Vec::new();
    let mut writer = ArrowWriter::try_new(&mut bytes, batch.schema(), None).expect("a writer");
    writer.write(&batch).expect("written");
    let note = KeyValue::new("lamella".to_owned(), format!("{{\"columns\": [{notes}]}}"));
    writer.append_key_value_metadata(note);
    writer.close().expect("closed");
    DataFile::new("f.parquet", bytes)
}

#[test]
fn a_table_of_ours_knows_its_units() {
    let numbers = |a: f64, b: f64| Arc::new(Float64Array::from(vec![a, b])) as ArrayRef;
    let words = |a: &str, b: &str| Arc::new(StringArray::from(vec![a, b])) as ArrayRef;
    let of_t = "{\"name\": \"t\", \"unit\": \"s\"}";
    // Declared in days and noted in seconds: what is read is seconds.
    let file = noted(vec![("t", numbers(0.0, 60.0)), ("c", numbers(1.0, 2.0))], of_t);
    let columns = file.columns(&wanted()).expect("columns");
    assert_eq!(columns.numbers[0], [0.0, 60.0]);
    // Nothing is noted of the other one.
    assert!((columns.numbers[1][1] - 2e-3).abs() < 1e-18);

    let of_rows = format!("{of_t}, {{\"name\": \"c\", \"unit\": \"see column unit\"}}");
    let file = |first: &str, second: &str| {
        let columns =
            vec![("t", numbers(0.0, 60.0)), ("c", numbers(1.0, 2.0)), ("unit", words(first, second))];
        noted(columns, &of_rows).columns(&wanted())
    };
    let columns = file("g/L", "g/L").expect("columns");
    assert_eq!(columns.numbers[1], [1.0, 2.0]);
    let error = file("g/L", "mg/L").expect_err("two units");
    assert_eq!((error.kind, error.place), (Kind::Mismatch, Some(Place::Row(2))));
    let error = file("mol/m^3", "mol/m^3").expect_err("another dimension");
    assert_eq!(error.kind, Kind::Mismatch);
    assert!(error.to_string().contains("`c [mol/m^3]`"), "{error}");
}

fn grid(text: &str, n_axes: usize) -> Result<Vec<f64>, ReadError> {
    let columns = [column("x", "m"), column("y", "m"), column("c", "")];
    let file = DataFile::new("f.csv", text.to_owned());
    file.table(&columns, n_axes, 2, Rule::Linear).map(|table| table.values().to_vec())
}

#[test]
fn rows_of_a_grid_come_in_any_order_and_leave_no_hole() {
    assert_eq!(grid("0,0,1\n0,2,2\n5,0,3\n5,2,4\n", 2).expect("a grid"), [1.0, 2.0, 3.0, 4.0]);
    assert_eq!(grid("5,2,4\n0,2,2\n0,0,1\n5,0,3\n", 2).expect("a grid"), [1.0, 2.0, 3.0, 4.0]);
    let hole = grid("0,0,1\n0,2,2\n5,0,3\n", 2).expect_err("a hole");
    assert!(hole.message.contains("3 of them on 2 x 2 coordinates, and none at x = 5, y = 2"), "{hole}");
    let twice = grid("0,0,1\n0,2,2\n5,0,3\n5,2,4\n0,2,9\n", 2).expect_err("twice");
    assert_eq!((twice.kind, twice.place), (Kind::Points, line(5, 1)));
    let twice = grid("0,0,1\n0,0,2\n5,0,3\n7,2,4\n", 2).expect_err("twice");
    assert_eq!((twice.kind, twice.place), (Kind::Points, line(2, 1)));
    // Read over x alone, the first line of a second y is one too many.
    assert_eq!(grid("0,0,1\n0,2,2\n", 1).expect_err("twice").place, line(2, 1));
}
