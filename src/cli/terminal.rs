//! What reaches the user: products on standard output, everything else on standard error.

use super::{ColorChoice, Exit, GlobalArguments, MessageFormat, Stopped};
use lamella::diagnostic::render::{self, Colour};
use lamella::diagnostic::{Diagnostic, codes};
use lamella::source::Sources;
use std::io::{ErrorKind, IsTerminal, Write};

/// The terminal as the global arguments set it.
pub(crate) struct Terminal {
    format: MessageFormat,
    colour: Colour,
    is_quiet: bool,
}

impl Terminal {
    pub(crate) fn new(global: &GlobalArguments) -> Self {
        let colour = if is_coloured(global.color) { Colour::Ansi } else { Colour::Plain };
        Self { format: global.message_format, colour, is_quiet: global.quiet }
    }

    /// The same, but only for what stops a command.
    pub(crate) fn hushed(&self) -> Self {
        Self { is_quiet: true, ..*self }
    }

    pub(crate) fn is_json(&self) -> bool {
        self.format == MessageFormat::Json
    }

    pub(crate) fn is_quiet(&self) -> bool {
        self.is_quiet
    }

    /// Writes what the command was asked for. A reader that closed the pipe has read enough.
    pub(crate) fn product(&self, text: &str) -> Result<(), Stopped> {
        let mut stdout = std::io::stdout().lock();
        let written = stdout.write_all(text.as_bytes()).and_then(|()| stdout.flush());
        match written {
            Err(error) if error.kind() != ErrorKind::BrokenPipe => Err(Stopped::new(
                Exit::Failed,
                Diagnostic::error(codes::F103, format!("cannot write to standard output: {error}")),
            )),
            _ => Ok(()),
        }
    }

    /// Tells what happened; silent with `--quiet` and where messages are for tools.
    pub(crate) fn remark(&self, text: &str) {
        if !self.is_quiet && !self.is_json() {
            write_to_stderr(&format!("{text}\n"));
        }
    }

    /// Shows what stopped a command, and how the command ends.
    pub(crate) fn stopped(&self, stopped: Stopped) -> Exit {
        self.diagnostics(&[*stopped.message], &Sources::default());
        stopped.exit
    }

    /// Shows messages in the format asked for; `--quiet` keeps those that stop the scene.
    pub(crate) fn diagnostics(&self, diagnostics: &[Diagnostic], sources: &Sources) {
        let shown: Vec<Diagnostic> = diagnostics
            .iter()
            .filter(|diagnostic| !self.is_quiet || diagnostic.is_fatal())
            .cloned()
            .collect();
        match self.format {
            MessageFormat::Text => write_to_stderr(&render::text(&shown, sources, self.colour)),
            MessageFormat::Json => write_to_stderr(&render::json(&shown, sources)),
        }
    }
}

/// If standard error is gone there is nobody left to tell.
fn write_to_stderr(text: &str) {
    let _ = std::io::stderr().lock().write_all(text.as_bytes());
}

fn is_coloured(choice: ColorChoice) -> bool {
    match choice {
        ColorChoice::Always => true,
        ColorChoice::Never => false,
        ColorChoice::Auto => {
            let is_forbidden = std::env::var_os("NO_COLOR").is_some_and(|value| !value.is_empty());
            let is_dumb = std::env::var_os("TERM").is_some_and(|value| value == "dumb");
            !is_forbidden && !is_dumb && std::io::stderr().is_terminal()
        }
    }
}
