//! Files written by the description of MODFLOW's input and output, sound and damaged. The same files from other
//! programs are tried in `tests/flow_files.rs`.

use super::{Files, Series, Settings, Side, read};
use crate::flow::FaceFlow;
use crate::flow::read::damage_tests::try_all;
use crate::flow::read::{Kind, ReadError};

/// Two layers of one row and two columns: cells of 10 m by 4 m, 1 m and 2 m thick.
#[derive(Clone)]
struct Model {
    kind: &'static str,
    top: Vec<f64>,
    bottom: Vec<f64>,
    idomain: Vec<i32>,
    cell_type: Vec<i32>,
    ia: Vec<i32>,
    ja: Vec<i32>,
}

fn model() -> Model {
    Model {
        kind: "DIS",
        top: vec![3.0; 2],
        bottom: vec![2.0, 2.0, 0.0, 0.0],
        idomain: vec![1; 4],
        cell_type: vec![0; 4],
        ia: vec![1, 4, 7, 10, 13],
        ja: vec![1, 2, 3, 2, 1, 4, 3, 1, 4, 4, 2, 3],
    }
}

/// Flow of 8 enters the upper left cell by a well, 2 of it sinks there and comes up on the right, and all
/// leaves in the upper right cell.
const FLOWS: [f64; 12] = [0.0, -6.0, -2.0, 0.0, 6.0, 2.0, 0.0, 2.0, -2.0, 0.0, -2.0, 2.0];

impl Model {
    fn file(&self) -> Vec<u8> {
        let ints = |values: &[i32]| values.iter().flat_map(|x| x.to_le_bytes()).collect::<Vec<u8>>();
        let doubles = |values: &[f64]| values.iter().flat_map(|x| x.to_le_bytes()).collect::<Vec<u8>>();
        let variables: Vec<(&str, &str, usize, Vec<u8>)> = vec![
            ("NCELLS", "INTEGER", 0, ints(&[4])),
            ("NLAY", "INTEGER", 0, ints(&[2])),
            ("NROW", "INTEGER", 0, ints(&[1])),
            ("NCOL", "INTEGER", 0, ints(&[2])),
            ("NJA", "INTEGER", 0, ints(&[self.ja.len() as i32])),
            ("XORIGIN", "DOUBLE", 0, doubles(&[0.0])),
            ("YORIGIN", "DOUBLE", 0, doubles(&[0.0])),
            ("ANGROT", "DOUBLE", 0, doubles(&[0.0])),
            ("DELR", "DOUBLE", 2, doubles(&[10.0, 10.0])),
            ("DELC", "DOUBLE", 1, doubles(&[4.0])),
            ("TOP", "DOUBLE", 2, doubles(&self.top)),
            ("BOTM", "DOUBLE", 4, doubles(&self.bottom)),
            ("IA", "INTEGER", 5, ints(&self.ia)),
            ("JA", "INTEGER", self.ja.len(), ints(&self.ja)),
            ("IDOMAIN", "INTEGER", 4, ints(&self.idomain)),
            ("ICELLTYPE", "INTEGER", 4, ints(&self.cell_type)),
        ];
        let mut file = Vec::new();
        for line in [&format!("GRID {}", self.kind), "VERSION 1", "NTXT 16", "LENTXT 100"] {
            file.extend(format!("{line:<49}\n").into_bytes());
        }
        for (name, kind, n, _) in &variables {
            let size = if *n == 0 { "NDIM 0".to_owned() } else { format!("NDIM 1 {n}") };
            let line = format!("{name} {kind} {size} # a comment");
            file.extend(format!("{line:<99}\n").into_bytes());
        }
        variables.iter().for_each(|(_, _, _, data)| file.extend(data));
        file
    }
}

fn header(step: i32, text: &str, sizes: [i32; 3], method: i32, length: f64, end: f64) -> Vec<u8> {
    let mut bytes = Vec::new();
    bytes.extend(step.to_le_bytes());
    bytes.extend(1i32.to_le_bytes());
    bytes.extend(format!("{text:>16}").into_bytes());
    sizes.iter().for_each(|size| bytes.extend(size.to_le_bytes()));
    bytes.extend(method.to_le_bytes());
    [length, length, end].iter().for_each(|time| bytes.extend(time.to_le_bytes()));
    bytes
}

