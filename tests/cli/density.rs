//! `lamella density`: points of any table become a density, or one clear sentence.

use crate::program::Folder;
use lamella::data::{Column, DataFile};
use lamella::units::Unit;

/// Points of a normal density: quantiles along x, spread evenly by the golden mean along y.
fn points(n: usize) -> String {
    let mut text = "x,y,m,name\n".to_owned();
    for i in 0..n {
        let p = (i as f64 + 0.5) / n as f64;
        // The logistic distribution has a closed quantile.
        let quantile = |p: f64| lamella::maths::scalar::ln(p / (1.0 - p));
        let y = (i as f64 * 0.618_033_988_749_894_9).fract();
        text +=
            &format!("{},{},{},a\n", 50.0 + 4.0 * quantile(p), 20.0 + 2.0 * quantile(y.max(1e-9)), 0.5 + p);
    }
    text
}

fn columns(path: &std::path::Path, wanted: &[&str]) -> Vec<Vec<f64>> {
    let file = DataFile::new("density", std::fs::read(path).expect("the table"));
    let column = |name: &&str| Column { name: (*name).to_owned(), unit: Unit::ONE };
    let wanted: Vec<Column> = wanted.iter().map(column).collect();
    file.columns(&wanted).expect("columns of numbers").numbers.clone()
}

const DOMAIN: [&str; 4] = ["--domain", "0..100, 0..40", "--cells", "200,80"];

#[test]
fn points_of_a_text_file_become_a_density() {
    let folder = Folder::new();
    folder.write("points.csv", points(4000));
    let mut arguments = vec!["density", "points.csv", "--out", "density.parquet", "--weight", "m"];
    arguments.extend(DOMAIN);
    folder.lamella(&arguments).exits(0).gives("loops, settled").gives("density.parquet");
    let found =
        columns(&folder.path("density.parquet"), &["x", "y", "density", "standard_error", "n_particles"]);
    assert_eq!(found[0].len(), 200 * 80);
    assert_eq!((found[0][0], found[1][0], found[1][1]), (0.25, 0.25, 0.75));
    let mass: f64 = found[2].iter().sum::<f64>() * 0.25;
    let inside: f64 = found[4].iter().sum();
    // Some of the logistic tails lie outside.
    assert!(inside > 3990.0 && inside <= 4000.0, "{inside}");
    assert!((mass / 4000.0 - 1.0).abs() < 5e-3, "{mass}");
    let middle = 100 * 80 + 40;
    // Density of two logistic ones at their centres, 4000/(4·4 · 4·2).
    assert!((found[2][middle] / 31.25 - 1.0).abs() < 0.15, "{}", found[2][middle]);
    assert!(found[3][middle] > 0.0 && found[3][middle] < 0.1 * found[2][middle], "{}", found[3][middle]);

    // The same bytes on more threads; other kernels, other bytes.
    let bytes = |name: &str| std::fs::read(folder.path(name)).expect("the table");
    for (more, is_same) in
        [(vec!["--threads", "3"], true), (vec!["--kernel", "round"], false), (vec!["--exact"], false)]
    {
        let mut arguments = vec!["density", "points.csv", "--out", "other.parquet", "--weight", "m"];
        arguments.extend(DOMAIN);
        arguments.extend(more.clone());
        folder.lamella(&arguments).exits(0);
        assert_eq!(bytes("other.parquet") == bytes("density.parquet"), is_same, "{more:?}");
    }
}

/// All kernels keep what is inside, and say how wide they are.
#[test]
fn there_are_other_kernels() {
    let folder = Folder::new();
    folder.write("points.csv", points(2000));
    for kernel in ["adaptive", "round", "plug_in", "normal_reference", "histogram"] {
        let mut arguments =
            vec!["density", "points.csv", "--out", "d.parquet", "--kernel", kernel, "--nonzero"];
        arguments.extend(DOMAIN);
        folder.lamella(&arguments).exits(0);
        let found = columns(&folder.path("d.parquet"), &["density", "n_particles"]);
        let [mass, inside] = [0.25 * found[0].iter().sum::<f64>(), found[1].iter().sum::<f64>()];
        assert!((mass / inside - 1.0).abs() < 1e-12, "{kernel}: {mass} of {inside}");
        assert!(found[0].iter().all(|density| *density > 0.0), "{kernel}");
    }
}

