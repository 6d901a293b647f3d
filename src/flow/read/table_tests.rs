use super::points::Bounds;
use super::table::{Column, Frame, Layout, Rows};
use super::{Kind, Place, Quantity, ReadError, csv, parquet};
use crate::flow::FaceFlow;
use ::parquet::arrow::ArrowWriter;
use ::parquet::basic::Compression;
use ::parquet::file::properties::WriterProperties;
use arrow_array::{ArrayRef, Float32Array, Float64Array, Int32Array, RecordBatch, StringArray};
use std::sync::Arc;

fn columns(names: &[&str]) -> Vec<Column> {
    names.iter().map(|name| Column::new(*name, 1.0)).collect()
}

fn centres() -> Layout {
    let rows = Rows::Centres { q: columns(&["qx", "qy"]), quantity: Quantity::Discharge };
    Layout { at: columns(&["x", "y"]), rows, porosity: None, head: None, conductivity: None }
}

fn faces() -> Layout {
    let rows = Rows::Faces { normal: "normal".into(), q: Column::new("q", 1.0) };
    Layout { rows, ..centres() }
}

fn frame(bounds: Option<Bounds>) -> Frame<'static> {
    Frame { bounds, porosity: &|_, _| 0.25 }
}

fn read(text: &str) -> Result<FaceFlow, ReadError> {
    csv::flow(text.as_bytes(), &centres(), &frame(None))
}

fn line(line: usize, column: usize) -> Option<Place> {
    Some(Place::Text { line, column })
}

const SOUND: &str = "x,y,qx,qy\n1,1,5,0\n1,2,5,0\n3,1,5,0\n3,2,5,0\n";

#[test]
fn rows_in_any_order_give_one_flow() {
    let flow = read(SOUND).unwrap();
    assert_eq!(flow.cells.edges()[0], [0.0, 2.0, 4.0]);
    assert_eq!(flow.cells.edges()[1], [0.5, 1.5, 2.5]);
    assert_eq!((flow.flux[0].as_slice(), flow.porosity[0]), ([5.0; 6].as_slice(), 0.25));
    let shuffled = "# a comment, with commas\r\n\"qx\", y ,x,qy,note\r\n\r\n5,2,3,0,\"a \"\"b\"\",\nc\"\r\n\
                    5e0,1,1.0,0,\r\n+5,2,1,0,\r\n5.,1,3,-0,last";
    assert_eq!(read(shuffled).unwrap(), flow);
}

#[test]
fn other_columns_go_to_their_cells_in_their_units() {
    let text =
        "x,y,qx,qy,n,h,k\n100,1,5,0,0.1,1,10\n100,2,5,0,0.2,2,20\n300,1,5,0,0.3,3,30\n300,2,5,0,0.4,4,40\n";
    let layout = Layout {
        at: vec![Column::new("x", 0.01), Column::new("y", 1.0)],
        rows: Rows::Centres {
            q: vec![Column::new("qx", 2.0), Column::new("qy", 1.0)],
            quantity: Quantity::PoreVelocity,
        },
        porosity: Some(Column::new("n", 1.0)),
        head: Some(Column::new("h", 1.0)),
        conductivity: Some(Column::new("k", 0.5)),
    };
    let flow = csv::flow(text.as_bytes(), &layout, &frame(None)).unwrap();
    assert_eq!(flow.porosity, [0.1, 0.2, 0.3, 0.4]);
    assert_eq!(flow.head, Some(vec![1.0, 2.0, 3.0, 4.0]));
    assert_eq!(flow.conductivity, Some(vec![5.0, 10.0, 15.0, 20.0]));
    assert_eq!(flow.cells.edges()[0], [0.0, 2.0, 4.0]);
    // Pore velocity 10 m/s: discharge 1 and 3 in the cells of the first row, 2 between them.
    assert!(
        (flow.flux[0][2] - 2.0).abs() < 1e-15 && (flow.flux[0][0] - 0.0).abs() < 1e-15,
        "{:?}",
        flow.flux[0]
    );
    let wrong = csv::flow(text.replace("0.3", "1.3").as_bytes(), &layout, &frame(None)).unwrap_err();
    assert_eq!((wrong.kind, wrong.place), (Kind::Value, line(4, 1)));
}