fn array(step: i32, text: &str, end: f64, values: &[f64]) -> Vec<u8> {
    let mut bytes = header(step, text, [values.len() as i32, 1, -1], 1, 5.0, end);
    values.iter().for_each(|value| bytes.extend(value.to_le_bytes()));
    bytes
}

fn list(text: &str, columns: &[&str], rows: &[(i32, &[f64])]) -> Vec<u8> {
    let mut bytes = header(1, text, [2, 1, -2], 6, 5.0, 5.0);
    for name in ["GWF", "GWF", "GWF", "MINE"] {
        bytes.extend(format!("{name:<16}").into_bytes());
    }
    bytes.extend((columns.len() as i32 + 1).to_le_bytes());
    columns.iter().for_each(|name| bytes.extend(format!("{name:>16}").into_bytes()));
    bytes.extend((rows.len() as i32).to_le_bytes());
    for (cell, values) in rows {
        bytes.extend(cell.to_le_bytes());
        bytes.extend(1i32.to_le_bytes());
        values.iter().for_each(|value| bytes.extend(value.to_le_bytes()));
    }
    bytes
}

fn budget() -> Vec<u8> {
    [array(1, "FLOW-JA-FACE", 5.0, &FLOWS), list("WEL", &[], &[(1, &[8.0]), (2, &[-8.0])])].concat()
}

fn heads(values: [f64; 4]) -> Vec<u8> {
    let mut bytes = Vec::new();
    for layer in 1..=2 {
        bytes.extend([1i32, 1].iter().flat_map(|x| x.to_le_bytes()));
        bytes.extend([5.0f64, 5.0].iter().flat_map(|x| x.to_le_bytes()));
        bytes.extend(format!("{:>16}", "HEAD").into_bytes());
        bytes.extend([2i32, 1, layer].iter().flat_map(|x| x.to_le_bytes()));
        let first = 2 * (layer as usize - 1);
        values[first..first + 2].iter().for_each(|head| bytes.extend(head.to_le_bytes()));
    }
    bytes
}

fn read_all(
    grid: &[u8],
    budget: &[u8],
    heads: Option<&[u8]>,
    sides: &[(String, Side)],
) -> Result<Series, ReadError> {
    let settings = Settings { length: 1.0, time: 1.0, porosity: &|_, _| 0.5, sides };
    read(Files { grid, budget, heads }, &settings)
}

fn read_budget(budget: &[u8]) -> Result<Series, ReadError> {
    read_all(&model().file(), budget, None, &[])
}

fn sinks(flow: &FaceFlow) -> Vec<(usize, f64)> {
    flow.sinks.iter().map(|sink| (sink.cell, sink.rate)).collect()
}

#[test]
fn layers_and_signs_are_turned_to_ours() {
    let series = read_budget(&budget()).unwrap();
    let flow = &series.periods[0].flow;
    assert_eq!(flow.cells.edges()[2], [0.0, 2.0, 3.0]);
    // Along x: below 2 over 8 m², above 6 over 4 m², both to the east.
    assert_eq!(flow.flux[0], [0.0, 0.0, 0.25, 1.5, 0.0, 0.0]);
    // Along z: down on the left, up on the right.
    assert_eq!(flow.flux[2], [0.0, -0.05, 0.0, 0.0, 0.05, 0.0]);
    assert_eq!(sinks(flow), [(1, -8.0), (3, 8.0)]);
    assert_eq!((flow.balance().worst, flow.through_flow()), (0.0, 8.0));
}

#[test]
fn a_side_may_be_named_for_a_package() {
    let west = Side { axis: 0, is_upper: false };
    let east = Side { axis: 0, is_upper: true };
    let one_way = |rate: f64, cell| list("WEL", &[], &[(cell, &[rate])]);
    let budget =
        [array(1, "FLOW-JA-FACE", 5.0, &FLOWS), one_way(8.0, 1), list("DRN", &[], &[(2, &[-8.0])])].concat();
    let sides = [("wel".to_owned(), west), ("DRN".to_owned(), east)];
    let series = read_all(&model().file(), &budget, None, &sides).unwrap();
    let flow = &series.periods[0].flow;
    assert_eq!((flow.flux[0][1], flow.flux[0][5], flow.sinks.len()), (2.0, 2.0, 0));
    assert_eq!(series.periods[0].packages[1].through_faces, -8.0);
    assert_eq!((flow.balance().worst, flow.through_flow()), (0.0, 8.0));
    // The west of a cell on the east is inside: what flows there stays in the cell.
    let inside = read_all(&model().file(), &budget, None, &[("DRN".to_owned(), west)]).unwrap();
    assert_eq!(sinks(&inside.periods[0].flow), [(1, -8.0), (3, 8.0)]);
    assert_eq!(Side::of_iflowface(2.0), Some(Side { axis: 1, is_upper: true }));
    assert_eq!(Side::of_iflowface(-2.0), Some(Side { axis: 2, is_upper: false }));
    assert_eq!(Side::of_iface(3.0), Some(Side { axis: 1, is_upper: false }));
    assert_eq!((Side::of_iface(0.0), Side::of_iflowface(f64::NAN)), (None, None));
}