/// Where nothing stays, what is beyond the ends is told.
#[test]
fn what_ends_absorb_is_told() {
    let folder = Folder::new();
    folder.write("points.csv", points(500));
    let of = |ends: &str| {
        let mut arguments = vec!["density", "points.csv", "--out", "d.parquet", "--ends", ends];
        arguments.extend(["--domain", "48..100, 0..40", "--cells", "104,80"]);
        folder.lamella(&arguments).exits(0)
    };
    of("absorb").gives("% of the weight is beyond ends that absorb");
    of("reflect:absorb,reflect").gives("outside of the domain are left out");
    of("reflect").gives("settled").gives("outside of the domain are left out");
}

/// Ends hold a density, in its unit: it is found there.
#[test]
fn ends_hold_a_density() {
    let folder = Folder::new();
    // Even points on a kilometre: 1.6 per metre.
    let points: String = (0..1600).map(|i| format!("{}\n", (f64::from(i) + 0.5) / 1600.0)).collect();
    folder.write("points.csv", format!("x\n{points}"));
    let of = |ends: &str| {
        let arguments =
            ["density", "points.csv", "--out", "d.parquet", "--domain", "0..1 km", "--cells", "400"];
        folder.lamella(&[&arguments[..], &["--ends", ends]].concat()).exits(0);
        columns(&folder.path("d.parquet"), &["density"]).remove(0)
    };
    for (ends, expected) in [
        ("hold 1.6 m^-1", [1.6, 1.6]),
        ("hold 3.2 m^-1:hold 800 km^-1", [3.2, 0.8]),
        ("hold 1.6:reflect", [1.6, 1.6]),
    ] {
        let found = of(ends);
        for (own, expected) in [found[0], found[399]].into_iter().zip(expected) {
            assert!((own / expected - 1.0).abs() < 0.05, "{ends}: {own} for {expected}");
        }
    }
}

/// A table of ours says its units; a scene's particles are points of a density.
#[test]
fn points_have_units() {
    let folder = Folder::new();
    folder.write("points.csv", points(300));
    let mut arguments = vec!["density", "points.csv", "--out", "a.parquet", "--cells", "200,80"];
    let plain = [arguments.clone(), vec!["--domain", "0..100, 0..40"]].concat();
    folder.lamella(&plain).exits(0);
    arguments[3] = "b.parquet";
    folder.lamella(&[arguments, vec!["--domain", "0..100 cm, 0..40 cm"]].concat()).exits(0);
    let read = |name: &str| columns(&folder.path(name), &["density"]).remove(0);
    let (plain, metres) = (read("a.parquet"), read("b.parquet"));
    for (plain, metres) in plain.iter().zip(metres).filter(|(plain, _)| **plain > 1e-6) {
        assert!((metres / plain / 1e4 - 1.0).abs() < 1e-6, "{metres}, {plain}");
    }
}

