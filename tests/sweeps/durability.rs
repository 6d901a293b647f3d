//! Killed, damaged, full: nothing complete is lost, nothing half is used.

use crate::program::Folder;
use crate::{assert_same, scene_with};
use std::process::Stdio;
use std::time::Duration;

/// 1,000 trivial points.
const MANY: &str = "  D  linspace(1e-4 m^2/s, 1e-3 m^2/s, 100)\n  c0 linspace(1 mol/m^3, 2 mol/m^3, 10)";

fn journal(out: &str) -> String {
    format!("{out}/journal/shard-0000-of-0001.journal")
}

/// Small steps of a fixed sequence: trials differ, and are the same every time.
fn pause(trial: u64) -> Duration {
    Duration::from_micros(2_000 + trial.wrapping_mul(6_364_136_223_846_793_005) % 250_000)
}

/// Kills a sweep at odd moments until it gets through, then compares. The rest of the trials run in
/// `make soak`.
#[test]
fn a_killed_sweep_goes_on_where_it_stopped() {
    let n_trials = if std::env::var_os("LAMELLA_SOAK").is_some() { 200 } else { 5 };
    let folder = Folder::new();
    folder.write("s.lam", scene_with(MANY));
    folder.lamella(&["sweep", "s.lam", "--out", "whole"]).exits(0);
    let mut n_killed = 0;
    for trial in 0..n_trials {
        let out = "killed";
        let _ = std::fs::remove_dir_all(folder.path(out));
        for start in 0..4 {
            let mut command = folder.command(&["sweep", "s.lam", "--out", out, "--quiet"]);
            let mut child = command.stdout(Stdio::null()).stderr(Stdio::null()).spawn().expect("it starts");
            std::thread::sleep(pause(7 * trial + start));
            n_killed += u64::from(child.try_wait().expect("it can be asked").is_none());
            child.kill().expect("it can be killed");
            child.wait().expect("it ends");
        }
        folder.lamella(&["sweep", "s.lam", "--out", out]).exits(0);
        assert_same(&folder, "whole", out);
    }
    assert!(n_killed > 0, "every sweep was through before it was killed");
}

/// What a program leaves that is killed while it writes a text.
#[test]
fn texts_that_were_not_finished_go_with_the_next_sweep() {
    let folder = Folder::new();
    folder.write("s.lam", scene_with("  D linspace(1e-4 m^2/s, 1e-3 m^2/s, 3)"));
    folder.lamella(&["sweep", "s.lam", "--out", "out"]).exits(0);
    std::fs::write(folder.path("out/.lamella.tmp-26e7AA"), "half").unwrap();
    folder.lamella(&["sweep", "s.lam", "--out", "out"]).exits(0);
    assert!(!folder.path("out/.lamella.tmp-26e7AA").exists());
}

#[test]
fn a_damaged_frame_is_named_and_run_again() {
    let folder = Folder::new();
    folder.write("s.lam", scene_with("  D linspace(1e-4 m^2/s, 1e-3 m^2/s, 20)"));
    folder.lamella(&["sweep", "s.lam", "--out", "whole"]).exits(0);
    folder.lamella(&["sweep", "s.lam", "--out", "bad"]).exits(0);
    let path = folder.path(&journal("bad"));
    let mut bytes = std::fs::read(&path).unwrap();
    let middle = bytes.len() / 2;
    bytes[middle] ^= 0x40;
    std::fs::write(&path, &bytes).unwrap();
    let again = folder.lamella(&["sweep", "s.lam", "--out", "bad"]).exits(0);
    again.says("of the journal are damaged").says("1 replicates run, 19 known");
    assert_same(&folder, "whole", "bad");
}