#[test]
fn uneven_cells_need_the_domain() {
    let text = "x,y,qx,qy\n0.5,1,1,0\n2,1,1,0\n5,1,1,0\n";
    let bounds = |x: f64| frame(Some(([0.0, 0.0, 0.0], [x, 2.0, 1.0])));
    let flow = csv::flow(text.as_bytes(), &centres(), &bounds(7.0)).unwrap();
    assert_eq!(
        (flow.cells.edges()[0].as_slice(), flow.cells.edges()[1].as_slice()),
        ([0.0, 1.0, 3.0, 7.0].as_slice(), [0.0, 2.0].as_slice())
    );
    let wrong = csv::flow(text.as_bytes(), &centres(), &bounds(8.0)).unwrap_err();
    assert!(wrong.message.contains("would end at 7 m, the domain at 8 m"), "{wrong}");
    let two_rows = "x,y,qx,qy\n0.5,1,1,0\n2,1,1,0\n5,1,1,0\n0.5,2,1,0\n2,2,1,0\n5,2,1,0\n";
    let unknown = read(two_rows).unwrap_err();
    assert_eq!((unknown.kind, unknown.place), (Kind::Points, line(3, 1)));
    assert!(unknown.message.contains("uneven"), "{unknown}");
    let single = read("x,y,qx,qy\n1,1,1,0\n2,1,1,0\n").unwrap_err();
    assert_eq!(single.message, "y = 1 m: one point alone has no size");
}

#[test]
fn missing_doubled_and_odd_points_are_named() {
    let doubled = read(&format!("{SOUND}1,2,5,0\n")).unwrap_err();
    assert_eq!(doubled.place, line(6, 1));
    assert_eq!(
        doubled.to_string(),
        "line 6, column 1: the point (1 m, 2 m) is there twice; it stands in line 3, column 1, too"
    );
    let missing = read(&SOUND.replace("1,2,5,0\n", "")).unwrap_err();
    assert_eq!(missing.message, "there is no row for the point (1 m, 2 m)");
    assert_eq!(missing.place, line(2, 1), "the row before it");
    let mut grid = String::from("x,y,qx,qy\n");
    for x in 0..6 {
        for y in 0..5 {
            grid += &format!("{x},{y},1,0\n");
        }
    }
    assert!(read(&grid).is_ok());
    let odd = read(&grid.replace("\n3,2,1,0", "\n3.1,2,1,0")).unwrap_err();
    assert_eq!((odd.kind, odd.place), (Kind::Points, line(3 * 5 + 2 + 2, 1)));
    assert_eq!(odd.message, "x = 3.1 m stands in 1 of 30 rows, other x in up to 5");
}

#[test]
fn wrong_text_is_named_by_line_and_column() {
    let of = |text: &str| read(text).unwrap_err();
    let number = of("x,y,qx,qy\n1,1,5,0\n1,2,five,0\n");
    assert_eq!((number.kind, number.place), (Kind::Value, line(3, 5)));
    assert_eq!(number.message, "`five` in column `qx` is no finite number");
    assert_eq!(of("x,y,qx,qy\n1,1,1d-3,0\n").help.as_deref(), Some("write `1e-3`"));
    assert_eq!(of("x,y,qx,qy\n1,1,\"1,5\",0\n").help.as_deref(), Some("write a decimal point"));
    let nan = of("x,y,qx,qy\n1,1,nan,0\n");
    assert_eq!((nan.kind, nan.help), (Kind::Value, None));
    assert_eq!(of("x,y,qx,qy\n1,1,1e999,0\n").kind, Kind::Value);
    assert_eq!(of("x,y,qx,qy\n1,1,,0\n").message, "column `qx` is empty here");
    assert_eq!(of("x,y,qx,qy\n1,1,0\n").message, "3 fields, the line of names has 4");
    assert_eq!(of("x;y;qx;qy\n1;1;0;0\n").kind, Kind::Unsupported);
    assert_eq!(
        of("x,y,QX,qy\n1,1,0,0\n").help.as_deref(),
        Some("did you mean `QX`? The table has `x`, `y`, `QX`, `qy`")
    );
    assert_eq!(of("x,y,qx,qx,qy\n").place, line(1, 8));
    assert_eq!(of("x,y,qx,qy\n1,1,\"0,0\n").message, "this quote is never closed");
    assert_eq!(of("x,y,qx,qy\n1,1,\"0\"0,0\n").message, "text follows a closing quote");
    assert_eq!(of("x,y,qx,qy\n").message, "the table has no row");
    assert_eq!((of("").kind, of("# only\n").kind), (Kind::Missing, Kind::Missing));
    assert_eq!(csv::flow(b"x,y\xff", &centres(), &frame(None)).unwrap_err().kind, Kind::Foreign);
}

/// Faces of 2 x 1 cells with edges 0, 1, 3 and 0, 2.
const FACES: &str = "normal,x,y,q\nx,0,1,1\nx,1,1,2\nx,3,1,3\ny,0.5,0,4\ny,0.5,2,5\ny,2,0,6\ny,2,2,7\n";

