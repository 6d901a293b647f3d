//! The phase itself: statements gathered, names defined, every part resolved in its turn.

use super::check::Checker;
use super::expression::{Expr, Type};
use super::scope::{Origin, Scope};
use super::settings::{check_setting, read_settings, unit_as_written};
use super::transport::{self, Dispersion, Flow};
use super::{Domain, Parameter, Scenario, Settings};
use crate::diagnostic::Diagnostic;
use crate::diagnostic::codes::{D001, M001, M002, M018, P002};
use crate::source::{Sources, Span, Spanned};
use crate::syntax::tree::{self, StatementKind};

/// Statements by kind, in the order of the text.
#[derive(Default)]
pub(super) struct Statements<'a> {
    pub title: Option<&'a tree::Text>,
    pub citations: Vec<&'a tree::Text>,
    pub seed: Option<u64>,
    pub lets: Vec<&'a tree::Let>,
    pub params: Vec<&'a tree::Param>,
    pub functions: Vec<&'a tree::Function>,
    pub data: Vec<&'a tree::Data>,
    pub species: Vec<&'a tree::Species>,
    pub reactions: Vec<(Span, &'a tree::Reaction)>,
    pub chemistry: Option<(Span, &'a [tree::Field])>,
    pub domain: Option<(Span, &'a tree::Domain)>,
    pub boundaries: Vec<&'a tree::Boundary>,
    pub medium: Option<(Span, &'a [tree::Field])>,
    pub flow: Option<(Span, &'a tree::Flow)>,
    pub dispersion: Option<(Span, &'a tree::Dispersion)>,
    pub sources: Vec<(Span, &'a tree::Source)>,
    pub zones: Option<(Span, &'a [tree::Zone])>,
    pub exchange: Option<(Span, &'a [tree::Field])>,
    pub kernels: Vec<&'a tree::Kernel>,
    pub estimate: Option<(Span, &'a tree::Estimate)>,
    pub average: Option<(Span, &'a tree::Average)>,
    pub initials: Vec<&'a tree::Assignment>,
    pub particles: Option<(Span, &'a tree::Particles)>,
    pub run: Option<(Span, &'a tree::Run)>,
    pub outputs: Vec<(Span, &'a tree::Output)>,
    pub references: Vec<(Span, &'a tree::Reference)>,
    pub measures: Vec<(Span, &'a tree::Measure)>,
    pub sweeps: Vec<(Span, &'a tree::Sweep)>,
    pub reports: Vec<(Span, &'a tree::Report)>,
}

impl Statements<'_> {
    pub fn has_bins(&self) -> bool {
        self.average.is_some_and(|(_, average)| average.bins.is_some())
    }

    /// How to come by bins.
    pub fn bins_help(&self, n: usize) -> String {
        match self.average {
            Some(_) => format!("add `, bins {n}` to the `average` of the scene"),
            None => format!("add for example `average bins {n}`"),
        }
    }
}

/// Resolves a scene: everything that can be wrong is reported together.
///
/// `sources` gains a file for each setting of the command line, so that messages can show it.
/// The scenario is absent if anything fatal was found. `has_syntax_errors` silences what would only
/// follow from statements that did not parse.
pub fn resolve(
    file: &tree::File,
    sources: &mut Sources,
    settings: &Settings,
    has_syntax_errors: bool,
) -> (Option<Scenario>, Vec<Diagnostic>) {
    let mut diagnostics = Vec::new();
    let given = read_settings(file, sources, settings, &mut diagnostics);
    let mut overrides = given.params;
    let mut statements = gather(file, &mut diagnostics);
    let point = given.sizes.iter().chain(settings.point.iter().flatten());
    let of_point = super::point::Replaced::new(&statements, point);
    of_point.replace(&mut statements);
    if settings.point.is_some() {
        // The sweep has been worked out once: a point must not work out all others again.
        statements.sweeps.clear();
        statements.reports.clear();
    }
    overrides.extend(of_point.parameters.iter().cloned());
    let mut checker = Checker {
        scope: Scope::default(),
        diagnostics,
        axes: super::geometry::axis_names(&statements),
        extents: Vec::new(),
        species_dimensions: vec![None; statements.species.len()],
        is_initial_wrong: false,
        call_stack: Vec::new(),
        measuring: None,
        checked: Default::default(),
        running: Vec::new(),
        files: super::data_files::Files::of(sources),
        tables: Default::default(),
    };
    define_names(&mut checker, &statements, &overrides);
    super::data::read(&mut checker, &statements);
    let scenario = build(&mut checker, &statements, settings, file, has_syntax_errors);
    let axes: Vec<String> = checker.axes.iter().map(|(name, _)| name.clone()).collect();
    let mut diagnostics = std::mem::take(&mut checker.diagnostics);
    if !has_syntax_errors {
        checker.scope.report_undefined(&axes, &mut diagnostics);
        super::unused::report_unused(&checker.scope, &mut diagnostics);
        super::settings::name_settings(&checker, &mut diagnostics);
    }
    let diagnostics = in_order(diagnostics, has_syntax_errors);
    let is_fatal = has_syntax_errors || crate::diagnostic::any_fatal(&diagnostics);
    (scenario.filter(|_| !is_fatal), diagnostics)
}

/// Names and definitions first, then what follows from them; each by place, each once.
fn in_order(mut diagnostics: Vec<Diagnostic>, has_syntax_errors: bool) -> Vec<Diagnostic> {
    let rank = |diagnostic: &Diagnostic| {
        let family = diagnostic.code.0.as_bytes()[0];
        let weight = match family {
            _ if !diagnostic.is_fatal() => 3,
            b'P' => 0,
            // A missing statement is often a consequence of a misspelt one elsewhere.
            b'M' if diagnostic.code == M001 => 2,
            _ => 1,
        };
        (weight, diagnostic.primary_span().map(|span| (span.file, span.start)))
    };
    diagnostics.sort_by_key(rank);
    let is_wrong = has_syntax_errors || crate::diagnostic::any_fatal(&diagnostics);
    let mut seen = std::collections::BTreeSet::new();
    diagnostics.retain(|diagnostic| {
        // An output may be what is wrong.
        if is_wrong && diagnostic.code == M018 {
            return false;
        }
        let is_new = seen.insert((diagnostic.code, diagnostic.primary_span(), diagnostic.message.clone()));
        is_new && !(has_syntax_errors && diagnostic.code == M001)
    });
    diagnostics
}

fn gather<'a>(file: &'a tree::File, diagnostics: &mut Vec<Diagnostic>) -> Statements<'a> {
    let mut all = Statements::default();
    let mut first_of: std::collections::BTreeMap<&'static str, Span> = std::collections::BTreeMap::new();
    for statement in &file.statements {
        let span = statement.span;
        if let Some(what) = single(&statement.kind)
            && let Some(first) = first_of.insert(what, statement.keyword)
        {
            first_of.insert(what, first);
            diagnostics.push(
                Diagnostic::error(M002, format!("a second `{what}` statement"))
                    .at(statement.keyword, "a scene has one of these")
                    .also(first, "the first one is here")
                    .found(format!("`{what}` twice"))
                    .expected(format!("one `{what}` statement"))
                    .help("delete one of the two"),
            );
            continue;
        }
        match &statement.kind {
            StatementKind::Edition(_) => {}
            StatementKind::Title(text) => all.title = Some(text),
            StatementKind::Cite(texts) => all.citations.extend(texts),
            StatementKind::Seed(seed) => all.seed = Some(seed.value),
            StatementKind::Let(s) => all.lets.push(s),
            StatementKind::Param(s) => all.params.push(s),
            StatementKind::Function(s) => all.functions.push(s),
            StatementKind::Data(s) => all.data.push(s),
            StatementKind::Species(list) => all.species.extend(list),
            StatementKind::Reaction(s) => all.reactions.push((span, s)),
            StatementKind::Chemistry(s) => all.chemistry = Some((span, s)),
            StatementKind::Domain(s) => all.domain = Some((span, s)),
            StatementKind::Boundary(s) => all.boundaries.push(s),
            StatementKind::Medium(s) => all.medium = Some((span, s)),
            StatementKind::Source(s) => all.sources.push((span, s)),
            StatementKind::Flow(s) => all.flow = Some((span, s)),
            StatementKind::Dispersion(s) => all.dispersion = Some((span, s)),
            StatementKind::MixingZones(s) => all.zones = Some((span, s)),
            StatementKind::Exchange(s) => all.exchange = Some((span, s)),
            StatementKind::Kernel(s) => all.kernels.push(s),
            StatementKind::Estimate(s) => all.estimate = Some((span, s)),
            StatementKind::Average(s) => all.average = Some((span, s)),
            StatementKind::Initial(list) => all.initials.extend(list),
            StatementKind::Particles(s) => all.particles = Some((span, s)),
            StatementKind::Run(s) => all.run = Some((span, s)),
            StatementKind::Output(s) => all.outputs.push((span, s)),
            StatementKind::Reference(s) => all.references.push((span, s)),
            StatementKind::Measure(s) => all.measures.push((span, s)),
            StatementKind::Sweep(s) => all.sweeps.push((span, s)),
            StatementKind::Report(s) => all.reports.push((span, s)),
            // What a used file says has been put in by the caller.
            StatementKind::Use(_) => {}
        }
    }
    all
}

/// The keyword of a statement that may stand once only.
fn single(kind: &StatementKind) -> Option<&'static str> {
    Some(match kind {
        StatementKind::Title(_) => "title",
        StatementKind::Seed(_) => "seed",
        StatementKind::Chemistry(_) => "chemistry",
        StatementKind::Domain(_) => "domain",
        StatementKind::Medium(_) => "medium",
        StatementKind::Flow(_) => "flow",
        StatementKind::Dispersion(_) => "dispersion",
        StatementKind::MixingZones(_) => "mixing zones",
        StatementKind::Exchange(_) => "exchange",
        StatementKind::Average(_) => "average",
        StatementKind::Estimate(_) => "kernel",
        StatementKind::Particles(_) => "particles",
        StatementKind::Run(_) => "run",
        _ => return None,
    })
}

fn define_names<'a>(checker: &mut Checker<'a>, statements: &Statements<'a>, overrides: &'a [tree::Param]) {
    let axes: Vec<String> = checker.axes.iter().map(|(name, _)| name.clone()).collect();
    let (scope, diagnostics) = (&mut checker.scope, &mut checker.diagnostics);
    for statement in &statements.lets {
        scope.define(&statement.name, Origin::Let(statement), &axes, diagnostics);
    }
    for statement in &statements.params {
        let replaced = overrides.iter().rev().find(|param| param.name.value == statement.name.value);
        scope.define(&statement.name, Origin::Param(replaced.unwrap_or(statement)), &axes, diagnostics);
    }
    for statement in &statements.functions {
        scope.define(&statement.name, Origin::Function(statement), &axes, diagnostics);
        report_twice_named_parameters(statement, diagnostics);
    }
    for statement in &statements.data {
        scope.define(&statement.name, Origin::Data(statement), &axes, diagnostics);
    }
    for statement in &statements.kernels {
        scope.define(&statement.name, Origin::Kernel, &axes, diagnostics);
    }
    for (idx, statement) in statements.species.iter().enumerate() {
        scope.define(&statement.name, Origin::Species(idx), &axes, diagnostics);
    }
    for (_, statement) in &statements.reactions {
        if let Some(name) = &statement.name {
            scope.define(name, Origin::Reaction, &axes, diagnostics);
        }
    }
    for (idx, (_, statement)) in statements.references.iter().enumerate() {
        if let Some(name) = super::reference::reference_name(statement) {
            scope.define(name, Origin::Reference(idx), &axes, diagnostics);
        }
    }
    for (idx, (_, statement)) in statements.measures.iter().enumerate() {
        scope.define(&statement.name, Origin::Measure(idx), &axes, diagnostics);
    }
}

fn report_twice_named_parameters(statement: &tree::Function, diagnostics: &mut Vec<Diagnostic>) {
    for (idx, name) in statement.parameters.iter().enumerate() {
        if let Some(first) = statement.parameters[..idx].iter().find(|first| first.value == name.value) {
            diagnostics.push(
                Diagnostic::error(D001, format!("two parameters are called `{}`", name.value))
                    .at(name.span, "here again")
                    .also(first.span, "first here")
                    .found("one name twice")
                    .expected("different names"),
            );
        }
    }
}

fn build<'a>(
    checker: &mut Checker<'a>,
    statements: &Statements<'a>,
    settings: &Settings,
    file: &'a tree::File,
    has_syntax_errors: bool,
) -> Option<Scenario> {
    report_missing(checker, statements, file, has_syntax_errors);
    let parameters = parameters(checker, statements);
    let mut domain = super::geometry::domain(checker, statements);
    let species = super::model::species(checker, statements);
    let reactions = super::reactions::reactions(checker, statements);
    let chemistry = super::chemistry::chemistry(checker, statements);
    let motion = motion(checker, statements, domain.as_mut());
    let mixing = super::zones::mixing(checker, statements);
    let exchanges = super::exchange::exchanges(checker, statements);
    let bins = super::geometry::bins(checker, statements);
    let particles = particles(checker, statements, domain.as_ref());
    let run = super::model::run(checker, statements);
    let duration = run.as_ref().map(|run| run.duration);
    let sources = super::transport::source::sources(checker, statements, duration, domain.as_ref());
    let average = bins.as_ref().and_then(Option::as_ref);
    let (outputs, are_outputs_right) =
        super::observe::outputs(checker, statements, duration, average, domain.as_ref());
    let (references, are_references_right) = super::reference::references(checker, statements, &outputs);
    let (measures, are_measures_right) =
        super::measure::measures(checker, statements, &outputs, &references, duration, domain.as_ref());
    let (sweeps, are_sweeps_right) = super::sweep::sweeps(checker, statements, &parameters, &measures);
    let (reports, are_reports_right) = match are_sweeps_right && !has_syntax_errors {
        true => super::sweep::reports(checker, statements, &measures, &sweeps),
        // A report of a sweep that is not known would only repeat its mistakes.
        false => (Vec::new(), true),
    };
    let is_analysis_right = are_measures_right && are_sweeps_right && are_reports_right;
    if !(are_outputs_right && are_references_right && is_analysis_right) {
        return None;
    }
    let ((medium, flow, dispersion), (exchange, kernels, averaging, estimation)) = (motion?, exchanges?);
    let scenario = Scenario {
        title: statements.title.map(|title| title.value.clone()),
        citations: statements.citations.iter().map(|text| text.value.clone()).collect(),
        settings: as_given(settings),
        parameters,
        species: species.all_right()?,
        reactions: reactions?,
        chemistry: chemistry?,
        domain: domain?,
        medium,
        flow_table: super::flow_table::flow_table(checker, statements, flow.as_ref()),
        flow,
        dispersion,
        sources: sources?,
        mixing: mixing?,
        exchange,
        kernels,
        averaging,
        estimation,
        bins: bins?,
        particles: particles?,
        run: run?,
        seed: settings.seed.or(statements.seed).unwrap_or(1),
        outputs,
        references,
        measures,
        sweeps,
        reports,
    };
    check_together(checker, &scenario);
    Some(scenario)
}

/// Particles whose volume is a number.
fn particles<'a>(
    checker: &mut Checker<'a>,
    statements: &Statements<'a>,
    domain: Option<&Domain>,
) -> Option<super::Particles> {
    let particles = transport::masses::particles(checker, statements)?;
    if let Some(domain) = domain {
        super::geometry::check_volume(checker, domain, &particles);
    }
    Some(particles)
}

/// What only the whole scene shows.
fn check_together(checker: &mut Checker<'_>, scenario: &Scenario) {
    super::data::check_extents(checker, scenario);
    super::reactions::check_places(checker, scenario);
    super::transport::restriction::check(checker, scenario);
    super::exchange_places::check(checker, scenario);
}

/// `--set name=value` without the blanks around.
fn as_given(settings: &Settings) -> Vec<(String, String)> {
    settings.set.iter().map(|(name, value)| (name.trim().into(), value.trim().into())).collect()
}

/// Porosity, flow and dispersion; absent where the scene says nothing of one.
type Motion = (Option<Spanned<Expr>>, Option<Spanned<Flow>>, Option<Spanned<Dispersion>>);

/// What moves the water and what it carries in at the sides; each part is checked, whatever is wrong with
/// another one.
fn motion<'a>(
    checker: &mut Checker<'a>,
    statements: &Statements<'a>,
    domain: Option<&mut Domain>,
) -> Option<Motion> {
    let are_sides_right = domain.is_none_or(|domain| {
        checker.extents = domain.axes.iter().map(|axis| (axis.index, axis.low, axis.high)).collect();
        transport::sides::carried(checker, statements, domain).is_some()
    });
    let medium = transport::flow::porosity(checker, statements);
    let flow = transport::flow::flow(checker, statements);
    transport::flow::one_porosity(checker, statements, flow.as_ref().and_then(Option::as_ref));
    let dispersion = transport::dispersion::dispersion(checker, statements);
    are_sides_right.then_some((medium?, flow?, dispersion?))
}

fn report_missing<'a>(
    checker: &mut Checker<'a>,
    statements: &Statements<'a>,
    file: &'a tree::File,
    has_syntax_errors: bool,
) {
    if has_syntax_errors {
        return;
    }
    let end = file.tokens.last().map_or(0, |token| token.span.end as usize);
    let place = Span::new(file.file, end, end);
    let wanted = [
        (statements.species.is_empty(), "species", "species A \"tracer\""),
        (statements.domain.is_none(), "domain", "domain line x = 0 m .. 1 m"),
        (statements.particles.is_none(), "particles", "particles fluid 100_000 stratified"),
        (statements.run.is_none(), "run", "run to 1 d, step 1 min"),
    ];
    for (is_missing, keyword, example) in wanted {
        if is_missing {
            checker.report(
                Diagnostic::error(M001, format!("the scene has no `{keyword}` statement"))
                    .at(place, "the scene ends here")
                    .found(format!("no `{keyword}`"))
                    .expected(format!("one `{keyword}` statement"))
                    .help(format!("add for example `{example}`")),
            );
        }
    }
    if statements.outputs.is_empty() {
        checker.report(
            Diagnostic::warning(M018, "nothing is written: the scene has no output")
                .at(place, "the scene ends here")
                .found("no `output`")
                .expected("one or more `output` statements")
                .help("add for example `output profile A at t = 1 d on 100`"),
        );
    }
}

fn parameters<'a>(checker: &mut Checker<'a>, statements: &Statements<'a>) -> Vec<Parameter> {
    for statement in &statements.lets {
        checker.constant_of(&statement.name.value);
    }
    let mut list = Vec::new();
    for statement in &statements.params {
        let name = &statement.name.value;
        let value = checker.constant_of(name);
        check_setting(checker, statement, value.map(|(_, kind)| kind));
        let dimension = value.and_then(|(_, kind)| match kind {
            Type::Number(dimension) => Some(dimension),
            _ => None,
        });
        let range = statement
            .range
            .as_ref()
            .and_then(|range| checker.range(range, &format!("the range of `{name}`"), dimension));
        let Some((value, _)) = value else { continue };
        let given = match checker.scope.get(name).map(|entry| entry.origin) {
            Some(Origin::Param(given)) => given,
            _ => *statement,
        };
        if let Some((low, high, _)) = range
            && !(low.value..=high.value).contains(&value)
        {
            let dimension = dimension.unwrap_or_default();
            let found = checker.shown(value, dimension, given.value.span);
            let expected = checker.shown_range((low.value, high.value), dimension, given.value.span);
            checker.report(
                Diagnostic::error(P002, format!("`{name}` lies outside of its range"))
                    .at(given.value.span, "this value")
                    .also(low.span.to(high.span), "this range")
                    .found(found)
                    .expected(expected),
            );
        }
        list.push(Parameter {
            name: name.clone(),
            value,
            dimension: dimension.or(range.map(|(_, _, dimension)| dimension)).unwrap_or_default(),
            unit: unit_as_written(&given.value),
            is_set: !std::ptr::eq(given, *statement),
            doc: statement.doc.as_ref().map(|doc| doc.value.clone()),
            span: statement.name.span,
        });
    }
    list
}
