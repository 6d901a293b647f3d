//! Maps in a report: means over replicates, and bins that no replicate fills.

// Errors are for the tests of tables.
#[allow(dead_code)]
mod common;

use lamella::engine::snapshot::{Snapshot, Values};
use lamella::plan::OutputKind;
use lamella::report::report;
use lamella::table::{Gatherer, PointRow, Shape};

const N: usize = 2 * common::N_BINS;

/// Two replicates of a map of 6 × 2 bins, 40 and 80 in the last bin, nothing elsewhere;
/// `is_empty` says which bins of which replicate hold nothing.
fn page(is_empty: impl Fn(u32, usize) -> bool) -> String {
    let mut plan = common::plan();
    plan.outputs.retain(|output| output.kind == OutputKind::Map);
    let rows: Vec<PointRow> = (0..2).map(|replicate| PointRow { replicate, ..common::point() }).collect();
    let folder = tempfile::tempdir().unwrap();
    let mut gatherer = Gatherer::create(folder.path(), &plan, &common::record(), Shape::of(&rows)).unwrap();
    for row in rows {
        let replicate = row.replicate;
        let n_particles: Vec<u64> = (0..N).map(|bin| if is_empty(replicate, bin) { 0 } else { 3 }).collect();
        let value = |bin: usize| f64::from(1 + replicate) * if bin == N - 1 { 40.0 } else { 0.0 };
        let mean = vec![(0..N).map(value).collect()];
        let values = Values::Binned { mean, standard_error: vec![vec![0.1; N]], n_particles };
        gatherer.add(&plan, row, &[Snapshot { output_idx: 0, t: 20.0, values }], Vec::new()).unwrap();
    }
    gatherer.finish(&[]).unwrap();
    report(folder.path()).unwrap().html
}

/// The colour of bins without particles.
const GREY: &str = "#CDCDCD";

/// 40 and 80 in one bin, nothing elsewhere: the colours reach from 0 to the mean, 60.
#[test]
fn a_map_is_the_mean_of_the_replicates() {
    let html = page(|_, _| false);
    assert!(html.contains("<h3>Maps</h3>") && html.contains("over 2 replicates"), "{html:.3000}");
    for text in ["B at 20 s", "x (cm)", "y (cm)", "mol/m³", "\n60\n"] {
        assert!(html.contains(text), "{text}");
    }
    assert!(!html.contains("\n80\n"), "no replicate by itself");
    assert!(!html.contains(GREY), "no bin is empty");
}

#[test]
fn a_bin_is_grey_if_no_replicate_has_a_particle_in_it() {
    let is_grey = |html: String| html.contains(GREY);
    assert!(!is_grey(page(|replicate, bin| replicate == 0 && bin == 3)));
    assert!(is_grey(page(|_, bin| bin == 3)));
}
