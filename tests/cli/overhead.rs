//! What a run costs beyond its engine: reading the scene, planning, references, tables and the figure.

use crate::program::Folder;
use lamella::table::read;
use std::time::Instant;

/// Wall seconds of the program and of its engine.
fn times(folder: &Folder) -> (f64, f64) {
    let start = Instant::now();
    folder.lamella(&["run", "gramling.lam", "--out", "out", "--plot"]).exits(0);
    let whole = start.elapsed().as_secs_f64();
    assert!(folder.read("out/figure.svg").contains("<svg"));
    let points = read::points(&folder.path("out/points.parquet")).expect("the table of points");
    (whole, points[0].wall)
}

/// From the start of the program to the figure on disk: less than 3 % above the engine's time, and half
/// a second. This is the only test of times: both clocks run in one program at the same time, and the
/// best of three runs counts, so that a machine that stands still does not fail it.
#[test]
fn planning_tables_and_figure_cost_little_beside_the_engine() {
    let folder = Folder::new();
    folder.write("gramling.lam", include_str!("../../experiments/gramling/gramling.lam"));
    let mut seen = Vec::new();
    for _ in 0..3 {
        let (whole, engine) = times(&folder);
        assert!(engine > 0.0 && whole > engine, "{whole} s and {engine} s");
        println!("whole {whole:.3} s, engine {engine:.3} s, beside it {:.3} s", whole - engine);
        if whole < 1.03 * engine + 0.5 {
            return;
        }
        seen.push((whole, engine));
    }
    panic!("seconds of the program and of its engine: {seen:?}");
}
