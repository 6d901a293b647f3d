//! `lamella stress`: a scene with its quantities multiplied by powers of ten.

use super::interrupt::Interrupt;
use super::text::{Align, duration, significant, table};
use super::{CommandResult, Exit, Stopped, Terminal, load, machine, record, run};
use clap::ValueEnum;
use lamella::Checked;
use lamella::diagnostic::{Diagnostic, codes};
use lamella::flow::FlowSeries;
use lamella::plan::transport::Flow;
use lamella::plan::{Options, Plan};
use lamella::scenario::{Scenario, Settings};
use lamella::source::Sources;
use lamella::stress::{Bounds, Fate, Knob, Trial, Verdict};
use lamella::table::{StressRow, write_stress};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// Multiply rates, concentrations, steps and more by powers of ten, and see what runs
#[derive(clap::Args)]
pub(crate) struct Arguments {
    /// Scene file; `-` is standard input
    file: PathBuf,
    /// Set a parameter, or particles, step, bins; such as v=2cm/s, particles=1e5
    #[arg(long, value_name = "NAME=VALUE", value_parser = load::parse_setting)]
    set: Vec<(String, String)>,
    /// What to multiply [default: all that the scene has]
    #[arg(long, value_name = "KNOB", value_enum, value_delimiter = ',')]
    knobs: Vec<KnobName>,
    /// Largest power of ten, up and down
    #[arg(long, value_name = "N", default_value_t = 12, value_parser = clap::value_parser!(i32).range(0..=300))]
    decades: i32,
    /// Decades from one trial to the next
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(i32).range(1..=300))]
    every: i32,
    /// Particles of a trial; more if its bins need them
    #[arg(long, value_name = "N", default_value_t = 1000, value_parser = clap::value_parser!(u64).range(1..=1_000_000_000))]
    particles: u64,
    /// Wall seconds of a trial
    #[arg(long, value_name = "S", default_value_t = 10.0)]
    seconds: f64,
    /// Folder of stress.parquet [default: results/NAME-stress]
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

#[derive(Clone, Copy, ValueEnum)]
#[value(rename_all = "snake_case")]
enum KnobName {
    /// Rates of reactions
    Rates,
    /// Initial concentrations
    Concentrations,
    /// K in c / (K + c) and the like
    HalfSaturation,
    /// Equilibrium constants
    Equilibrium,
    /// Advection against dispersion
    Peclet,
    /// Reaction against transport and exchange
    Damkohler,
    /// The step
    Step,
    /// The bandwidth of an exchange
    Bandwidth,
    /// The dispersion by exchange
    Exchange,
}

impl From<KnobName> for Knob {
    fn from(name: KnobName) -> Self {
        match name {
            KnobName::Rates => Self::Rates,
            KnobName::Concentrations => Self::Concentrations,
            KnobName::HalfSaturation => Self::HalfSaturation,
            KnobName::Equilibrium => Self::Equilibrium,
            KnobName::Peclet => Self::Peclet,
            KnobName::Damkohler => Self::Damkohler,
            KnobName::Step => Self::Step,
            KnobName::Bandwidth => Self::Bandwidth,
            KnobName::Exchange => Self::Exchange,
        }
    }
}

pub(crate) fn run(arguments: &Arguments, terminal: &Terminal) -> CommandResult {
    let interrupt = Interrupt::listen();
    let settings = Settings { set: arguments.set.clone(), ..Settings::default() };
    let checked = load::load(&arguments.file, &settings, false)?;
    terminal.diagnostics(&checked.diagnostics, &checked.sources);
    let (Some(compiled), Some(scenario)) = (&checked.compiled, &checked.scenario) else {
        return Ok(Exit::SceneWrong);
    };
    let name = run::scene_name(&arguments.file);
    let knobs: Vec<Knob> = match &arguments.knobs[..] {
        [] => Knob::ALL.to_vec(),
        chosen => chosen.iter().map(|&name| name.into()).collect(),
    };
    refuse_absent(&arguments.knobs, scenario)?;
    let trials = Trial::all(scenario, &knobs, arguments.decades, arguments.every);
    terminal.remark(&format!("{} trials of at most {} each", trials.len(), duration(arguments.seconds)));
    let begin = Instant::now();
    let time = Duration::from_secs_f64(arguments.seconds.clamp(1e-3, 1e9));
    let bounds = Bounds { particles: arguments.particles, time, flow: read_flow(&checked, &compiled.plan) };
    let (verdicts, is_cancelled) = judge(&bounds, scenario, &trials, &interrupt);
    let rows: Vec<StressRow> = verdicts.iter().map(|verdict| row(verdict, &checked.sources)).collect();
    if !is_cancelled {
        let out =
            arguments.out.clone().unwrap_or_else(|| Path::new("results").join(format!("{name}-stress")));
        let record = record::record(&checked, scenario, compiled, &name);
        let path = write_stress(&out, &compiled.plan, &record, &rows)
            .map_err(|error| Stopped::new(Exit::Failed, Diagnostic::error(codes::F103, error.to_string())))?;
        terminal.remark(&format!("table: {}", path.display()));
    }
    terminal.product(&text(&rows, begin.elapsed().as_secs_f64(), terminal)?)?;
    Ok(if is_cancelled { Exit::Interrupted } else { Exit::Done })
}

