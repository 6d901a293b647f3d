//! The command line: arguments, terminal, exit codes.
//!
//! Owns everything a user of the program sees and is the only place that prints. May use the whole
//! library. It deliberately computes nothing: each command calls the library and shows what it says.

mod check;
mod completions;
mod data;
mod density;
mod density_direction;
mod density_ends;
mod density_points;
mod error_bars;
mod explain;
mod facts;
mod files;
mod fmt;
mod interrupt;
mod load;
mod machine;
mod new;
mod plan;
mod progress;
mod record;
mod report;
mod run;
mod stress;
mod summary;
mod sweep;
mod sweep_folder;
mod terminal;
mod text;
mod verify;
mod verify_sweep;
mod why;

use clap::{Args, Parser, Subcommand, ValueEnum};
use lamella::diagnostic::Diagnostic;
use std::process::ExitCode;
use terminal::Terminal;

/// Scenes of Lagrangian reactive transport in porous media: check them, plan them, run them.
#[derive(Parser)]
#[command(name = "lamella", version, after_help = AFTER_HELP, propagate_version = true)]
pub(crate) struct Arguments {
    #[command(flatten)]
    global: GlobalArguments,
    #[command(subcommand)]
    command: Command,
}

const AFTER_HELP: &str = "\
Exit codes: 0 done, 1 the run failed, 2 the scene or the command line is wrong, 130 interrupted.
Start with: lamella new my_column && lamella run my_column.lam --plot";

#[derive(Args)]
pub(crate) struct GlobalArguments {
    /// How messages are written to standard error
    #[arg(long, global = true, value_enum, default_value_t = MessageFormat::Text, value_name = "FORMAT")]
    message_format: MessageFormat,
    /// Say nothing but errors
    #[arg(long, short, global = true)]
    quiet: bool,
    /// When messages are coloured (auto: on a terminal, unless NO_COLOR is set)
    #[arg(long, global = true, value_enum, default_value_t = ColorChoice::Auto, value_name = "WHEN")]
    color: ColorChoice,
}

#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum MessageFormat {
    Text,
    /// One object per line
    Json,
}

#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum ColorChoice {
    Auto,
    Always,
    Never,
}

#[derive(Subcommand)]
enum Command {
    New(new::Arguments),
    Check(check::Arguments),
    Fmt(fmt::Arguments),
    Plan(plan::Arguments),
    Run(run::Arguments),
    Sweep(sweep::Arguments),
    Gather(sweep_folder::GatherArguments),
    Status(sweep_folder::StatusArguments),
    Report(report::Arguments),
    Stress(stress::Arguments),
    Density(density::Arguments),
    Why(why::Arguments),
    Verify(verify::Arguments),
    Repro(verify::ReproArguments),
    Explain(explain::Arguments),
    Completions(completions::Arguments),
}

/// How a command ended; the numbers are part of the interface.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Exit {
    Done = 0,
    /// What was asked could not be done, though the scene is right.
    Failed = 1,
    /// The scene, or the command line, is wrong.
    SceneWrong = 2,
    Interrupted = 130,
}

/// What stopped a command, if it was not the scene: one message without a place in a file.
pub(crate) struct Stopped {
    pub(crate) exit: Exit,
    pub(crate) message: Box<Diagnostic>,
}

impl Stopped {
    pub(crate) fn new(exit: Exit, message: Diagnostic) -> Self {
        Self { exit, message: Box::new(message) }
    }
}

pub(crate) type CommandResult = Result<Exit, Stopped>;

/// Reads the arguments, does what they ask and says how it ended.
pub(crate) fn main() -> ExitCode {
    let arguments = Arguments::parse();
    let terminal = Terminal::new(&arguments.global);
    let result = match &arguments.command {
        Command::Check(check) => check::run(check, &terminal),
        Command::Fmt(fmt) => fmt::run(fmt, &terminal),
        Command::Plan(plan) => plan::run(plan, &terminal),
        Command::Run(run) => run::run(run, &terminal),
        Command::Sweep(sweep) => sweep::run(sweep, &terminal),
        Command::Gather(gather) => sweep_folder::gather(gather, &terminal),
        Command::Status(status) => sweep_folder::status(status, &terminal),
        Command::Stress(stress) => stress::run(stress, &terminal),
        Command::Density(density) => density::run(density, &terminal),
        Command::Report(report) => report::run(report, &terminal),
        Command::Why(why) => why::run(why, &terminal),
        Command::Verify(verify) => verify::run(verify, &terminal),
        Command::Repro(repro) => verify::repro(repro, &terminal),
        Command::New(new) => new::run(new, &terminal),
        Command::Explain(explain) => explain::run(explain, &terminal),
        Command::Completions(completions) => completions::run(completions, &terminal),
    };
    let exit = result.unwrap_or_else(|stopped| terminal.stopped(stopped));
    ExitCode::from(exit as u8)
}
