//! Ends of axes, as `lamella density` is told of them.
//!
//! Owns the words of `--ends`. May use units and the engine's densities. It deliberately estimates nothing.

use super::Stopped;
use super::density::wrong;
use super::density_points::Points;
use lamella::engine::density::End;
use lamella::units::{Dimension, Unit};

/// What one end is.
#[derive(Debug, Clone)]
enum Word {
    Plain(End),
    /// A density, and perhaps its unit.
    Hold(f64, Option<(String, Unit)>),
}

/// Both ends of an axis, and how they were written.
#[derive(Debug, Clone)]
pub(super) struct Ends {
    pub(super) text: String,
    words: [Word; 2],
}

impl Ends {
    /// A word for both, or two with a colon between.
    pub(super) fn parse(text: &str) -> Result<Self, String> {
        let text = text.trim();
        let words = match text.split_once(':') {
            None => [Word::parse(text)?, Word::parse(text)?],
            Some((low, high)) => [Word::parse(low)?, Word::parse(high)?],
        };
        let is_ring = |word: &Word| matches!(word, Word::Plain(End::Wrap));
        if is_ring(&words[0]) != is_ring(&words[1]) {
            return Err("ends are joined to each other: both are periodic, or none".to_owned());
        }
        Ok(Self { text: text.to_owned(), words })
    }

    pub(super) fn holds(&self) -> bool {
        self.words.iter().any(|word| matches!(word, Word::Hold(..)))
    }

    /// Whether kernels are mirrored with the other sign at one of them.
    pub(super) fn is_odd(&self) -> bool {
        self.holds() || self.words.iter().any(|word| matches!(word, Word::Plain(End::Sink)))
    }

    /// As the engine takes them; densities are weights per length, area or volume.
    pub(super) fn of(&self, points: &Points, d: usize) -> Result<[End; 2], Stopped> {
        let [low, high] = &self.words;
        Ok([low.end(points, d)?, high.end(points, d)?])
    }
}

impl Word {
    fn parse(text: &str) -> Result<Self, String> {
        let text = text.trim();
        let value = match text {
            "reflect" => return Ok(Self::Plain(End::Mirror)),
            "periodic" => return Ok(Self::Plain(End::Wrap)),
            "absorb" => return Ok(Self::Plain(End::Sink)),
            _ => text.strip_prefix("hold ").ok_or_else(|| {
                format!("`{text}` is no end: reflect, periodic, absorb, or hold with a density such as hold 2 kg/m^2")
            })?,
        };
        let value = value.trim();
        let (number, unit) = value.split_once(' ').unwrap_or((value, ""));
        let held = number.parse::<f64>().ok().filter(|held| *held >= 0.0 && held.is_finite());
        let held = held.ok_or_else(|| format!("`{number}` is no density: a number of zero or more"))?;
        let unit = unit.trim();
        if unit.is_empty() {
            return Ok(Self::Hold(held, None));
        }
        let known = Unit::parse(unit).map_err(|_| format!("`{unit}` is no unit"))?;
        Ok(Self::Hold(held, Some((unit.to_owned(), known))))
    }

    fn end(&self, points: &Points, d: usize) -> Result<End, Stopped> {
        let (value, unit) = match self {
            Self::Plain(end) => return Ok(*end),
            Self::Hold(value, unit) => (value, unit),
        };
        let Some((text, unit)) = unit else { return Ok(End::Held(*value)) };
        let weight = points.dimensions.get(d).copied().unwrap_or(Dimension::NONE);
        let wanted = points.dimensions[..d].iter().fold(weight, |all, length| all.over(*length));
        if unit.dimension != wanted {
            let message = format!(
                "an end holds a density in {text}: weights per length, area or volume are {}",
                wanted.describe()
            );
            return Err(wrong(&message));
        }
        Ok(End::Held(value * unit.factor()))
    }
}
