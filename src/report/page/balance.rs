//! What came and went by each door, at the last time of the last point.
//!
//! Owns one table for each output of a budget. May use `table::scan`. It deliberately draws nothing: over time the table
//! of budgets has it.

use super::html::{escape, paragraph, table};
use super::quantity::{number, shown};
use super::stats::Moments;
use super::study::Study;
use crate::table::scan::{Selection, parts, scan};
use crate::table::{Kind, TableError};
use std::collections::BTreeMap;
use std::path::Path;

/// Tables on the page.
const MOST_TABLES: usize = 6;

/// Entered, left and the difference of one place, as means over replicates.
#[derive(Default)]
struct Line {
    numbers: [Moments; 3],
}

/// A species of an output: places in the order of their rows.
struct Balance {
    output: u16,
    species: String,
    unit: String,
    t: f64,
    lines: Vec<(String, Line)>,
}

/// The budgets of the last point that is done; empty if there are none.
pub fn balances(folder: &Path, study: &Study) -> Result<String, TableError> {
    let done = study.points.iter().rev().find(|(_, point)| point.n_done > 0);
    let Some((point, _)) = done else { return Ok(String::new()) };
    let mut balances = read(folder, *point)?;
    balances.truncate(MOST_TABLES);
    Ok(balances.iter().map(html).collect())
}

fn html(balance: &Balance) -> String {
    let largest = balance.lines.iter().flat_map(|(_, line)| &line.numbers);
    let largest = largest.filter_map(Moments::mean).fold(0.0, |most: f64, value| most.max(value.abs()));
    let unit = shown(&balance.unit, largest);
    let text =
        |moments: &Moments| moments.mean().map_or_else(|| "–".to_owned(), |mean| number(mean / unit.factor));
    let rows: Vec<Vec<String>> = balance
        .lines
        .iter()
        .filter(|(place, line)| {
            let has_any = line.numbers.iter().any(|number| number.mean().is_some_and(|mean| mean != 0.0));
            has_any || place == "defect"
        })
        .map(|(place, line)| {
            let [entered, left, amount] = &line.numbers;
            vec![place.clone(), text(entered), text(left), text(amount)]
        })
        .collect();
    let heads = ["entered", "left", "entered less left"].map(|head| format!("{head} ({})", unit.text));
    let heads = ["place", &heads[0], &heads[1], &heads[2]];
    let time = super::quantity::with_unit(balance.t, "s");
    format!("<h3>{} until {}</h3>\n", escape(&balance.species), escape(&time))
        + &table(&heads, &rows)
        + &paragraph(
            "`inside` is what is there, `defect` what is missing; doors that nothing went through are left out.",
        )
}

/// A pass for the last time of each output, a pass for the values.
fn read(folder: &Path, point: u32) -> Result<Vec<Balance>, TableError> {
    let only = [point];
    let number = |value: Option<f64>| value.unwrap_or(f64::NAN);
    let mut last: BTreeMap<u16, f64> = BTreeMap::new();
    for part in parts(folder, Kind::Budget) {
        let selection =
            Selection { numbers: &["point", "output", "t"], points: Some(&only), ..Selection::default() };
        scan(&part, selection, |row| {
            if number(row.number(0)) == f64::from(point) {
                let t = last.entry(number(row.number(1)) as u16).or_insert(f64::NEG_INFINITY);
                *t = t.max(number(row.number(2)));
            }
        })?;
    }
    let mut balances: Vec<Balance> = Vec::new();
    for part in parts(folder, Kind::Budget) {
        let numbers = ["point", "output", "t", "entered", "left", "amount"];
        let words = ["species", "unit", "place"];
        scan(&part, Selection { numbers: &numbers, words: &words, points: Some(&only) }, |row| {
            let (output, t) = (number(row.number(1)) as u16, number(row.number(2)));
            if number(row.number(0)) != f64::from(point) || last.get(&output) != Some(&t) {
                return;
            }
            let species = row.word(0).unwrap_or_default();
            let is_mine = |balance: &Balance| balance.output == output && balance.species == *species;
            let idx = balances.iter().position(is_mine).unwrap_or_else(|| {
                let unit = row.word(1).unwrap_or_default().into_owned();
                balances.push(Balance { output, species: species.into_owned(), unit, t, lines: Vec::new() });
                balances.len() - 1
            });
            let place = row.word(2).unwrap_or_default();
            let lines = &mut balances[idx].lines;
            let line = lines.iter().position(|(other, _)| *other == *place).unwrap_or_else(|| {
                lines.push((place.into_owned(), Line::default()));
                lines.len() - 1
            });
            for (idx, moments) in lines[line].1.numbers.iter_mut().enumerate() {
                row.number(3 + idx).into_iter().for_each(|value| moments.add(value));
            }
        })?;
    }
    Ok(balances)
}
