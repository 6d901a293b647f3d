//! Outputs due: looks at the state and hands out snapshots.
//!
//! Owns the passes of an observation. May use the stages and `state`. It deliberately disturbs
//! nothing: a run with one output more gives the same bytes for all others.

mod budget;
mod chemistry;
mod kernels;
mod lab;
mod look;
mod mixing;
mod spread;
mod tally;

use super::average::{Means, blocks_per_group};
use super::error::RunError;
use super::parallel;
use super::program::unsound;
use super::reactions::Speciation;
use super::run::Run;
use super::schedule::Due;
use super::snapshot::{Snapshot, Values};
use crate::plan::{Output, OutputKind, Plan, Quantity};
use crate::state::grid::Grid;
use crate::state::particles::Block;
use chemistry::Needs;
use kernels::ByKernels;
pub use lab::{Draws, Instant, Lab};
use look::{Look, Sums};
use mixing::Mixing;
use std::borrow::Cow;
use tally::Tally;
pub use tally::lane_sum;

/// All snapshots of one due time, in the order of outputs.
pub fn observe<const D: usize>(
    run: &Run<D>,
    due: &Due,
    instant: &Instant<D>,
) -> Result<Vec<Snapshot>, RunError> {
    let program = &run.program;
    let means = means(run, instant);
    let mut own_means: Vec<(Grid<D>, Means)> = Vec::new();
    for &output_idx in &due.outputs {
        let output = &program.plan.outputs[output_idx];
        if output.kind == OutputKind::Mixing && !program.has_mixing() {
            let grid = tally::output_grid(program, output).ok_or_else(bad_bins)?;
            let means = average(run, instant, &grid);
            own_means.push((grid, means));
        }
    }
    let mut next_own = own_means.iter();
    let mut tallies = Vec::new();
    for &output_idx in &due.outputs {
        let output = &program.plan.outputs[output_idx];
        let mixing = (output.kind == OutputKind::Mixing).then(|| match next_own.next() {
            Some((grid, means)) => Mixing::new(program, output, means, Some(grid)),
            None => Mixing::new(program, output, &means, None),
        });
        tallies.push(Tally::new(run, output, mixing).ok_or_else(bad_bins)?);
    }
    let needs = Needs::of(program, &due.outputs);
    let values = sum(run, instant, &means, &needs, &tallies);
    if let Some((particle, why)) = run.reactions.speciation.as_ref().and_then(Speciation::failure) {
        let what = run.reactions.explain(program, why);
        return Err(RunError::Chemistry { step: due.steps, particle, what, why });
    }
    let mut by_kernels = None;
    let mut snapshot = |(&output_idx, mut values): (&usize, Values)| {
        let output = &program.plan.outputs[output_idx];
        if output.kind.is_by_kernels() {
            let mut own = by_kernels.take().map_or_else(|| ByKernels::new(run, due.t), Ok)?;
            values = own.values(output, &values)?;
            by_kernels = Some(own);
        }
        match values.overflow() {
            Some(column) => Err(overflow(program.plan, output, column, due.t)),
            None => Ok(Snapshot { output_idx, t: due.t, values }),
        }
    };
    due.outputs.iter().zip(values).map(&mut snapshot).collect()
}

/// Particles may have values that are numbers and sums, products or amounts that are none.
#[cold]
fn overflow(plan: &Plan, output: &Output, column: usize, t: f64) -> RunError {
    let name = |idx: usize| plan.species.get(idx).map_or("?", |species| species.name.as_str());
    let quantity = match output.quantities.get(column) {
        Some(Quantity::Species(a)) => name(*a).to_owned(),
        Some(Quantity::Pair(a, b)) => format!("{}, {}", name(*a), name(*b)),
        None => "?".to_owned(),
    };
    RunError::NonFiniteOutput { t, kind: output.kind, quantity }
}

fn bad_bins() -> RunError {
    unsound("an output whose bins do not make a grid")
}

