//! Flows that several runs share.
//!
//! Owns what a flow is known by. May use the readers, the solver and the memory of answers. It deliberately changes no
//! byte of a result: a flow that was kept is the one that would be made.

use super::build::{self, FlowError};
use super::files::{self, Loaded, Setting, Trouble};
use super::memo::{Key, Memo, key};
use super::read::window::Extent;
use super::read::{Kind, ReadError};
use super::{FaceFlow, FlowSeries, Sink, cache};
use crate::plan::tape::Tape;
use crate::plan::transport::{Flow, FlowFile};
use crate::plan::{NUMERICS_VERSION, Plan};
use crate::source::Sources;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

/// Bytes of flows that are kept in memory.
const MOST_BYTES: usize = 1 << 29;

type Read = Result<Arc<Loaded>, Trouble>;
type Solved = Result<Arc<FaceFlow>, FlowError>;

/// The flows of a program.
#[derive(Debug)]
pub struct Flows {
    read: Memo<Read>,
    solved: Memo<Solved>,
    /// Where solved flows are kept beyond the life of the program.
    folder: OnceLock<PathBuf>,
    /// Keys of the flows that were asked for and are large enough to be kept.
    asked: Mutex<Vec<Key>>,
    n_solved: AtomicUsize,
}

impl Default for Flows {
    fn default() -> Self {
        Self {
            read: Memo::new(MOST_BYTES),
            solved: Memo::new(MOST_BYTES),
            folder: OnceLock::new(),
            asked: Mutex::default(),
            n_solved: AtomicUsize::new(0),
        }
    }
}

impl Flows {
    /// Keeps solved flows in a folder, from now on and once for all.
    pub fn keep_in(&self, folder: PathBuf) {
        self.folder.get_or_init(|| folder);
    }

    /// Forgets what earlier runs kept in the folder and this one did not ask for.
    pub fn forget_others(&self) {
        if let Some(folder) = self.folder.get() {
            cache::keep_only(folder, &self.asked.lock().unwrap_or_else(PoisonError::into_inner));
        }
    }

    /// Flows that had to be solved for.
    pub fn n_solved(&self) -> usize {
        self.n_solved.load(Ordering::Relaxed)
    }

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

    /// The flows of a plan, one after another; nothing if it needs no cells.
    pub fn of(&self, plan: &Plan, sources: &Sources) -> Result<Option<FlowSeries>, FlowError> {
        let Some(transport) = &plan.transport else { return Ok(None) };
        match &transport.flow {
            Flow::Uniform(_) | Flow::Expression(_) => Ok(None),
            Flow::File(flow) => {
                let loaded = self.read(&flow.file, &extents(plan), &transport.porosity, sources);
                let loaded = loaded.map_err(|trouble| FlowError::File(trouble.error.to_string()))?;
                Ok(Some(loaded.flows.clone()))
            }
            Flow::Darcy(darcy) => {
                if !transport.changes.is_empty() {
                    return build::series(plan);
                }
                let key = key(&("solved", NUMERICS_VERSION, extents(plan), darcy, &transport.porosity));
                let n_cells = darcy.cells.iter().fold(1_usize, |n, &cells| n.saturating_mul(cells));
                let folder = self.folder.get().filter(|_| n_cells >= cache::FEWEST_CELLS);
                let answer = || match folder {
                    Some(folder) => self.kept(folder, key, plan),
                    None => self.solve(plan),
                };
                let flow = self.solved.get(key, size_of_solved, answer)?;
                Ok(Some(FlowSeries::steady(flow)))
            }
        }
    }

    /// The flow of an earlier run, or else one that later runs will find.
    fn kept(&self, folder: &Path, key: Key, plan: &Plan) -> Solved {
        self.asked.lock().unwrap_or_else(PoisonError::into_inner).push(key);
        if let Some(flow) = cache::load(folder, &key) {
            return Ok(Arc::new(flow));
        }
        let flow = self.solve(plan)?;
        // A folder that cannot be written costs time and no result.
        drop(cache::save(folder, &key, &flow));
        Ok(flow)
    }

    fn solve(&self, plan: &Plan) -> Solved {
        self.n_solved.fetch_add(1, Ordering::Relaxed);
        match build::of(plan)? {
            Some(solution) => Ok(Arc::new(solution.flow)),
            None => Err(FlowError::Cells),
        }
    }
}

