//! One definition, one set of tables: whatever the threads, the shards and the history.

use crate::program::Folder;
use crate::{assert_same, scene_with};

const SWEEP: &str = "  D 1e-9 m^2/s, 1e-4 m^2/s, 1e-3 m^2/s
  particles 100, 1000, 10000
  replicates 2 .. 5 until stderr(err) < 2 % of mean(err)";

fn with_sweep(sweep: &str) -> Folder {
    let folder = Folder::new();
    folder.write("s.lam", scene_with(sweep));
    folder
}

#[test]
fn threads_do_not_change_a_byte() {
    let folder = with_sweep(SWEEP);
    for (threads, out) in [("1", "one"), ("2", "two"), ("7", "seven")] {
        folder.lamella(&["sweep", "s.lam", "--threads", threads, "--out", out]).exits(0);
    }
    assert_same(&folder, "one", "two");
    assert_same(&folder, "one", "seven");
}

#[test]
fn shards_do_not_change_a_byte() {
    let folder = with_sweep(SWEEP);
    folder.lamella(&["sweep", "s.lam", "--out", "whole"]).exits(0);
    for n in [4, 64] {
        let out = format!("in{n}");
        // The last first, and one of them twice: nothing hangs on the order.
        for k in (0..n).rev().chain([1]) {
            folder.lamella(&["sweep", "s.lam", "--shard", &format!("{k}/{n}"), "--out", &out]).exits(0);
        }
        folder.lamella(&["gather", &out]).exits(0);
        assert_same(&folder, "whole", &out);
        // What the shards have need not run again.
        folder.lamella(&["sweep", "s.lam", "--out", &out]).exits(0).says("0 replicates run");
        assert_same(&folder, "whole", &out);
    }
}

#[test]
fn a_sweep_that_grows_is_the_sweep_that_was_whole() {
    let folder = with_sweep("  D 1e-4 m^2/s\n  replicates 2");
    folder.lamella(&["sweep", "s.lam", "--out", "grown"]).exits(0);
    let whole = scene_with("  D 1e-3 m^2/s, 1e-4 m^2/s, 1e-9 m^2/s\n  replicates 3");
    folder.write("s.lam", &whole);
    folder.lamella(&["sweep", "s.lam", "--out", "grown"]).exits(0).says("7 replicates run, 2 known");
    folder.lamella(&["sweep", "s.lam", "--out", "whole"]).exits(0).says("9 replicates run");
    assert_same(&folder, "grown", "whole");
}

/// A measure that is new is worked out from what is there.
#[test]
fn another_measure_is_no_reason_to_run_again() {
    let folder = with_sweep("  D 1e-3 m^2/s, 1e-4 m^2/s");
    folder.lamella(&["sweep", "s.lam", "--out", "a"]).exits(0);
    let more =
        format!("{}\nmeasure worst = linf(profile.A - exact)\n", scene_with("  D 1e-3 m^2/s, 1e-4 m^2/s"));
    folder.write("s.lam", &more);
    folder.lamella(&["sweep", "s.lam", "--out", "a"]).exits(0).says("0 replicates run, 2 known");
    folder.lamella(&["sweep", "s.lam", "--out", "b"]).exits(0).says("2 replicates run");
    assert_same(&folder, "a", "b");
}
