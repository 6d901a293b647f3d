//! Flows that several runs share.
//!
//! Owns what a flow is known by. May use the readers, the solver and the memory of answers. It deliberately changes no
//! byte of a result: a flow that was kept is the one that would be made.

use super::build::{self, FlowError};
use super::files::{self, Loaded, Setting, Trouble};
use super::memo::{Key, Memo};
use super::read::window::Extent;
use super::read::{Kind, ReadError};
use super::{FaceFlow, Sink};
use crate::plan::tape::Tape;
use crate::plan::transport::{Flow, FlowFile};
use crate::plan::{NUMERICS_VERSION, Plan};
use crate::source::Sources;
use serde::Serialize;
use std::sync::Arc;

/// Bytes of flows that are kept in memory.
const MOST_BYTES: usize = 1 << 29;

type Read = Result<Arc<Loaded>, Trouble>;
type Solved = Result<Arc<FaceFlow>, FlowError>;

/// The flows of a program.
#[derive(Debug)]
pub struct Flows {
    read: Memo<Read>,
    solved: Memo<Solved>,
}

impl Default for Flows {
    fn default() -> Self {
        Self { read: Memo::new(MOST_BYTES), solved: Memo::new(MOST_BYTES) }
    }
}

impl Flows {
    /// The flow of files, whose bytes are among the sources.
    pub fn read(&self, file: &FlowFile, axes: &[Extent], porosity: &Tape, sources: &Sources) -> Read {
        let key = key(&("read", NUMERICS_VERSION, file, axes, porosity));
        self.read.get(key, size_of_read, || {
            let mut bytes: Vec<&[u8]> = Vec::new();
            for (idx, named) in file.files.iter().enumerate() {
                let found = sources.data().iter().find(|data| data.hash == named.hash);
                bytes.push(&found.ok_or_else(|| missing(idx))?.bytes);
            }
            files::read(file, &bytes, &Setting { axes, porosity }).map(Arc::new)
        })
    }

    /// The flow of a plan; nothing if it needs no cells.
    pub fn of(&self, plan: &Plan, sources: &Sources) -> Result<Option<Arc<FaceFlow>>, FlowError> {
        let Some(transport) = &plan.transport else { return Ok(None) };
        match &transport.flow {
            Flow::Uniform(_) | Flow::Expression(_) => Ok(None),
            Flow::File(flow) => {
                let axes: Vec<Extent> =
                    plan.axes.iter().map(|axis| (axis.index, axis.low, axis.high)).collect();
                let loaded = self.read(&flow.file, &axes, &transport.porosity, sources);
                let loaded = loaded.map_err(|trouble| FlowError::File(trouble.error.to_string()))?;
                Ok(Some(loaded.flow.clone()))
            }
            Flow::Darcy(darcy) => {
                let key = key(&("solved", NUMERICS_VERSION, &plan.axes, darcy, &transport.porosity));
                let solve = || match build::of(plan) {
                    Ok(Some(solution)) => Ok(Arc::new(solution.flow)),
                    Ok(None) => Err(FlowError::Cells),
                    Err(error) => Err(error),
                };
                self.solved.get(key, size_of_solved, solve).map(Some)
            }
        }
    }
}

fn missing(file: usize) -> Trouble {
    Trouble { file, error: ReadError::new(Kind::Missing, "the bytes of the file are not there") }
}

/// BLAKE3 of everything that a flow follows from.
fn key(of: &impl Serialize) -> Key {
    let text = serde_json::to_string(of).expect("flows are described by finite numbers, lists and names");
    *blake3::hash(text.as_bytes()).as_bytes()
}

fn size(flow: &FaceFlow) -> usize {
    let optional = [&flow.head, &flow.conductivity];
    let optional: usize = optional.into_iter().flatten().map(Vec::len).sum();
    let numbers = flow.flux.iter().map(Vec::len).sum::<usize>() + flow.porosity.len() + optional;
    8 * numbers + size_of::<Sink>() * flow.sinks.len()
}

fn size_of_read(read: &Read) -> usize {
    read.as_ref().map_or(0, |loaded| size(&loaded.flow))
}

fn size_of_solved(solved: &Solved) -> usize {
    solved.as_ref().map_or(0, |flow| size(flow))
}
