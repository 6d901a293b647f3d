//! `lamella explain`: the page of a message code, or the list of all codes.

use super::{CommandResult, Exit, Stopped, Terminal};
use lamella::diagnostic::{Diagnostic, codes, did_you_mean};

/// Explain a message code, or list all codes
#[derive(clap::Args)]
pub(crate) struct Arguments {
    /// The code in the brackets of a message, such as U104
    code: Option<String>,
}

pub(crate) fn run(arguments: &Arguments, terminal: &Terminal) -> CommandResult {
    match &arguments.code {
        None => terminal.product(&list())?,
        Some(code) => {
            let entry = codes::find(code.trim()).ok_or_else(|| unknown(code))?;
            terminal.product(&format!("{}\n", entry.page.trim_end()))?;
        }
    }
    Ok(Exit::Done)
}

fn list() -> String {
    codes::ALL.iter().map(|entry| format!("{}  {}\n", entry.code, entry.title)).collect()
}

fn unknown(code: &str) -> Stopped {
    let message = Diagnostic::error(codes::F104, format!("there is no message code `{code}`"));
    let upper = code.to_ascii_uppercase();
    let message = match did_you_mean(&upper, codes::ALL.iter().map(|entry| entry.code.0)) {
        Some(close) => message.help(format!("did you mean `{close}`?")),
        None => message.help("`lamella explain` lists all codes"),
    };
    Stopped::new(Exit::SceneWrong, message)
}