/// Particles of a run, of one species at one time; units are those that the table says.
#[test]
fn particles_of_a_run_have_a_density() {
    let folder = Folder::new();
    folder.write(
        "two.lam",
        "lamella 1\nspecies A, B\ndomain rect x = 0 .. 100 m, y = 0 .. 40 m\nmedium porosity 0.3\n\
         flow velocity = (0.5 m/d, 0)\ndispersion longitudinal 0.5 m, transverse 0.1 m, molecular 0\n\
         boundary left, right outflow\nboundary top, bottom reflect\n\
         source one: A = 1 mol/m in box(20 .. 22 m, 18 .. 22 m)\n\
         source two: B = 2 mol/m in box(40 .. 42 m, 18 .. 22 m)\n\
         particles mass A 2_000, B 3_000\nrun to 40 d, step 1 d\noutput particles A, B at t = 20 d, 40 d\n",
    );
    folder.lamella(&["run", "two.lam", "--out", "r"]).exits(0);
    let of = |domain: &str, more: &[&str]| {
        let mut arguments = vec!["density", "r/particles/part-0000.parquet", "--out", "d.parquet"];
        arguments.extend(["--domain", domain, "--cells", "100,40", "--weight", "concentration"]);
        arguments.extend(more);
        folder.lamella(&arguments)
    };
    let late = ["--where", "t=3456000", "--where"];
    for (species, amount, centre) in [("species=A", 1.0, 41.0), ("species=B", 2.0, 61.0)] {
        of("0..100 m, 0..40 m", &[&late[..], &[species]].concat()).exits(0);
        let file = DataFile::new("d", std::fs::read(folder.path("d.parquet")).expect("the table"));
        let wanted = ["x", "density"].map(|name| Column { name: name.to_owned(), unit: Unit::ONE });
        let found = file.columns(&wanted).expect("columns");
        let (x, density) = (&found.numbers[0], &found.numbers[1]);
        let all: f64 = density.iter().sum();
        assert!((all / amount - 1.0).abs() < 1e-9, "{species}: {all}");
        let mean = x.iter().zip(density).map(|(x, density)| x * density).sum::<f64>() / all;
        // Means of 2000 places that spread by 4.5 m.
        assert!((mean - centre).abs() < 0.4, "{species}: {mean}");
    }
    of("0..100 m, 0..40 m", &["--where", "species=Q"]).exits(2).says("no row has all that --where asks for");
    of("0..100 s, 0..40 s", &[]).exits(2).says("column `x` is in m, and --domain says s");
}