/// A knob that was asked for and that the scene does not have would be a test of nothing.
fn refuse_absent(asked: &[KnobName], scenario: &Scenario) -> Result<(), Stopped> {
    let present = Knob::of(scenario);
    let Some(absent) = asked.iter().map(|&name| Knob::from(name)).find(|knob| !present.contains(knob)) else {
        return Ok(());
    };
    let names: Vec<String> = present.iter().map(|knob| format!("`{}`", knob.name())).collect();
    let message = Diagnostic::error(codes::F128, format!("the scene has no `{}` to turn", absent.name()))
        .found(format!("`--knobs {}`", absent.name()))
        .expected(format!("some of {}", names.join(", ")));
    Err(Stopped::new(Exit::SceneWrong, message))
}

/// The flow of a scene that has it from files; others are solved for in each trial.
fn read_flow(checked: &Checked, plan: &Plan) -> Option<FlowSeries> {
    let is_read = plan.transport.as_ref().is_some_and(|it| matches!(it.flow, Flow::File(_)));
    is_read.then(|| checked.flows.of(plan, &checked.sources).ok().flatten()).flatten()
}

/// One trial after the other, as each uses all cores.
fn judge(
    bounds: &Bounds,
    scenario: &Scenario,
    trials: &[Trial],
    interrupt: &Interrupt,
) -> (Vec<Verdict>, bool) {
    let options = Options { memory: machine::available_memory(), ..Options::default() };
    let mut verdicts = Vec::new();
    for trial in trials {
        if interrupt.is_requested() {
            return (verdicts, true);
        }
        verdicts.push(trial.run(scenario, &options, bounds));
    }
    (verdicts, false)
}

fn row(verdict: &Verdict, sources: &Sources) -> StressRow {
    let place = verdict.message.as_ref().and_then(Diagnostic::primary_span);
    let line = place.map(|span| sources.line_column(span).0 as u32);
    let message = verdict.message.as_ref().map(|message| message.message.clone());
    StressRow {
        knob: verdict.trial.knob.name().to_owned(),
        decades: verdict.trial.decades,
        fate: verdict.fate.name().to_owned(),
        code: verdict.message.as_ref().map(|message| message.code.to_string()),
        line,
        message: message.or_else(|| verdict.reason.clone()),
        particles: verdict.particles,
        steps: verdict.steps,
        sub_steps: verdict.sub_steps,
        wall: verdict.wall,
        cpu: verdict.cpu,
        mass_defect: verdict.mass_defect,
        lowest: verdict.lowest,
        error: verdict.error,
    }
}

/// A line per trial, and how many ended how.
fn text(rows: &[StressRow], wall: f64, terminal: &Terminal) -> Result<String, Stopped> {
    if terminal.is_json() {
        let lines = rows.iter().map(|row| serde_json::to_string(row).map(|line| line + "\n"));
        return lines
            .collect::<Result<String, _>>()
            .map_err(|error| Stopped::new(Exit::Failed, Diagnostic::error(codes::F103, error.to_string())));
    }
    let header = [
        ("knob", Align::Left),
        ("times", Align::Right),
        ("fate", Align::Left),
        ("wall", Align::Right),
        ("sub-steps", Align::Right),
        ("defect", Align::Right),
        ("error", Align::Right),
        ("why", Align::Left),
    ];
    let number = |value: Option<f64>| value.map_or_else(String::new, |value| significant(value, 2));
    let line = |row: &StressRow| {
        let per_step = row.sub_steps as f64 / (row.steps * row.particles).max(1) as f64;
        let is_run = row.fate == Fate::Finished.name();
        vec![
            row.knob.clone(),
            format!("1e{:+}", row.decades),
            row.fate.clone(),
            if is_run { duration(row.wall) } else { String::new() },
            if is_run && row.sub_steps > 0 { significant(per_step, 2) } else { String::new() },
            number(row.mass_defect),
            number(row.error),
            why(row),
        ]
    };
    let lines: Vec<Vec<String>> = rows.iter().map(line).collect();
    let count = |fate: Fate| rows.iter().filter(|row| row.fate == fate.name()).count();
    // Never, and so not worth a word where there are none.
    let never = [
        (Fate::MassLost, "lost mass"),
        (Fate::Negative, "below zero"),
        (Fate::Beyond, "beyond their bounds"),
    ];
    let wrong: String = never
        .into_iter()
        .map(|(fate, word)| (count(fate), word))
        .filter(|(n, _)| *n > 0)
        .map(|(n, word)| format!(", {n} {word}"))
        .collect();
    Ok(table(&header, &lines)
        + &format!(
            "\n{} trials in {}: {} finished, {} refused, {} stopped, {} too long{}\n",
            rows.len(),
            duration(wall),
            count(Fate::Finished),
            count(Fate::Refused),
            count(Fate::Stopped),
            count(Fate::TooLong),
            wrong
        ))
}

fn why(row: &StressRow) -> String {
    let place = match (&row.code, row.line) {
        (Some(code), Some(line)) => format!("{code} line {line}: "),
        (Some(code), None) => format!("{code}: "),
        _ => String::new(),
    };
    place + row.message.as_deref().unwrap_or_default()
}
