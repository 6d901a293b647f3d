//! Damaged files end in an error or in a table, and never in a panic.

use super::{Column, DataFile, Rule};
use crate::units::Unit;
use proptest::prelude::*;

fn columns() -> Vec<Column> {
    ["x", "y", "c"].map(|name| Column { name: name.to_owned(), unit: Unit::ONE }).to_vec()
}

/// What a run would do with a file: read it over one and two coordinates, and ask it anywhere.
fn use_all(bytes: Vec<u8>) {
    let file = DataFile::new("f", bytes);
    for (n_axes, rule) in [(1, Rule::Linear), (1, Rule::Steps), (2, Rule::Linear)] {
        let Ok(table) = file.table(&columns(), n_axes, 2, rule) else { continue };
        for x in [f64::NEG_INFINITY, -1.0, 0.0, 0.5, 3.0, 1e300, f64::INFINITY, f64::NAN] {
            let value = table.value([x, x, x]);
            let (low, high) = table.range();
            // Weights of a corner may add up to one and a rounding.
            let slack = 1e-12 * low.abs().max(high.abs());
            assert!(value.is_nan() == x.is_nan() && !(value < low - slack || value > high + slack));
            (0..n_axes).for_each(|axis| assert!(!table.slope(axis, [0.5; 3]).is_nan()));
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]

    #[test]
    fn texts(text in "(([-+]?[0-9.eE]{0,5}|nan|x|y|c|\"[0-9\n]{0,3}\"?)[,;\t]){0,4}[0-9]{0,3}[\r\n#]{0,2}([0-9.,;\n-]{0,60})") {
        use_all(text.into_bytes());
    }

    #[test]
    fn bytes(bytes in proptest::collection::vec(any::<u8>(), 0..200), is_parquet in any::<bool>()) {
        let head = if is_parquet { b"PAR1".to_vec() } else { b"x,y,c\n".to_vec() };
        use_all([head, bytes].concat());
    }

    #[test]
    fn grids(xs in proptest::collection::vec((0_u8..4, 0_u8..4, -9_i8..9), 1..20)) {
        let rows: Vec<String> = xs.iter().map(|(x, y, c)| format!("{x},{y},{c}\n")).collect();
        use_all(rows.concat().into_bytes());
    }
}