#[test]
fn what_is_not_full_holds_less_water() {
    let convertible = Model { cell_type: vec![1, 1, 0, 0], ..model() };
    let read = |heads: Option<[f64; 4]>| {
        let heads = heads.map(super::tests::heads);
        read_all(&convertible.file(), &budget(), heads.as_deref(), &[])
    };
    let unknown = read(None).unwrap_err();
    assert_eq!(
        (unknown.kind, unknown.message.as_str()),
        (Kind::Missing, "the cell in layer 1, row 1, column 1 may be partly filled")
    );
    let period = &read(Some([2.25, 3.5, 1.0, 1.0])).unwrap().periods[0];
    assert_eq!(period.flow.porosity, [0.5, 0.125, 0.5, 0.5]);
    assert_eq!((period.least_saturation, &period.flow.head), (0.25, &Some(vec![1.0, 2.25, 1.0, 3.5])));
    let dry = &read(Some([-1e30, 3.5, 1.0, 1.0])).unwrap().periods[0];
    assert_eq!((dry.flow.porosity[1], dry.flow.head.as_ref().unwrap()[1].is_nan()), (0.0, true));
    let saved = [budget(), list("DATA-SAT", &["sat"], &[(1, &[0.0, 0.5])])].concat();
    let period = &read_all(&convertible.file(), &saved, None, &[]).unwrap().periods[0];
    assert_eq!((period.flow.porosity[1], period.packages.len()), (0.25, 1));
}

#[test]
fn inactive_cells_have_no_pores() {
    let ia = vec![1, 3, 5, 5, 5];
    let small = Model {
        idomain: vec![1, 1, 0, 0],
        bottom: vec![2.0, 2.0, 7.0, 0.0],
        ia,
        ja: vec![1, 2, 2, 1],
        ..model()
    };
    let flows = array(1, "FLOW-JA-FACE", 5.0, &[0.0, -8.0, 0.0, 8.0]);
    let wells = list("WEL", &[], &[(1, &[8.0]), (2, &[-8.0])]);
    let wrong = read_all(&small.file(), &[flows.clone(), wells.clone()].concat(), None, &[]).unwrap_err();
    assert_eq!(wrong.kind, Kind::Damaged, "without an active cell the layer's own heights count: {wrong}");
    let small = Model { bottom: vec![2.0, 2.0, 0.0, 9.0], ..small };
    let series = read_all(&small.file(), &[flows, wells].concat(), None, &[]).unwrap();
    assert_eq!(series.periods[0].flow.porosity, [0.0, 0.5, 0.0, 0.5]);
    assert_eq!(series.periods[0].flow.balance().worst, 0.0);
}

#[test]
fn what_has_no_rectilinear_cells_is_refused_by_name() {
    let refused = |model: Model| {
        let error = read_all(&model.file(), &budget(), None, &[]).unwrap_err();
        assert_eq!(error.kind, Kind::Unsupported, "{error}");
        assert!(error.help.is_some());
        error.message
    };
    let bumpy = refused(Model { bottom: vec![2.0, 2.5, 0.0, 0.0], ..model() });
    assert_eq!(
        bumpy,
        "the bottom of layer 1 is not flat: 2 in layer 1, row 1, column 1, 2.5 in layer 1, row 1, column 2"
    );
    let sloping = refused(Model { top: vec![3.0, 3.1], ..model() });
    assert!(sloping.starts_with("the top of the grid is not flat"), "{sloping}");
    let passing = refused(Model { idomain: vec![1, 1, -1, 1], ..model() });
    assert!(passing.starts_with("the cell in layer 2, row 1, column 1"), "{passing}");
    assert_eq!(refused(Model { kind: "DISV", ..model() }), "the grid is of the type DISV");
    let far = refused(Model { ja: vec![1, 2, 4, 2, 1, 4, 3, 1, 4, 4, 2, 3], ..model() });
    assert!(far.contains("layer 1, row 1, column 1 and layer 2, row 1, column 2"), "{far}");
}