/// The bin means of the instant; nothing where no particle sees a mean.
fn means<'a, const D: usize>(run: &'a Run<D>, instant: &Instant<D>) -> Cow<'a, Means> {
    match instant {
        _ if !run.program.has_mixing() => Cow::Owned(Means::default()),
        Instant::Now if run.is_averaged => Cow::Borrowed(&run.means),
        Instant::Now | Instant::Between(_) => Cow::Owned(average(run, instant, &run.program.grid)),
    }
}

/// Sums for all outputs due. Outputs that group blocks alike share their passes over the particles;
/// how an output groups them does not hang on the others.
fn sum<const D: usize>(
    run: &Run<D>,
    instant: &Instant<D>,
    means: &Means,
    needs: &Needs,
    tallies: &[Tally<D>],
) -> Vec<Values> {
    let n_particles = run.program.plan.particles.count;
    let size = |tally: &Tally<D>| blocks_per_group(n_particles, tally.n_places());
    let mut sizes: Vec<usize> = tallies.iter().map(size).collect();
    sizes.sort_unstable();
    sizes.dedup();
    let mut values: Vec<(usize, Values)> = Vec::new();
    for blocks_per_group in sizes {
        let alike = tallies.iter().enumerate().filter(|(_, tally)| size(tally) == blocks_per_group);
        let (places, alike): (Vec<usize>, Vec<&Tally<D>>) = alike.unzip();
        let found = sum_alike(run, instant, means, needs, &alike, blocks_per_group);
        values.extend(places.into_iter().zip(found));
    }
    values.sort_by_key(|(place, _)| *place);
    values.into_iter().map(|(_, values)| values).collect()
}

/// Both passes over the particles, and what comes of them.
fn sum_alike<const D: usize>(
    run: &Run<D>,
    instant: &Instant<D>,
    means: &Means,
    needs: &Needs,
    tallies: &[&Tally<D>],
    blocks_per_group: usize,
) -> Vec<Values> {
    let first_at = offsets(tallies, |tally| tally.n_first());
    let second_at = offsets(tallies, |tally| tally.n_second());
    let (n_first, n_second) = (first_at[tallies.len()], second_at[tallies.len()]);
    let resolved = Some((means, needs));
    let mut first = Vec::new();
    if n_first > 0 {
        let sums = Sums::First { tallies, at: &first_at };
        first = sweep(run, instant, resolved, n_first, blocks_per_group, sums);
    }
    let mut second = Vec::new();
    if n_second > 0 {
        let sums = Sums::Second { tallies, first: &first, first_at: &first_at, at: &second_at };
        second = sweep(run, instant, resolved, n_second, blocks_per_group, sums);
    }
    let values = tallies.iter().enumerate().map(|(idx, tally)| {
        let first = first.get(first_at[idx]..first_at[idx + 1]).unwrap_or_default();
        let second = second.get(second_at[idx]..second_at[idx + 1]).unwrap_or_default();
        let listed = || particles(run, instant, (means, needs), tally.listed());
        tally.values(&run.program, first, second).unwrap_or_else(listed)
    });
    values.collect()
}

/// Where the sums of each tally start, and where the last one ends.
fn offsets<const D: usize>(tallies: &[&Tally<D>], len: impl Fn(&Tally<D>) -> usize) -> Vec<usize> {
    let mut offsets = vec![0];
    for tally in tallies {
        offsets.push(offsets[offsets.len() - 1] + len(tally));
    }
    offsets
}

/// Bin means of the carried columns at the instant.
fn average<const D: usize>(run: &Run<D>, instant: &Instant<D>, grid: &Grid<D>) -> Means {
    let stride = run.program.n_columns() + 1;
    let n_sums = grid.n_slots() * stride;
    let blocks_per_group = blocks_per_group(run.program.plan.particles.count, grid.n_slots());
    let sums = sweep(run, instant, None, n_sums, blocks_per_group, Sums::Columns { grid });
    let mut means = Means::default();
    means.assign(&run.program, &sums);
    means
}

