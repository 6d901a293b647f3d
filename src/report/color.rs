//! Colours that readers with any colour vision can tell apart.
//!
//! Owns the palette and the colour map. May use nothing. It deliberately knows no meaning of a colour.

/// Red, green, blue.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Rgb(pub u8, pub u8, pub u8);

pub const BLACK: Rgb = Rgb(0, 0, 0);
pub const WHITE: Rgb = Rgb(255, 255, 255);
/// Axes and small text.
pub const INK: Rgb = Rgb(40, 40, 40);
/// Dots that stand for the run in any colour.
pub const FAINT: Rgb = Rgb(110, 110, 110);
/// Series in the background.
pub const PALE: Rgb = Rgb(185, 185, 185);
pub const GRID: Rgb = Rgb(228, 228, 228);
/// Bins without particles on a map.
pub const EMPTY: Rgb = Rgb(205, 205, 205);

/// The palette of Okabe and Ito without yellow, which is too pale for lines on white.
pub const SERIES: [Rgb; 7] = [
    Rgb(0, 114, 178),
    Rgb(213, 94, 0),
    Rgb(0, 158, 115),
    Rgb(204, 121, 167),
    Rgb(230, 159, 0),
    Rgb(86, 180, 233),
    BLACK,
];

/// Points of the viridis map at equal distances.
const VIRIDIS: [Rgb; 9] = [
    Rgb(68, 1, 84),
    Rgb(71, 44, 122),
    Rgb(59, 81, 139),
    Rgb(44, 113, 142),
    Rgb(33, 144, 141),
    Rgb(39, 173, 129),
    Rgb(92, 200, 99),
    Rgb(170, 220, 50),
    Rgb(253, 231, 37),
];

/// Colour of a fraction 0 … 1, from dark blue to yellow, evenly in lightness.
pub fn viridis(fraction: f64) -> Rgb {
    let place = fraction.clamp(0.0, 1.0) * (VIRIDIS.len() - 1) as f64;
    let below = (place.floor() as usize).min(VIRIDIS.len() - 2);
    blend(VIRIDIS[below], VIRIDIS[below + 1], place - below as f64)
}

/// `a` at 0, `b` at 1.
pub fn blend(a: Rgb, b: Rgb, fraction: f64) -> Rgb {
    let mix = |a: u8, b: u8| (f64::from(a) + (f64::from(b) - f64::from(a)) * fraction).round() as u8;
    Rgb(mix(a.0, b.0), mix(a.1, b.1), mix(a.2, b.2))
}