#[test]
fn other_files_are_told_apart() {
    let kind = |budget: &[u8]| read_budget(budget).unwrap_err().kind;
    assert_eq!(kind(b""), Kind::Foreign);
    assert_eq!(kind(b"PAR1 and much more than that, so that a header is there"), Kind::Foreign);
    assert_eq!(kind(&model().file()), Kind::Foreign);
    assert_eq!(kind(&budget()[..200]), Kind::Damaged);
    assert_eq!(kind(&list("WEL", &[], &[(1, &[8.0])])), Kind::Missing);
    assert_eq!(kind(&[budget(), array(1, "FLOW-JA-FACE", 5.0, &FLOWS)].concat()), Kind::Damaged);
    assert_eq!(kind(&[budget(), array(2, "FLOW-JA-FACE", 4.0, &FLOWS)].concat()), Kind::Damaged);
    assert_eq!(kind(&array(1, "FLOW-JA-FACE", 5.0, &FLOWS[..11])), Kind::Mismatch);
    assert_eq!(kind(&array(1, "FLOW-JA-FACE", 5.0, &[f64::NAN; 12])), Kind::Value);
    assert_eq!(kind(&[budget(), list("DRN", &[], &[(5, &[1.0])])].concat()), Kind::Mismatch);
    assert_eq!(kind(&[budget(), list("DRN", &[], &[(1, &[f64::INFINITY])])].concat()), Kind::Value);
    assert_eq!(kind(&[budget(), array(1, "STO-SS", 5.0, &[0.0; 3])].concat()), Kind::Mismatch);
    let mut full = budget();
    full[32..36].copy_from_slice(&1i32.to_le_bytes());
    assert_eq!(kind(&full), Kind::Unsupported);
    let swapped: Vec<u8> =
        [1i32, 1].iter().flat_map(|x| x.to_be_bytes()).chain(budget()[8..].to_vec()).collect();
    assert!(read_budget(&swapped).unwrap_err().message.contains("big-endian"));
    let mut single = header(1, "FLOW-JA-FACE", [12, 1, -1], 1, 5.0, 5.0)[..40].to_vec();
    single.extend([5.0f32; 3].iter().flat_map(|x| x.to_le_bytes()));
    single.extend([0u8; 48]);
    assert!(read_budget(&single).unwrap_err().message.contains("single precision"));
    let wrong = |heads: &[u8]| read_all(&model().file(), &budget(), Some(heads), &[]).unwrap_err().kind;
    assert_eq!(wrong(&budget()), Kind::Foreign);
    assert_eq!(wrong(b""), Kind::Mismatch);
    let other = Model { ia: vec![1, 4, 7, 10, 14], ..model() };
    assert_eq!(read_all(&other.file(), &budget(), None, &[]).unwrap_err().kind, Kind::Damaged);
}

#[test]
fn steps_that_were_not_saved_are_told() {
    let later =
        [budget(), array(3, "FLOW-JA-FACE", 20.0, &FLOWS), array(4, "FLOW-JA-FACE", 25.0, &FLOWS)].concat();
    let series = read_budget(&later).unwrap();
    let times: Vec<_> =
        series.periods.iter().map(|period| (period.start, period.end, period.has_gap)).collect();
    assert_eq!(times, [(0.0, 5.0, false), (5.0, 20.0, true), (20.0, 25.0, false)]);
    // Without its wells the second flow does not add up, and says so.
    assert_eq!(series.periods[1].flow.balance().worst, 8.0);
}

#[test]
fn damage_ends_in_an_error_or_a_flow() {
    let (grid, budget, heads) = (model().file(), budget(), heads([1.0; 4]));
    let budget = [budget, list("DRN", &["IFACE"], &[(1, &[0.0, 1.0])])].concat();
    let tries = [
        try_all(&grid, 20_000, |grid| read_all(&grid, &budget, Some(&heads), &[]).is_ok()),
        try_all(&budget, 20_000, |budget| read_all(&grid, &budget, Some(&heads), &[]).is_ok()),
        try_all(&heads, 5_000, |heads| read_all(&grid, &budget, Some(&heads), &[]).is_ok()),
    ];
    assert!(tries.iter().all(|&n_read| (500..19_000).contains(&n_read)), "{tries:?}");
}
