//! From a path to a plan; what `check`, `plan` and `run` have in common.

use super::files::{display_name, read_scene};
use super::{Stopped, machine};
use lamella::Checked;
use lamella::plan::compile::{Options, Selection};
use lamella::scenario::Settings;
use lamella::source::Sources;
use std::path::Path;

/// Reads a scene and takes it as far as it goes.
pub(crate) fn load(path: &Path, settings: &Settings, without_passes: bool) -> Result<Checked, Stopped> {
    let text = read_scene(path)?;
    let passes = if without_passes { Selection::None } else { Selection::All };
    let options = Options { passes, memory: machine::available_memory() };
    Ok(lamella::check(Sources::single(display_name(path), text), settings, &options))
}

/// `name=value` of `--set`, as it was typed; the value is an expression of the language.
pub(crate) fn parse_setting(text: &str) -> Result<(String, String), String> {
    match text.split_once('=') {
        Some((name, value)) if !name.trim().is_empty() && !value.trim().is_empty() => {
            Ok((name.to_owned(), value.to_owned()))
        }
        _ => Err("expected name=value, such as v=2cm/s".to_owned()),
    }
}