/// Sums over all particles, chunk by chunk in groups of blocks, merged in order. Concentrations are
/// resolved if means are given.
fn sweep<const D: usize>(
    run: &Run<D>,
    instant: &Instant<D>,
    resolved: Option<(&Means, &Needs)>,
    n_sums: usize,
    blocks_per_group: usize,
    sums: Sums<D>,
) -> Vec<f64> {
    let groups: Vec<_> = run.blocks.chunks(blocks_per_group).collect();
    let partial = parallel::map(groups.len(), &|group_idx| {
        let mut target = vec![0.0; n_sums];
        run.labs.lend(
            || Lab::new(&run.program),
            |lab| {
                for block in groups[group_idx] {
                    for range in block.portions(instant.portion()) {
                        let target = &mut target[..];
                        run.width.run(Look { run, instant, resolved, block, range, lab, sums, target });
                    }
                }
            },
        );
        target
    });
    let mut merged = vec![0.0; n_sums];
    for group in partial {
        merged.iter_mut().zip(group).for_each(|(sum, part)| *sum += part);
    }
    merged
}

/// Every particle, in the order of numbers, with its concentrations of some species.
fn particles<const D: usize>(
    run: &Run<D>,
    instant: &Instant<D>,
    (means, needs): (&Means, &Needs),
    species: &[usize],
) -> Values {
    let n_species = species.len();
    let of_block = |block_idx: usize| {
        let block = &run.blocks[block_idx];
        let mut columns = vec![Vec::with_capacity(block.n_particles); D + n_species];
        run.labs.lend(
            || Lab::new(&run.program),
            |lab| {
                for range in block.portions(instant.portion()) {
                    let resolved = Some((means, needs));
                    let (sums, target) = (Sums::None, &mut [][..]);
                    run.width.run(Look { run, instant, resolved, block, range, lab, sums, target });
                    let sources = lab.positions.iter().chain(species.iter().map(|&idx| &lab.species[idx]));
                    columns
                        .iter_mut()
                        .zip(sources)
                        .for_each(|(column, source)| column.extend(&source[..lab.n]));
                }
            },
        );
        columns
    };
    let per_block: Vec<Vec<Vec<f64>>> = parallel::map(run.blocks.len(), &of_block);
    let order = order(&run.blocks);
    let column = |idx: usize| {
        let values: Vec<f64> = per_block.iter().flat_map(|columns| columns[idx].iter().copied()).collect();
        if order.is_empty() { values } else { order.iter().map(|&place| values[place]).collect() }
    };
    Values::Particles {
        positions: (0..D).map(column).collect(),
        concentrations: (D..D + n_species).map(column).collect(),
    }
}

/// Concentrations of the species in parcels that are on their way, as some outputs need them: with the means of the
/// bins that they were in.
pub fn concentrations<const D: usize>(
    run: &Run<D>,
    block: &Block<D>,
    outputs: &[usize],
    step: u64,
) -> Result<Vec<Vec<f64>>, RunError> {
    let needs = Needs::of(&run.program, outputs);
    let mut values = vec![Vec::with_capacity(block.n_particles); run.program.plan.species.len()];
    run.labs.lend(
        || Lab::new(&run.program),
        |lab| {
            let instant = Instant::Now;
            for range in block.portions(instant.portion()) {
                let resolved = Some((&run.means, &needs));
                let (sums, target) = (Sums::None, &mut [][..]);
                run.width.run(Look { run, instant: &instant, resolved, block, range, lab, sums, target });
                values
                    .iter_mut()
                    .zip(&lab.species)
                    .for_each(|(column, source)| column.extend(&source[..lab.n]));
            }
        },
    );
    match run.reactions.speciation.as_ref().and_then(Speciation::failure) {
        None => Ok(values),
        Some((particle, why)) => {
            let what = run.reactions.explain(&run.program, why);
            Err(RunError::Chemistry { step: step + 1, particle, what, why })
        }
    }
}

/// Places of all particles in the order of their numbers; nothing where they lie in that order.
fn order<const D: usize>(blocks: &[Block<D>]) -> Vec<usize> {
    let ids: Vec<u64> = blocks.iter().flat_map(|block| block.ids.iter().copied()).collect();
    let mut order: Vec<usize> = (0..ids.len()).collect();
    order.sort_unstable_by_key(|&place| ids[place]);
    order
}