/// Kernels follow a direction that is given, or that columns of velocity have; the table says which, and how wide they are.
#[test]
fn kernels_follow_directions() {
    let folder = Folder::new();
    // Denser from corner to corner; all cells have points, so that no row is without a kernel. Upstream of x = 4 nothing moves.
    let mut text = "x,y,u,v\n".to_owned();
    for i in 0..64 {
        for k in 0..1 + 6 / (1 + (i / 8 - i % 8_i32).unsigned_abs()) {
            let (x, y) = (f64::from(i / 8) + 0.5, f64::from(i % 8) + 0.5);
            let speed = if x < 4.0 { 0.0 } else { 1.0 + f64::from(k) };
            text += &format!("{x},{y},{},{}\n", 3.0 * speed, 4.0 * speed);
        }
    }
    folder.write("points.csv", text);
    let of = |more: &[&str]| {
        let arguments =
            ["density", "points.csv", "--out", "d.parquet", "--domain", "0..8, 0..8", "--cells", "8,8"];
        folder.lamella(&[&arguments, more].concat()).exits(0);
        let kernels = ["density", "bandwidth_along", "bandwidth_across"];
        columns(&folder.path("d.parquet"), &kernels)
    };
    let [angle, components] = [&["--direction", "45deg"][..], &["--direction", "-2,-2"]].map(of);
    for (own, other) in angle.iter().flatten().zip(components.iter().flatten()) {
        assert!((own / other - 1.0).abs() < 1e-9, "{own}, {other}");
    }
    let mass: f64 = angle[0].iter().sum();
    assert!((mass - (mass.round())).abs() < 1e-10 * mass, "{mass}");
    assert!(angle[1][36] > 1.02 * angle[2][36], "{} along, {} across", angle[1][36], angle[2][36]);
    let directions = columns(&folder.path("d.parquet"), &["direction_x", "direction_y"]);
    assert!(directions.iter().flatten().all(|part| (part.abs() - 0.5_f64.sqrt()).abs() < 1e-12));
    let file = std::fs::read(folder.path("d.parquet")).expect("the table");
    assert!(file.windows(24).any(|own| own == br#""direction":["-2","-2"],"#.as_slice()));

    // Where nothing moves kernels are round, and have no direction.
    let found = of(&["--velocity", "u,v"]);
    for (idx, (along, across)) in found[1].iter().zip(&found[2]).enumerate() {
        assert_eq!(along == across, idx < 32, "cell {idx}: {along}, {across}");
    }
}

#[test]
fn what_is_wrong_is_said_in_one_sentence() {
    let folder = Folder::new();
    folder.write("points.csv", "x,y\n1,2\n3,oops\n");
    folder.write("heavy.csv", "x,m\n1,2\n3,-1\n");
    folder.write("far.csv", "x\n1000\n");
    let cases: [(&[&str], i32, &str); 16] = [
        (&["points.csv", "--domain", "0..1", "--cells", "4,4"], 2, "--cells has 2 numbers for 1 axes"),
        (&["points.csv", "--domain", "0..1,0..1", "--cells", "4,4"], 2, "line 3"),
        (&["points.csv", "--domain", "0..1", "--cells", "0"], 2, "1 to 100 million cells"),
        (&["points.csv", "--domain", "0..1", "--cells", "18446744073709551615"], 2, "1 to 100 million cells"),
        (&["points.csv", "--domain", "1..0", "--cells", "4"], 2, "is empty"),
        (&["points.csv", "--domain", "0..1 parsec", "--cells", "4"], 2, "no unit"),
        (&["points.csv", "--domain", "0..1", "--cells", "4", "--columns", "depth"], 2, "depth"),
        (
            &["heavy.csv", "--domain", "0..9", "--cells", "4", "--weight", "m"],
            2,
            "a weight is below zero (line 3",
        ),
        (
            &["far.csv", "--domain", "0..9", "--cells", "4"],
            2,
            "no point with a weight lies within the domain",
        ),
        (&["far.csv", "--domain", "0..9 m,0..9 s", "--cells", "4,4", "--columns", "x,x"], 2, "of one kind"),
        (&["far.csv", "--domain", "0..9,0..9", "--cells", "4,4", "--columns", "x,x"], 2, "twice"),
        (
            &["far.csv", "--domain", "0..9", "--cells", "4", "--columns", "density"],
            2,
            "`density` is a column of the result",
        ),
        (&["far.csv", "--domain", "0..9 m", "--cells", "4", "--bandwidth", "1..2 s"], 2, "--bandwidth"),
        (&["far.csv", "--domain", "0..9", "--cells", "4", "--kernel", "histogram", "--exact"], 2, "--exact"),
        (&["far.csv", "--domain", "0..9", "--cells", "4", "--tolerance", "nan"], 2, "tolerance"),
        (&["nowhere.csv", "--domain", "0..9", "--cells", "4"], 2, "nowhere.csv"),
    ];
    folder
        .lamella(&["density", "far.csv", "--domain", "0..9", "--cells", "4", "--out", "far.csv"])
        .exits(2)
        .says("parquet");
    for (arguments, code, text) in &cases {
        let arguments = [&["density"], *arguments, &["--out", "density.parquet"]].concat();
        folder.lamella(&arguments).exits(*code).says(text);
        assert!(!folder.path("density.parquet").exists());
    }
}

#[test]
fn directions_and_ends_that_are_none_are_refused() {
    let folder = Folder::new();
    folder.write("near.csv", "x,z\n1,1\n5,5\n");
    let plane = ["near.csv", "--domain", "0..9,0..9", "--cells", "4,4", "--columns", "x,z"];
    let of_plane = |more: &[&'static str]| [&plane, more].concat();
    let directions: [(Vec<&str>, &str); 12] = [
        (
            vec!["near.csv", "--domain", "0..9", "--cells", "4", "--direction", "1"],
            "on a line there is one direction",
        ),
        (of_plane(&["--ends", "hold"]), "`hold` is no end"),
        (of_plane(&["--ends", "hold -1"]), "a number of zero or more"),
        (of_plane(&["--ends", "hold 1 kg/m^2"]), "an end holds a density in kg/m^2"),
        (of_plane(&["--ends", "reflect:periodic"]), "both are periodic, or none"),
        (of_plane(&["--ends", "hold 1", "--kernel", "histogram"]), "--ends hold is for kernels that differ"),
        (of_plane(&["--direction", "north"]), "`north` is no angle"),
        (of_plane(&["--direction", "1,2,3"]), "--direction has 3 components for 2 axes"),
        (of_plane(&["--direction", "0,0"]), "zero length"),
        (of_plane(&["--velocity", "x"]), "--velocity has 1 columns for 2 axes"),
        (of_plane(&["--direction", "1,0", "--kernel", "round"]), "for --kernel adaptive"),
        (of_plane(&["--direction", "1,0", "--velocity", "x,z"]), "cannot be used with"),
    ];
    for (arguments, text) in directions {
        folder
            .lamella(&[&["density"], &arguments[..], &["--out", "density.parquet"]].concat())
            .exits(2)
            .says(text);
    }
}