#[test]
fn faces_find_their_place() {
    let flow = csv::flow(FACES.as_bytes(), &faces(), &frame(None)).unwrap();
    assert_eq!(
        (flow.cells.edges()[0].as_slice(), flow.cells.edges()[1].as_slice()),
        ([0.0, 1.0, 3.0].as_slice(), [0.0, 2.0].as_slice())
    );
    assert_eq!(
        (flow.flux[0].as_slice(), flow.flux[1].as_slice()),
        ([1.0, 2.0, 3.0].as_slice(), [4.0, 5.0, 6.0, 7.0].as_slice())
    );
    let of = |text: String| csv::flow(text.as_bytes(), &faces(), &frame(None)).unwrap_err();
    let off = of(FACES.replace("y,2,0,6\ny,2,2,7", "y,2.5,0,6\ny,2.5,2,7"));
    assert_eq!((off.kind, off.place), (Kind::Points, line(7, 1)));
    assert_eq!(of(FACES.replace("y,2,0", "z,2,0")).place, line(7, 1));
    assert_eq!(of(FACES.replace("y,2,0", "w,2,0")).kind, Kind::Value);
    assert_eq!(of(FACES.replace("x,1,1,2\n", "")).kind, Kind::Points);
    assert_eq!(of("normal,x,y,q\nx,0,1,1\n".into()).kind, Kind::Missing);
}

fn written(columns: Vec<(&str, ArrayRef)>, compression: Compression) -> Vec<u8> {
    let batch = RecordBatch::try_from_iter(columns).unwrap();
    let properties = WriterProperties::builder().set_compression(compression).build();
    let mut file = Vec::new();
    let mut writer = ArrowWriter::try_new(&mut file, batch.schema(), Some(properties)).unwrap();
    writer.write(&batch).unwrap();
    writer.close().unwrap();
    file
}

pub(super) fn sound(qx: Vec<Option<f64>>, compression: Compression) -> Vec<u8> {
    let columns: Vec<(&str, ArrayRef)> = vec![
        ("note", Arc::new(StringArray::from(vec!["a", "b", "c", "d"]))),
        ("x", Arc::new(Int32Array::from(vec![1, 1, 3, 3]))),
        ("y", Arc::new(Float32Array::from(vec![1.0, 2.0, 1.0, 2.0]))),
        ("qx", Arc::new(Float64Array::from(qx))),
        ("qy", Arc::new(Float64Array::from(vec![0.0; 4]))),
    ];
    written(columns, compression)
}

#[test]
fn parquet_gives_what_the_same_text_gives() {
    let expected = read(SOUND).unwrap();
    for compression in [Compression::UNCOMPRESSED, Compression::SNAPPY, Compression::ZSTD(Default::default())]
    {
        let bytes = sound(vec![Some(5.0); 4], compression);
        assert_eq!(parquet::flow(bytes, &centres(), &frame(None)).unwrap(), expected);
    }
    let text: Vec<(&str, ArrayRef)> = vec![
        ("normal", Arc::new(StringArray::from(vec!["x", "x", "x", "y", "y", "y", "y"]))),
        ("x", Arc::new(Float64Array::from(vec![0.0, 1.0, 3.0, 0.5, 0.5, 2.0, 2.0]))),
        ("y", Arc::new(Float64Array::from(vec![1.0, 1.0, 1.0, 0.0, 2.0, 0.0, 2.0]))),
        ("q", Arc::new(Int32Array::from(vec![1, 2, 3, 4, 5, 6, 7]))),
    ];
    let flow = parquet::flow(written(text, Compression::UNCOMPRESSED), &faces(), &frame(None)).unwrap();
    assert_eq!(flow, csv::flow(FACES.as_bytes(), &faces(), &frame(None)).unwrap());
}

#[test]
fn wrong_parquet_is_named() {
    let of = |bytes: Vec<u8>, layout: &Layout| parquet::flow(bytes, layout, &frame(None)).unwrap_err();
    let plain = |qx| sound(qx, Compression::UNCOMPRESSED);
    let empty = of(plain(vec![Some(5.0), None, Some(5.0), Some(5.0)]), &centres());
    assert_eq!((empty.kind, empty.place), (Kind::Value, Some(Place::Row(2))));
    let infinite = of(plain(vec![Some(5.0), Some(5.0), Some(f64::INFINITY), Some(5.0)]), &centres());
    assert_eq!((infinite.kind, infinite.place), (Kind::Value, Some(Place::Row(3))));
    let layout = Layout { head: Some(Column::new("note", 1.0)), ..centres() };
    assert_eq!(of(plain(vec![Some(5.0); 4]), &layout).message, "column `note` holds Utf8, not numbers");
    let layout = Layout { head: Some(Column::new("h", 1.0)), ..centres() };
    assert_eq!(of(plain(vec![Some(5.0); 4]), &layout).kind, Kind::Missing);
    assert_eq!(of(b"x,y,qx,qy\n".to_vec(), &centres()).kind, Kind::Foreign);
    assert_eq!(of(b"PAR1PAR1".to_vec(), &centres()).kind, Kind::Damaged);
}
