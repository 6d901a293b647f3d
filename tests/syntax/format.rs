//! The layout: fixed points, and nothing changed but blanks.

use crate::{FORMS, GRAMLING, scenes, shape};
use lamella::source::FileId;
use lamella::syntax::{format, parse};

pub fn formatted(text: &str) -> String {
    format(&parse(FileId(0), text).0, text)
}

#[test]
fn a_second_time_changes_nothing_and_the_tree_stays() {
    for (name, text) in scenes() {
        let once = formatted(&text);
        assert_eq!(formatted(&once), once, "{name}");
        assert_eq!(shape(&once), shape(&text), "{name}");
    }
}

/// The language description's own scene differs from the layout only in where its comments and the
/// columns `in` and documentation stand.
#[test]
fn the_first_scene_keeps_its_looks() {
    let squeeze = |line: &str| line.split_whitespace().collect::<Vec<_>>().join(" ");
    let result = formatted(GRAMLING);
    let squeezed: Vec<_> = result.lines().map(squeeze).collect();
    assert_eq!(squeezed, GRAMLING.lines().map(squeeze).collect::<Vec<_>>());
    let n_same = result.lines().zip(GRAMLING.lines()).filter(|(ours, theirs)| ours == theirs).count();
    assert!(n_same >= GRAMLING.lines().count() - 10, "{result}");
}

#[test]
fn forms_are_laid_out() {
    insta::assert_snapshot!(formatted(FORMS));
}

#[test]
fn blanks_become_regular() {
    let cases = [
        ("param  a=1e-3   /s in 0/s..1/s\"doc\"", "param a = 1e-3 /s in 0 /s .. 1 /s \"doc\"\n"),
        ("let a=-x^ -2*( b+c )", "let a = -x^-2*(b + c)\n"),
        ("let a = 2 m ^ 2 / d", "let a = 2 m ^ 2 / d\n"),
        ("let a = 1/tau + 2/ d + 3 /d+4 %", "let a = 1/tau + 2 / d + 3 /d + 4 %\n"),
        ("let a = x^2/s + x ^ 2 /s", "let a = x^2/s + x^2 / s\n"),
        ("let a = f( -b,c0=d ) - -e", "let a = f(-b, c0 = d) - -e\n"),
        ("flow uniform (v,0 m/s)", "flow uniform (v, 0 m/s)\n"),
        ("dispersion ((a,b),(b,c))", "dispersion ((a, b), (b, c))\n"),
        ("reaction r:A+2B->C@k", "reaction r: A + 2 B -> C @ k\n"),
        (
            "mixing zones {fast:fraction 1,rate instant;}",
            "mixing zones { fast: fraction 1, rate instant; }\n",
        ),
        ("\n\nseed 1\n\n\n\nseed 2   # c  \r\n\r\n", "seed 1\n\nseed 2  # c\n"),
        ("let a = b +\n      c\n# d", "let a = b +\n  c\n# d\n"),
    ];
    for (text, expected) in cases {
        assert_eq!(formatted(text), expected);
    }
}

#[test]
fn comments_inside_a_sweep_stay_where_they_belong() {
    let text = "sweep s {\n# first\n  step 1 s,2 s   # why\n      zip {\n# second\n bins 1,2 # here\n\n\n  \
                D 1,2\n}   # zipped\n  # last\n}\n# after\n";
    let expected = "sweep s {\n  # first\n  step 1 s, 2 s  # why\n  zip {\n    # second\n    bins 1, 2  # here\n\n    \
                    D 1, 2\n  }  # zipped\n  # last\n}\n# after\n";
    assert_eq!(formatted(text), expected);
    assert_eq!(formatted(expected), expected);
    // A line that goes on with its list is indented by what is open, and stays a line.
    let text = "sweep s {\nstep 1 s,\n2 s, # more\n3 s\n}\n";
    assert_eq!(formatted(text), "sweep s {\n  step 1 s,\n    2 s,  # more\n    3 s\n}\n");
}

#[test]
fn broken_statements_stay_as_they_are() {
    let text = "let  a =\nlet  b  =  ( 2\n  # inside\n   3 )\nlet c =  1\n";
    assert_eq!(formatted(text), "let  a =\nlet  b  =  ( 2\n  # inside\n   3 )\nlet c = 1\n");
}
