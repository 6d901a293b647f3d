//! `lamella completions`: a completion script for a shell.

use super::{CommandResult, Exit, Terminal};
use clap::CommandFactory;

/// Write a completion script for a shell to standard output
#[derive(clap::Args)]
pub(crate) struct Arguments {
    #[arg(value_enum)]
    shell: clap_complete::Shell,
}

pub(crate) fn run(arguments: &Arguments, terminal: &Terminal) -> CommandResult {
    let mut script = Vec::new();
    clap_complete::generate(arguments.shell, &mut super::Arguments::command(), "lamella", &mut script);
    terminal.product(&String::from_utf8_lossy(&script))?;
    Ok(Exit::Done)
}
