//! What the tables are told about a run: where it came from, and how it went.

use super::data::named_data;
use super::machine;
use lamella::Checked;
use lamella::engine::snapshot::Outcome;
use lamella::measure::Evaluated;
use lamella::plan::NUMERICS_VERSION;
use lamella::plan::compile::Compiled;
use lamella::plan::document::{self, EmbeddedSource};
use lamella::scenario::Scenario;
use lamella::source::FileId;
use lamella::syntax::{self, tree};
use lamella::table::{Parameter, PointRow, Record, Status, Swept, SweptValue, Value, si_text};

const VERSION: &str = env!("CARGO_PKG_VERSION");

/// The provenance of a run; it depends on nothing but the scene, the settings and the version.
pub(crate) fn record(
    checked: &Checked,
    scenario: &Scenario,
    compiled: &Compiled,
    scene_name: &str,
) -> Record {
    let text = &checked.sources.file(FileId(0)).text;
    let scene_text = syntax::format(&checked.file, text);
    let sources = embedded(checked, format!("{scene_name}.lam"));
    let data = named_data(&checked.sources);
    let mut record = Record {
        scene_name: scene_name.to_owned(),
        plan_hash: compiled.hash.clone(),
        plan_yaml: document::write(compiled, scenario, &sources, &data),
        version: VERSION.to_owned(),
        scene_source: text.clone(),
        scene_text,
        data: data.into_iter().map(|file| (file.name, file.hash)).collect(),
        ..Record::default()
    };
    add_scenario(&mut record, scenario);
    record
}

/// The texts that a plan carries: the scene under this name, then the files that it uses under the paths
/// by which it uses them.
pub(crate) fn embedded(checked: &Checked, name: String) -> Vec<EmbeddedSource> {
    let text = |file: &tree::File| syntax::format(file, &checked.sources.file(file.file).text);
    let scene = EmbeddedSource::new(name, text(&checked.file));
    let used = checked.uses.list.iter().map(|used| EmbeddedSource::new(&used.path, text(&used.file)));
    std::iter::once(scene).chain(used).collect()
}

fn add_scenario(record: &mut Record, scenario: &Scenario) {
    record.title.clone_from(&scenario.title);
    record.citations.clone_from(&scenario.citations);
    record.n_axes = scenario.domain.axes.len();
    let docs =
        scenario.species.iter().filter_map(|s| s.doc.as_ref().map(|doc| (s.name.clone(), doc.clone())));
    record.species_docs = docs.collect();
    let parameters = scenario.parameters.iter().map(|parameter| Parameter {
        name: parameter.name.clone(),
        value_si: parameter.value,
        unit: si_text(parameter.dimension),
        dimension: parameter.dimension,
        doc: parameter.doc.clone(),
    });
    record.parameters = parameters.collect();
}

/// The parameters that the command line set, as columns in SI.
pub(crate) fn swept(scenario: &Scenario) -> Vec<Swept> {
    let set = scenario.parameters.iter().filter(|parameter| parameter.is_set);
    let column = |parameter: &lamella::scenario::Parameter| Swept {
        name: parameter.name.clone(),
        value: SweptValue::Real(parameter.value, si_text(parameter.dimension)),
    };
    set.map(column).collect()
}

/// The measures of a scene as columns; one that is not a number has no value.
pub(crate) fn measures(evaluated: &Evaluated) -> Vec<Value> {
    let column = |measure: &lamella::measure::MeasureValue| Value {
        name: measure.name.clone(),
        unit: measure.unit.clone(),
        value: Some(measure.value).filter(|value| !value.is_nan()),
    };
    evaluated.measures.iter().map(column).collect()
}

/// The row of a run that is done.
pub(crate) fn point(
    compiled: &Compiled,
    swept: Vec<Swept>,
    outcome: &Outcome,
    values: Vec<Value>,
) -> PointRow {
    let plan = &compiled.plan;
    PointRow {
        point: 0,
        replicate: 0,
        key: compiled.hash.clone(),
        swept,
        seed: plan.seed,
        status: Status::Done,
        error_code: None,
        error_message: None,
        wall: outcome.wall,
        loop_wall: outcome.loop_wall,
        cpu: outcome.cpu,
        compile_wall: 0.0,
        write_wall: None,
        peak_memory: machine::peak_memory(),
        particles: outcome.n_particles,
        step: plan.time.step,
        duration: plan.time.duration,
        steps: outcome.n_steps,
        sub_steps: outcome.sub_steps(),
        mass_defect: (!outcome.mass_defect.is_empty()).then(|| outcome.worst_defect()),
        values,
        version: VERSION.to_owned(),
        numerics: NUMERICS_VERSION,
        host: machine::host(),
        threads: 0,
        started: 0,
        finished: machine::now(),
    }
}
