//! Damaged files end in an error or in a flow, and never in a panic or in memory that the file does not have.

use super::table::{Column, Frame, Layout, Rows};
use super::{Quantity, csv, npy, parquet};
use rand_chacha::ChaCha8Rng;
use rand_core::{Rng, SeedableRng};

/// Damages a file in one of three ways.
fn damaged(file: &[u8], random: &mut impl Rng) -> Vec<u8> {
    let mut file = file.to_vec();
    let mut below = |n: usize| random.next_u64() as usize % n.max(1);
    match below(3) {
        0 => file.truncate(below(file.len())),
        1 => {
            for _ in 0..=below(4) {
                let at = below(file.len());
                file[at] ^= 1 << below(8);
            }
        }
        _ => {
            let at = below(file.len());
            let end = (at + below(9)).min(file.len());
            let byte = [0x00, 0xff, 0x7f, 0x80, b'"', b','][below(6)];
            file[at..end].fill(byte);
        }
    }
    file
}

/// Tries many damaged forms of a file; returns how many were still read.
pub(super) fn try_all(file: &[u8], n: usize, read: impl Fn(Vec<u8>) -> bool) -> usize {
    let mut random = ChaCha8Rng::seed_from_u64(7);
    (0..n).filter(|_| read(damaged(file, &mut random))).count()
}

fn layout() -> Layout {
    let columns = |names: [&str; 2]| names.map(|name| Column::new(name, 1.0)).to_vec();
    let rows = Rows::Centres { q: columns(["qx", "qy"]), quantity: Quantity::Discharge };
    Layout { at: columns(["x", "y"]), rows, porosity: None, head: None, conductivity: None }
}

const FRAME: Frame = Frame { bounds: None, porosity: &|_, _| 0.25 };

#[test]
fn arrays() {
    let mut file = b"\x93NUMPY\x01\x00\x76\x00".to_vec();
    let header = "{'descr': '<f8', 'fortran_order': True, 'shape': (2, 3, 2), }";
    file.extend(format!("{header:<117}\n").into_bytes());
    file.extend((0..12).flat_map(|x| f64::from(x).to_le_bytes()));
    let frame = || npy::Frame {
        low: [0.0; 3],
        high: [1.0; 3],
        axes: 2,
        factor: 1.0,
        quantity: Quantity::Discharge,
        porosity: &|_, _| 0.25,
    };
    let read = |file: Vec<u8>| npy::array(&file).and_then(|array| npy::centred(&array, &frame())).is_ok();
    assert!(read(file.clone()));
    let n_read = try_all(&file, 20_000, read);
    assert!((1000..19_000).contains(&n_read), "{n_read}");
}

#[test]
fn tables_of_text() {
    let mut text = String::from("x,y,qx,\"qy\"\n");
    for row in 0..20 {
        text += &format!("{},{},1.5e-3,\"-0.25\"\n", row / 5, row % 5);
    }
    let read = |file: Vec<u8>| csv::flow(&file, &layout(), &FRAME).is_ok();
    assert!(read(text.clone().into_bytes()));
    let n_read = try_all(text.as_bytes(), 20_000, read);
    assert!((500..19_000).contains(&n_read), "{n_read}");
}

#[test]
fn tables_of_parquet() {
    let file = super::table_tests::sound(vec![Some(5.0); 4], ::parquet::basic::Compression::SNAPPY);
    let read = |file: Vec<u8>| parquet::flow(file, &layout(), &FRAME).is_ok();
    assert!(read(file.clone()));
    let n_read = try_all(&file, 10_000, read);
    assert!((500..9500).contains(&n_read), "{n_read}");
}
