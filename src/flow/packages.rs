//! Packages of a MODFLOW budget against the sides that a scene gives them.
//!
//! Owns these messages (M004, N112). May use the scenario. It deliberately guesses no side: where all cells of a package
//! lie at one, it says so.

use super::files::Listed;
use crate::diagnostic::codes::{M004, N112};
use crate::diagnostic::{Diagnostic, did_you_mean};
use crate::plan::transport::FileForm;
use crate::scenario::transport::FileFlow;

/// Sides of the domain by the axis x, y, z and its end, with and without z.
const SIDES: [[&str; 6]; 2] =
    [["left", "right", "bottom", "top", "", ""], ["left", "right", "front", "back", "bottom", "top"]];

/// Names that the budget does not have, and packages at a side that nothing is said of.
pub(super) fn check(flow: &FileFlow, packages: &[Listed], has_z: bool) -> Vec<Diagnostic> {
    let FileForm::Modflow(form) = &flow.file.form else { return Vec::new() };
    let lists: Vec<&Listed> = packages.iter().filter(|package| package.n_cells > 0).collect();
    let is_called = |package: &Listed, name: &str| {
        package.name.eq_ignore_ascii_case(name) || package.kind.eq_ignore_ascii_case(name)
    };
    let mut found = Vec::new();
    for ((name, _), span) in form.sides.iter().zip(&flow.package_spans) {
        if lists.iter().any(|package| is_called(package, name)) {
            continue;
        }
        let names = lists.iter().flat_map(|package| [package.name.as_str(), package.kind.as_str()]);
        let message = Diagnostic::error(M004, format!("the budget has no package `{name}`"))
            .at(*span, "no water is listed under this name")
            .found(format!("`{name}`"))
            .expected(if lists.is_empty() {
                "no side: the budget lists no package".into()
            } else {
                shown(&lists)
            });
        found.push(match did_you_mean(name, names.filter(|name| !name.is_empty())) {
            Some(near) => message.help(format!("did you mean `{near}`?")),
            None => message,
        });
    }
    if !found.is_empty() {
        return found;
    }
    // A single cell at a side is a well as often as not.
    let is_left = |package: &&&Listed| {
        package.n_cells > 1
            && !package.has_faces
            && !form.sides.iter().any(|(name, _)| is_called(package, name))
    };
    let words = SIDES[usize::from(has_z)];
    for package in lists.iter().filter(is_left) {
        let mut touched = (0..6).filter(|&side| package.touches[side]);
        let (Some(side), None) = (touched.next(), touched.next()) else { continue };
        let (word, name) = (words[side], if package.name.is_empty() { &package.kind } else { &package.name });
        let place = flow.spans.first().copied().unwrap_or_default();
        let message = Diagnostic::remark(N112, format!("the water of package `{name}` goes through no side"))
            .at(place, format!("all {} cells of `{name}` lie at side `{word}`", package.n_cells))
            .found(format!("`{name}` ({}) with no side", package.kind))
            .expected("a side, or water that is put into cells and taken out of them as by wells")
            .help(format!("write `{word} {name}` in the braces if its water goes through that side"));
        found.push(message);
    }
    found
}

/// `WEST` (CHD), `RAIN` (RCH)
fn shown(packages: &[&Listed]) -> String {
    let one = |package: &&Listed| match package.name.is_empty() {
        true => format!("`{}`", package.kind),
        false => format!("`{}` ({})", package.name, package.kind),
    };
    packages.iter().map(one).collect::<Vec<_>>().join(", ")
}