/// Cut anywhere: at most the last replicate is lost.
#[test]
fn a_cut_journal_loses_its_last_frame_only() {
    let folder = Folder::new();
    folder.write("s.lam", scene_with("  D linspace(1e-4 m^2/s, 1e-3 m^2/s, 5)"));
    folder.lamella(&["sweep", "s.lam", "--out", "whole"]).exits(0);
    folder.lamella(&["sweep", "s.lam", "--out", "cut"]).exits(0);
    let path = folder.path(&journal("cut"));
    let bytes = std::fs::read(&path).unwrap();
    for cut in [1, 15, 16, 17, 31, 32, 33, 100, 500] {
        std::fs::write(&path, &bytes[..bytes.len() - cut]).unwrap();
        let again = folder.lamella(&["sweep", "s.lam", "--out", "cut"]).exits(0);
        again.says("1 replicates run, 4 known");
        assert_same(&folder, "whole", "cut");
    }
    // An end that is no cut frame is told before it goes.
    let mut zeroed = bytes.clone();
    let from = bytes.len() - 300;
    zeroed[from..].fill(0);
    std::fs::write(&path, &zeroed).unwrap();
    let again = folder.lamella(&["sweep", "s.lam", "--out", "cut"]).exits(0);
    again.says("of the journal are damaged").says("1 replicates run, 4 known");
    // A file that is no journal is left alone.
    std::fs::write(&path, b"LmJ3 of another version").unwrap();
    folder.lamella(&["sweep", "s.lam", "--out", "cut"]).exits(1).says("no journal of this version");
    assert_eq!(std::fs::read(&path).unwrap(), b"LmJ3 of another version");
}

#[test]
fn a_folder_in_use_is_left_alone() {
    let folder = Folder::new();
    folder.write("s.lam", scene_with("  D 1e-4 m^2/s"));
    folder.lamella(&["sweep", "s.lam", "--out", "out"]).exits(0);
    let file = std::fs::File::open(folder.path(&journal("out"))).unwrap();
    file.lock().unwrap();
    folder.lamella(&["sweep", "s.lam", "--out", "out"]).exits(1).says("in use by another lamella");
}

#[test]
fn damaged_tables_are_named_and_made_again() {
    let folder = Folder::new();
    folder.write("s.lam", scene_with("  D linspace(1e-4 m^2/s, 1e-3 m^2/s, 5)"));
    folder.lamella(&["sweep", "s.lam", "--out", "whole"]).exits(0);
    folder.lamella(&["sweep", "s.lam", "--out", "bad"]).exits(0);
    folder.lamella(&["status", "bad"]).exits(0).gives("tables      as they were written");
    let path = folder.path("bad/profile/part-0000.parquet");
    let mut bytes = std::fs::read(&path).unwrap();
    bytes[50] ^= 1;
    std::fs::write(&path, &bytes).unwrap();
    std::fs::remove_file(folder.path("bad/columns.parquet")).unwrap();
    let status = folder.lamella(&["status", "bad"]).exits(1);
    let status =
        status.gives("profile/part-0000.parquet has other bytes").gives("columns.parquet is missing");
    status.gives("makes them again from the journals");
    folder.lamella(&["gather", "bad"]).exits(0);
    folder.lamella(&["status", "bad"]).exits(0);
    assert_same(&folder, "whole", "bad");
}

/// A small file system that runs full; only an administrator may make one.
#[test]
fn a_full_disk_loses_nothing() {
    let folder = Folder::new();
    folder.write("s.lam", scene_with(MANY));
    let disk = folder.path("disk");
    std::fs::create_dir(&disk).unwrap();
    let mount = std::process::Command::new("mount")
        .args(["-t", "tmpfs", "-o", "size=512k", "tmpfs"])
        .arg(&disk)
        .output();
    if !mount.is_ok_and(|output| output.status.success()) {
        println!("left out: this user may not mount a small file system");
        return;
    }
    let unmount = || std::process::Command::new("umount").arg(&disk).status();
    let full = folder.lamella(&["sweep", "s.lam", "--out", "disk/out"]);
    let grown = std::process::Command::new("mount").args(["-o", "remount,size=64m"]).arg(&disk).status();
    assert!(grown.is_ok_and(|status| status.success()));
    let again = folder.lamella(&["sweep", "s.lam", "--out", "disk/out"]);
    folder.lamella(&["sweep", "s.lam", "--out", "whole"]).exits(0);
    let files = crate::data_files(&folder, "disk/out");
    let facts = crate::facts(&folder, "disk/out");
    unmount().unwrap();
    full.exits(1).says("no space left on the device");
    let known = again.exits(0).stderr;
    assert!(!known.contains(", 0 known") && known.contains(" known"), "{known}");
    assert_eq!(facts, crate::facts(&folder, "whole"));
    assert!(files == crate::data_files(&folder, "whole"), "the tables differ");
}
