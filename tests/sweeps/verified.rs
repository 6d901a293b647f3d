//! What `verify` compares, and that it says so where nothing was compared.

use crate::program::{Folder, finish};
use crate::scene_with;
use lamella::sweep::Journal;

const JOURNAL: &str = "out/journal/shard-0000-of-0001.journal";

/// Four replicates, with a measure of the clock.
const SWEEP: &str = "  D 1e-4 m^2/s, 1e-3 m^2/s\n  replicates 2";

fn text() -> String {
    format!("{}\nmeasure pace = 2 * wall_time\n", scene_with(SWEEP))
}

fn run_once() -> Folder {
    let folder = Folder::new();
    folder.write("s.lam", text());
    folder.lamella(&["sweep", "s.lam", "--out", "out"]).exits(0).says("4 replicates run");
    folder
}

/// Errors stand in the journal as they were when the point ran; what counts is today's reference.
#[test]
fn an_edited_reference_is_no_difference() {
    let folder = run_once();
    folder.lamella(&["verify", "out"]).exits(0).gives("4 replicates run again: the same bytes");
    folder.write("s.lam", text().replace("0.5 * c0 * erfc", "0.6 * c0 * erfc"));
    folder.lamella(&["sweep", "s.lam", "--out", "out"]).exits(0).says("0 replicates run, 4 known");
    let verified = folder.lamella(&["verify", "out"]).exits(0);
    verified.gives("4 replicates run again: the same bytes").gives("tables: what the journals give");
}

#[test]
fn what_is_missing_is_counted() {
    let folder = run_once();
    folder.write("s.lam", text().replace("replicates 2", "replicates 3"));
    // Shard 0 of 2 has point 0 alone: point 1 keeps its two replicates.
    folder.lamella(&["sweep", "s.lam", "--shard", "0/2", "--out", "out"]).exits(0);
    folder.lamella(&["gather", "out"]).exits(1);
    let verified = folder.lamella(&["verify", "out"]).exits(1).says("[F123]");
    let verified = verified.says("1 replicates of the sweep are missing").says("missing 1/2");
    verified.gives("5 replicates run again: the same bytes").gives("1 replicates missing");
    // A rule that no number of replicates meets asks for all of them.
    let until = "replicates 2 .. 4 until stderr(err) < 0.0000001 % of mean(err)";
    folder.write("s.lam", text().replace("replicates 2", until));
    folder.lamella(&["sweep", "s.lam", "--shard", "0/2", "--out", "out"]).exits(0);
    folder.lamella(&["verify", "out"]).exits(1).gives("6 replicates run again").gives("1 replicates missing");
}

#[test]
fn where_nothing_is_compared_nothing_is_verified() {
    let folder = Folder::new();
    folder.write("s.lam", text());
    let mut command = folder.command(&["sweep", "s.lam", "--out", "out"]);
    finish(command.env("LAMELLA_FAULT_EVERY", "1").output().unwrap()).exits(1);
    let verified = folder.lamella(&["verify", "out"]).exits(1).says("[F123]");
    verified.says("nothing could be compared").gives("4 replicates failed: not compared");
    folder.write("r.lam", scene_with("  D 1e-3 m^2/s, 5 m^2/s"));
    folder.lamella(&["sweep", "r.lam", "--out", "refused"]).exits(1);
    let verified = folder.lamella(&["verify", "refused"]).exits(0);
    verified.gives("1 replicates run again").gives("1 points refused before they ran: not compared");
}

#[test]
fn tables_are_compared_with_the_journals() {
    let folder = run_once();
    folder.write("other.lam", text().replace("1e-4 m^2/s", "2e-4 m^2/s"));
    folder.lamella(&["sweep", "other.lam", "--out", "other"]).exits(0);
    for name in ["total/part-0000.parquet", "points.parquet", "sweep.json", "scene.lam"] {
        let own = std::fs::read(folder.path(&format!("out/{name}"))).unwrap();
        std::fs::copy(folder.path(&format!("other/{name}")), folder.path(&format!("out/{name}"))).unwrap();
        // Without a manifest it is the content that tells.
        let _ = std::fs::remove_file(folder.path("out/manifest.json"));
        let verified = folder.lamella(&["verify", "out", "--sample", "1"]).exits(1).says("[F123]");
        verified.says(&format!("files {name}\n")).says("`lamella gather out` makes them again");
        folder.write(&format!("out/{name}"), own);
    }
    folder.lamella(&["verify", "out"]).exits(0);
    folder.write("out/total/part-0001.parquet", "of an older version");
    folder.lamella(&["verify", "out"]).exits(1).says("files total/part-0001.parquet\n");
    assert!(!folder.files().iter().any(|name| name.contains(".lamella-verify")), "{:?}", folder.files());
    // Shards without tables have none to compare.
    folder.lamella(&["sweep", "s.lam", "--shard", "0/1", "--out", "bare"]).exits(0);
    ["points.parquet", "sweep.json", "manifest.json"]
        .iter()
        .for_each(|name| std::fs::remove_file(folder.path(&format!("bare/{name}"))).unwrap());
    folder.lamella(&["verify", "bare"]).exits(0).gives("tables not made yet: not compared");
}

/// One bit of one measure in the journal, with a checksum that fits.
#[test]
fn measures_are_compared_but_for_those_of_the_clock() {
    let folder = run_once();
    let change = |name: &str, change: fn(f64) -> f64| {
        let mut journal = Journal::open(&folder.path(JOURNAL)).unwrap();
        let (_, entry) = journal.entries()[0];
        let mut replicate = journal.replicate(entry).unwrap();
        let value = replicate.row.values.iter_mut().find(|value| value.name == name).unwrap();
        value.value = value.value.map(change);
        journal.add(&replicate).unwrap();
        journal.sync().unwrap();
    };
    change("pace", |value| 2.0 * value + 1.0);
    folder.lamella(&["gather", "out"]).exits(0);
    folder.lamella(&["verify", "out"]).exits(0).gives("4 replicates run again: the same bytes");
    change("err", f64::next_up);
    folder.lamella(&["gather", "out"]).exits(0);
    let verified = folder.lamella(&["verify", "out"]).exits(1).says("[F123]");
    verified.says("1 of 4 replicates are not the same again").gives("tables: what the journals give");
}

#[test]
fn tables_without_a_journal_are_no_run() {
    let folder = run_once();
    std::fs::remove_dir_all(folder.path("out/journal")).unwrap();
    let verified = folder.lamella(&["verify", "out"]).exits(2).says("[F121]");
    verified.says("holds the tables of a sweep without their journal");
}
