//! Files that scenes of the repository read, for tests that work below the command line.

use lamella::Checked;
use lamella::data::DataFile;
use lamella::flow::FlowSeries;
use lamella::plan::transport::Flow;
use lamella::scenario::{wanted_data, wanted_files};
use lamella::source::{FileId, Sources};
use std::path::Path;
use std::sync::Arc;

/// The sources and the files that they name, from a folder: scenes that are used, and numbers.
pub fn with_files(mut sources: Sources, folder: &Path) -> Sources {
    let first = sources.file(FileId(0));
    for (name, path) in wanted_files(&first.name, &first.text) {
        if sources.find(&name).is_none() {
            sources.add(name, std::fs::read_to_string(folder.join(path)).expect("a scene that is used"));
        }
    }
    for name in wanted_data(&sources) {
        let bytes = std::fs::read(folder.join(&name)).expect("a file beside the scene");
        sources.add_data(Arc::new(DataFile::new(name, bytes)));
    }
    sources
}

/// The flow of a scene that has it from files.
pub fn read_flow(checked: &Checked) -> Option<FlowSeries> {
    let plan = &checked.compiled.as_ref()?.plan;
    let is_read = plan.transport.as_ref().is_some_and(|transport| matches!(transport.flow, Flow::File(_)));
    is_read.then(|| checked.flows.of(plan, &checked.sources).expect("a flow that can be read")).flatten()
}
