//! A point of a sweep: the statements of a scene with the values of the point in them. Sizes that the
//! command line sets go the same way.
//!
//! Owns the replacement. May use the tree. It deliberately checks nothing: a replaced value passes the
//! same checks as a written one, and messages show the place in the sweep.

use super::collect::Statements;
use super::sweep::Target;
use crate::syntax::tree::{self, Expr, ExprKind};

/// Statements in place of the scene's own.
pub(super) struct Replaced {
    pub parameters: Vec<tree::Param>,
    particles: Option<tree::Particles>,
    run: Option<tree::Run>,
    average: Option<tree::Average>,
}

impl Replaced {
    /// Of several values for one thing the last one counts.
    pub(super) fn new<'p>(
        statements: &Statements<'_>,
        point: impl IntoIterator<Item = &'p (Target, Expr)>,
    ) -> Self {
        let mut replaced = Self { parameters: Vec::new(), particles: None, run: None, average: None };
        for (target, value) in point {
            let value = value.clone();
            match target {
                Target::Parameter(name) => {
                    let written = statements.params.iter().find(|param| param.name.value == *name);
                    replaced.parameters.extend(written.map(|&param| tree::Param { value, ..param.clone() }));
                }
                Target::Particles => {
                    let written = statements.particles.map(|(_, particles)| particles.clone());
                    replaced.particles =
                        written.map(|written| tree::Particles { count: tree::Count::All(value), ..written });
                }
                Target::Step => {
                    let written = statements.run.map(|(_, run)| run.clone());
                    replaced.run = written.map(|written| tree::Run { step: Some(value), ..written });
                }
                Target::Bins => {
                    let counts = match value.kind {
                        ExprKind::Tuple(parts) => parts,
                        _ => vec![value],
                    };
                    let mut written = statements.average.map(|(_, average)| average.clone());
                    if let Some((_, places)) = written.as_mut().and_then(|written| written.bins.as_mut()) {
                        *places = counts;
                    }
                    replaced.average = written;
                }
            }
        }
        replaced
    }

    /// Puts the replaced statements in their places.
    pub(super) fn replace<'a>(&'a self, statements: &mut Statements<'a>) {
        if let (Some((_, place)), Some(particles)) = (&mut statements.particles, &self.particles) {
            *place = particles;
        }
        if let (Some((_, place)), Some(run)) = (&mut statements.run, &self.run) {
            *place = run;
        }
        if let (Some((_, place)), Some(average)) = (&mut statements.average, &self.average) {
            *place = average;
        }
    }
}
