//! Interpolation against closed forms, at and beyond the rows.

use super::{Beyond, Lookup, Rule, Table};

fn plane() -> Table {
    // 1 + 2 x − y + 3 x y on an uneven grid: bilinear, so that interpolation is exact.
    let axes = vec![vec![0.0, 1.0, 4.0], vec![-1.0, 0.5, 2.0, 3.0]];
    let f = |x: f64, y: f64| 1.0 + 2.0 * x - y + 3.0 * x * y;
    let values = axes[0].iter().flat_map(|&x| axes[1].iter().map(move |&y| f(x, y))).collect();
    Table::new(axes, values, Rule::Linear).expect("a table")
}

#[test]
fn bilinear_functions_are_met_exactly() {
    let table = plane();
    for (x, y) in [(0.0, -1.0), (4.0, 3.0), (0.3, 0.4), (2.5, 2.75), (1.0, 0.5), (3.999, -0.999)] {
        let value = table.value([x, y, 0.0]);
        let expected = 1.0 + 2.0 * x - y + 3.0 * x * y;
        // Four products and sums of numbers below 50.
        assert!((value - expected).abs() < 1e-13, "{value} at {x}, {y}");
        if x < 4.0 && y < 3.0 {
            let slopes = [table.slope(0, [x, y, 0.0]), table.slope(1, [x, y, 0.0])];
            let own = [2.0 + 3.0 * y, 3.0 * x - 1.0];
            // A slope is a difference over a spacing of 1 or more.
            assert!((slopes[0] - own[0]).abs() < 1e-13 && (slopes[1] - own[1]).abs() < 1e-13, "{slopes:?}");
        }
    }
}

#[test]
fn three_coordinates_are_met_exactly_at_rows_and_between() {
    let axes = vec![vec![0.0, 2.0], vec![0.0, 1.0, 3.0], vec![5.0, 6.0]];
    let f = |x: f64, y: f64, z: f64| x * y * z + z;
    let mut values = Vec::new();
    for &x in &axes[0] {
        for &y in &axes[1] {
            values.extend(axes[2].iter().map(|&z| f(x, y, z)));
        }
    }
    let table = Table::new(axes, values, Rule::Linear).expect("a table");
    for at in [[0.0, 3.0, 6.0], [1.0, 2.0, 5.5], [2.0, 0.25, 5.0]] {
        // Eight products and sums of numbers below 50.
        assert!((table.value(at) - f(at[0], at[1], at[2])).abs() < 1e-13);
        assert!((table.slope(2, at) - if at[2] < 6.0 { at[0] * at[1] + 1.0 } else { 0.0 }).abs() < 1e-13);
    }
}

#[test]
fn beyond_the_rows_the_edge_holds_or_nothing_is_there() {
    let table = plane();
    assert_eq!(table.value([-7.0, 0.5, 0.0]), table.value([0.0, 0.5, 0.0]));
    assert_eq!(table.value([9.0, 9.0, 0.0]), table.value([4.0, 3.0, 0.0]));
    assert_eq!(table.slope(0, [9.0, 0.5, 0.0]), 0.0);
    assert!(table.value([f64::NAN, 0.5, 0.0]).is_nan());
    assert!(table.look(Lookup::Value, [4.001, 0.5, 0.0], Beyond::Nothing).is_nan());
    assert_eq!(table.look(Lookup::Value, [4.0, 3.0, 0.0], Beyond::Nothing), table.value([4.0, 3.0, 0.0]));
    assert_eq!(table.extent(0), (-0.5, 5.5));
}

/// Rows at the middles of cells speak of the whole domain, although half a spacing is rounded.
#[test]
fn middles_of_cells_reach_to_the_sides() {
    let middles = (0..1000).map(|row| (f64::from(row) + 0.5) * 0.01).collect();
    let table = Table::new(vec![middles], vec![1.0; 1000], Rule::Linear).expect("a table");
    assert!(table.speaks_of(0, 0.0, 10.0));
    assert!(!table.speaks_of(0, -1e-6, 10.0) && !table.speaks_of(0, 0.0, 10.000_001));
}

#[test]
fn steps_hold_from_their_row_on() {
    let table = Table::new(vec![vec![0.0, 2.0, 3.0]], vec![5.0, 7.0, 1.0], Rule::Steps).expect("a table");
    let at = |t: f64| table.value([t, 0.0, 0.0]);
    assert_eq!([at(0.0), at(1.999), at(2.0), at(2.5), at(3.0), at(1e9)], [5.0, 5.0, 7.0, 7.0, 1.0, 1.0]);
    assert_eq!(table.slope(0, [2.0, 0.0, 0.0]), 0.0);
    assert_eq!(table.extent(0), (0.0, f64::INFINITY));
    assert_eq!(table.range(), (1.0, 7.0));
}

#[test]
fn what_is_no_table_is_told() {
    let new = |axes, values, rule| Table::new(axes, values, rule).is_err();
    assert!(new(vec![vec![0.0, 0.0]], vec![1.0, 2.0], Rule::Linear));
    assert!(new(vec![vec![1.0, 0.0]], vec![1.0, 2.0], Rule::Linear));
    assert!(new(vec![vec![0.0, 1.0]], vec![1.0], Rule::Linear));
    assert!(new(vec![vec![0.0, f64::NAN]], vec![1.0, 2.0], Rule::Linear));
    assert!(new(vec![vec![]], vec![], Rule::Linear));
    assert!(new(vec![], vec![1.0], Rule::Linear));
    assert!(new(vec![vec![0.0], vec![0.0]], vec![1.0], Rule::Steps));
}

#[test]
fn a_table_is_known_by_what_it_holds() {
    let table = |values: Vec<f64>, rule| Table::new(vec![vec![0.0, 1.0]], values, rule).expect("a table");
    let hash = |values, rule| table(values, rule).hash().to_owned();
    assert_eq!(hash(vec![0.0, 2.0], Rule::Linear), hash(vec![-0.0, 2.0], Rule::Linear));
    assert_ne!(hash(vec![0.0, 2.0], Rule::Linear), hash(vec![0.0, 2.0], Rule::Steps));
    assert_ne!(hash(vec![0.0, 2.0], Rule::Linear), hash(vec![0.0, 3.0], Rule::Linear));
}
