//! The figure of a run: a page of panels under one key.
//!
//! Owns the page's layout. May use `panels` and `panel`. It deliberately embeds no fonts and no
//! clock: the same results give the same bytes.

use super::canvas::{Canvas, page};
use super::panel::{Frame, KeyEntry, Panel, draw, draw_entry, entry_width, lettering};
use super::panels::Story;
use crate::engine::snapshot::Snapshot;
use crate::measure::Curve;
use crate::plan::Plan;
use crate::table::Record;
use plotters::style::text_anchor::{HPos, VPos};

/// Width and height of a panel with its labels.
const PANEL: (f64, f64) = (340.0, 270.0);
const MARGIN: f64 = 14.0;
const TITLE_HEIGHT: f64 = 30.0;
const KEY_ROW: f64 = 20.0;
/// More panels than this are left out, and the page says so.
const MOST_PANELS: usize = 12;

/// The run's outputs with their references, as SVG.
///
/// Dots are the run, lines the references. Per species of a profile and pair of a covariance a panel
/// with a colour for each time; per total and mixing output a panel over time; per map its last time.
pub fn figure(plan: &Plan, record: &Record, snapshots: &[Snapshot], curves: &[Curve]) -> String {
    let story = Story::new(plan, record.n_axes, snapshots, curves);
    let mut panels = story.panels();
    let n_left_out = panels.len().saturating_sub(MOST_PANELS);
    panels.truncate(MOST_PANELS);
    name_panels(&mut panels);

    let n_columns = match panels.len() {
        0 | 1 => 1,
        2 | 4 => 2,
        _ => 3,
    };
    sheet(Some(&title(record, n_left_out)), story.key(), &panels, PANEL, n_columns)
}

/// Panels of one size in rows under a title and one key.
pub fn sheet(
    title: Option<&str>,
    key: Vec<KeyEntry>,
    panels: &[Panel],
    panel: (f64, f64),
    n_columns: usize,
) -> String {
    let n_rows = panels.len().div_ceil(n_columns).max(1);
    let width = n_columns as f64 * panel.0 + 2.0 * MARGIN;
    let key = wrapped(key, width - 2.0 * MARGIN);
    let title_height = if title.is_some() { TITLE_HEIGHT } else { 0.0 };
    let head = MARGIN + title_height + KEY_ROW * key.len() as f64;
    let height = head + n_rows as f64 * panel.1 + MARGIN;
    page((width, height), |canvas| {
        write_head(canvas, title, &key);
        for (idx, one) in panels.iter().enumerate() {
            let left = MARGIN + (idx % n_columns) as f64 * panel.0;
            let top = head + (idx / n_columns) as f64 * panel.1;
            draw(canvas, one, Frame { left, top, right: left + panel.0, bottom: top + panel.1 });
        }
        if panels.is_empty() {
            let text = "This run has no output that can be drawn.";
            canvas.letters(text, (MARGIN, head + 20.0), lettering(13.0, HPos::Left, VPos::Top));
        }
    })
}

fn title(record: &Record, n_left_out: usize) -> String {
    let title = record.title.as_deref().unwrap_or(&record.scene_name);
    match n_left_out {
        0 => title.to_owned(),
        n => format!("{title} ({n} more panels are not shown)"),
    }
}

/// (a), (b), … where there are several.
fn name_panels(panels: &mut [Panel]) {
    if panels.len() > 1 {
        for (panel, letter) in panels.iter_mut().zip('a'..='z') {
            panel.title = format!("({letter}) {}", panel.title);
        }
    }
}

/// The entries in rows of at most `width`.
fn wrapped(key: Vec<KeyEntry>, width: f64) -> Vec<Vec<KeyEntry>> {
    let mut rows: Vec<Vec<KeyEntry>> = Vec::new();
    let mut taken = f64::INFINITY;
    for entry in key {
        let needed = entry_width(&entry);
        if taken + needed > width {
            rows.push(Vec::new());
            taken = 0.0;
        }
        taken += needed;
        rows.last_mut().into_iter().for_each(|row| row.push(entry.clone()));
    }
    rows
}

fn write_head(canvas: &mut Canvas, title: Option<&str>, key: &[Vec<KeyEntry>]) {
    let mut top = MARGIN;
    if let Some(title) = title {
        canvas.letters(title, (MARGIN + 6.0, MARGIN), lettering(16.0, HPos::Left, VPos::Top));
        top += TITLE_HEIGHT;
    }
    for (row, entries) in key.iter().enumerate() {
        let mut at = (MARGIN + 6.0, top + KEY_ROW * (row as f64 + 0.4));
        for entry in entries {
            at.0 += draw_entry(canvas, entry, at);
        }
    }
}
