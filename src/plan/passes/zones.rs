//! Zones: empty ones go, instant ones are not stored, equal ones become one.

use super::Draft;
use crate::plan::{Zone, ZoneRate};

pub(super) fn run(draft: &mut Draft) {
    let Some(mixing) = &mut draft.plan.mixing else { return };
    let mut notes = Vec::new();
    let zones = std::mem::take(&mut mixing.zones);
    let (empty, mut zones): (Vec<Zone>, Vec<Zone>) = zones.into_iter().partition(|zone| zone.fraction == 0.0);
    for zone in empty {
        notes.push((format!("zone `{}`", zone.name), "its fraction is zero".to_owned()));
    }
    let why = match mixing.averaging {
        None => "instant: always at the mean of its bin",
        Some(_) => "instant: always at the mean, which a particle stores once",
    };
    for zone in &mut zones {
        if zone.rate == ZoneRate::Instant && zone.is_stored {
            zone.is_stored = false;
            notes.push((format!("values of zone `{}` on particles", zone.name), why.to_owned()));
        }
    }
    mixing.is_well_mixed = zones.iter().all(|zone| zone.rate == ZoneRate::Instant);
    mixing.zones = zones;
    let is_idle = matches!(mixing.zones.as_slice(), [only] if only.rate == ZoneRate::Finite(0.0) && only.fraction == 1.0);
    if is_idle {
        draft.plan.mixing = None;
        notes.push(("mixing zones".to_owned(), "the only zone never exchanges".to_owned()));
    }
    for (what, why) in notes {
        draft.leave_out(what, why);
    }
}

/// Zones with one rate have one value: their fractions are added.
pub(super) fn merge_equal(draft: &mut Draft) {
    let Some(mixing) = &mut draft.plan.mixing else { return };
    let mut merged: Vec<Zone> = Vec::new();
    let mut notes = Vec::new();
    for zone in std::mem::take(&mut mixing.zones) {
        match merged.iter_mut().find(|known| known.rate == zone.rate) {
            Some(known) => {
                known.fraction += zone.fraction;
                notes.push((
                    format!("zone `{}`", zone.name),
                    format!("same rate as zone `{}`: one value serves both", known.name),
                ));
            }
            None => merged.push(zone),
        }
    }
    // Fractions that add up to one but for rounding are one, so that a lone idle zone is seen.
    if let [only] = merged.as_mut_slice()
        && (only.fraction - 1.0).abs() < 1e-9
    {
        only.fraction = 1.0;
    }
    mixing.zones = merged;
    for (what, why) in notes {
        draft.leave_out(what, why);
    }
    run(draft);
}
