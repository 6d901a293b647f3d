//! `lamella new`: a documented scene to start from.

use super::files::{unwritable, write_new};
use super::{CommandResult, Exit, Terminal};
use clap::ValueEnum;
use std::path::PathBuf;

/// Write a documented scene to start from
#[derive(clap::Args)]
pub(crate) struct Arguments {
    /// Name of the scene; writes NAME.lam
    name: PathBuf,
    /// Which scene to start from
    #[arg(long, value_enum, default_value_t = Template::Gramling)]
    template: Template,
}

#[derive(Clone, Copy, ValueEnum)]
enum Template {
    /// Two solutions meet in a sand column and react at once: mixing zones, references, a figure
    Gramling,
    /// A conservative tracer front in a column, against its closed form
    Tracer,
    /// A Gaussian pulse that spreads in two dimensions, as a map
    Pulse,
}

impl Template {
    fn text(self) -> &'static str {
        match self {
            Template::Gramling => include_str!("templates/gramling.lam"),
            Template::Tracer => include_str!("templates/tracer.lam"),
            Template::Pulse => include_str!("templates/pulse.lam"),
        }
    }
}

pub(crate) fn run(arguments: &Arguments, terminal: &Terminal) -> CommandResult {
    let mut path = arguments.name.clone();
    if path.file_name().is_none() {
        return Err(unwritable(&path, "a scene needs a name, such as my_column"));
    }
    if path.extension().is_none_or(|extension| extension != "lam") {
        path.as_mut_os_string().push(".lam");
    }
    write_new(&path, arguments.template.text())?;
    let name = path.display();
    let word = super::load::shell_word(&name.to_string());
    terminal.remark(&format!("wrote {name}\nnext: lamella run {word} --plot"));
    Ok(Exit::Done)
}