fn extents(plan: &Plan) -> Vec<Extent> {
    plan.axes.iter().map(|axis| (axis.index, axis.low, axis.high)).collect()
}

fn missing(file: usize) -> Trouble {
    Trouble { file, error: ReadError::new(Kind::Missing, "the bytes of the file are not there") }
}

fn size(flow: &FaceFlow) -> usize {
    let optional = [&flow.head, &flow.conductivity];
    let optional: usize = optional.into_iter().flatten().map(Vec::len).sum();
    let numbers = flow.flux.iter().map(Vec::len).sum::<usize>() + flow.porosity.len() + optional;
    8 * numbers + size_of::<Sink>() * flow.sinks.len()
}

fn size_of_read(read: &Read) -> usize {
    read.as_ref().map_or(0, |loaded| loaded.flows.periods().iter().map(|period| size(&period.flow)).sum())
}

fn size_of_solved(solved: &Solved) -> usize {
    solved.as_ref().map_or(0, |flow| size(flow))
}

#[cfg(test)]
mod tests {
    use super::*;

    const SCENE: &str = "lamella 1\nspecies A\ndomain rect x = 0 .. 200 m, y = 0 .. 100 m\n\
        boundary left inflow A = 1 mg/L\nboundary right outflow\nboundary bottom, top reflect\n\
        medium porosity 0.3\nflow darcy {\n  head left 2 m, right 1 m\n  no_flow top, bottom\n  \
        conductivity lognormal(geometric_mean = K, variance = 1, covariance = exponential(10 m))\n  grid 200 x 100\n}\n\
        dispersion longitudinal 1 m, transverse 0.1 m, molecular 0 m^2/s\nparam K = 10 m/d\n\
        particles mass 100\nrun to 1 d, step 1 d\noutput total A at t = 1 d\n";

    fn plan(from: &str, to: &str) -> Plan {
        assert!(SCENE.contains(from));
        let sources = Sources::single("s.lam", SCENE.replace(from, to));
        let checked = crate::check(sources, &Default::default(), &Default::default());
        checked.compiled.unwrap_or_else(|| panic!("{:?}", checked.diagnostics)).plan
    }

    /// Step, particles, dispersion and outputs make no other flow; conductivity does.
    #[test]
    fn what_does_not_touch_a_flow_does_not_solve_again() {
        let flows = Flows::default();
        let of = |from, to| flows.of(&plan(from, to), &Sources::default()).unwrap().unwrap().flow(0).clone();
        let first = of("mass 100", "mass 100");
        for (from, to) in [
            ("mass 100", "mass 200"),
            ("step 1 d", "step 0.5 d"),
            ("longitudinal 1 m", "longitudinal 2 m"),
            ("output total A", "average bins 20 x 10\noutput map A"),
        ] {
            assert!(Arc::ptr_eq(&first, &of(from, to)), "{from}");
        }
        assert_eq!(flows.n_solved(), 1);
        assert_ne!(first.head, of("K = 10 m/d", "K = 11 m/d").conductivity);
        assert_eq!(flows.n_solved(), 2);
    }

    #[test]
    fn a_later_program_finds_the_flow_of_an_earlier_one() {
        let folder = tempfile::tempdir().unwrap();
        let start = || {
            let flows = Flows::default();
            flows.keep_in(folder.path().to_owned());
            let flow = flows.of(&plan("mass 100", "mass 100"), &Sources::default()).unwrap().unwrap();
            (flow.flow(0).clone(), flows.n_solved(), flows)
        };
        let (solved, n_first, _) = start();
        let (found, n_second, flows) = start();
        assert_eq!((n_first, n_second), (1, 0));
        assert_eq!(solved, found, "to the last bit");
        flows.of(&plan("K = 10 m/d", "K = 12 m/d"), &Sources::default()).unwrap();
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 2);
        let entry = std::fs::read_dir(folder.path()).unwrap().next().unwrap().unwrap().path();
        std::fs::write(&entry, b"damaged").unwrap();
        let (again, ..) = start();
        assert_eq!(solved, again);
        let (_, _, last) = start();
        last.forget_others();
        assert_eq!((std::fs::read_dir(folder.path()).unwrap().count(), start().1), (1, 0));
    }
}
