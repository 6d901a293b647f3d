//! Sums of fields with kernels of any width, one place at a time.
//!
//! Owns nothing but the order of work. May use fields, taps and stencils. It deliberately takes no short cut: what ladders give
//! is compared with this.

use super::lattice::{AXES, Field, Lattice};
use super::stencil::Gathering;
use super::taps::{Integral, Line, Taps};
use crate::maths::wide::Width;

/// Sums of fields of one window with a Gaussian of an isotropic width in a cell.
pub fn sums(
    (lattice, integral, width): (&Lattice, Integral, Width),
    fields: &[&Field],
    (cell, deviation): ([usize; AXES], f64),
    taps: &mut [Taps; AXES],
    sums: &mut [f64],
) {
    for axis in 0..AXES {
        if axis + lattice.d < AXES {
            taps[axis].be_one();
            continue;
        }
        let line = Line::of(lattice, axis, 1);
        let own = deviation / lattice.edge[axis];
        line.gaussian(integral, cell[axis], (own, own), &mut taps[axis]);
        taps[axis].cut(fields[0], axis);
    }
    taps[AXES - 1].pad();
    width.run(Gathering { taps, fields, sums });
}
