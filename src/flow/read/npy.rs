//! Arrays of NumPy: the NPY format, versions 1 to 3.
//!
//! Owns the header, the order of elements, and the two layouts of a flow: discharge at the middles of
//! cells, and one array per direction of faces. May use the flow. It deliberately reads numbers only:
//! records and pickled objects are refused. The format is a page long; a crate for it would bring more code
//! than is here.

use super::PorosityOf;
use super::bytes::Bytes;
use super::centred::{Centred, Quantity, check_porosity, into_faces};
use super::error::{Kind, Place, ReadError};
use super::npy_header::{Header, Number};
use crate::flow::{Cells, FaceFlow};

/// Numbers in C order: the last index is fastest.
#[derive(Debug, Clone, PartialEq)]
pub struct Array {
    pub shape: Vec<usize>,
    pub values: Vec<f64>,
}

/// What an array does not know of itself.
pub struct Frame<'a> {
    /// Corners of the grid, m; axes that the domain does not have reach from 0 to 1.
    pub low: [f64; 3],
    pub high: [f64; 3],
    /// Of the domain.
    pub axes: usize,
    /// What the file's unit is in m/s.
    pub factor: f64,
    pub quantity: Quantity,
    pub porosity: PorosityOf<'a>,
}

/// The array of a file.
pub fn array(bytes: &[u8]) -> Result<Array, ReadError> {
    let mut bytes = Bytes::new(bytes);
    let header = Header::read(&mut bytes)?;
    let n =
        header.shape.iter().try_fold(1usize, |n, &length| n.checked_mul(length)).ok_or_else(|| {
            ReadError::new(Kind::Damaged, format!("the shape {:?} has no size", header.shape))
        })?;
    let start = bytes.place();
    let data = bytes.take_many(n, header.number.size(), "the elements")?;
    if !bytes.is_at_end() {
        let message = format!("{} bytes follow the last element", bytes.rest().len());
        return Err(ReadError::new(Kind::Damaged, message).at(bytes.place()));
    }
    let mut values = header.number.values(data, header.is_big_endian);
    if let Some(idx) = values.iter().position(|value| !value.is_finite()) {
        let Place::Byte(start) = start else { unreachable!("bytes are counted") };
        let message = format!("element {idx} in the order of the file is {}", values[idx]);
        return Err(ReadError::new(Kind::Value, message)
            .at(Place::Byte(start + idx * header.number.size()))
            .help("a flow has a value everywhere: write 0 where there is none"));
    }
    if header.is_fortran_order {
        values = last_fastest(&values, &header.shape);
    }
    Ok(Array { shape: header.shape, values })
}

/// From the order with the first index fastest to that with the last.
fn last_fastest(values: &[f64], shape: &[usize]) -> Vec<f64> {
    let mut strides = Vec::with_capacity(shape.len());
    let mut stride = 1;
    for length in shape {
        strides.push(stride);
        stride *= length;
    }
    let mut index = vec![0; shape.len()];
    let mut ordered = Vec::with_capacity(values.len());
    for _ in 0..values.len() {
        ordered.push(values[index.iter().zip(&strides).map(|(idx, stride)| idx * stride).sum::<usize>()]);
        for axis in (0..shape.len()).rev() {
            index[axis] += 1;
            if index[axis] < shape[axis] {
                break;
            }
            index[axis] = 0;
        }
    }
    ordered
}

/// A flow from values at the middles of cells: an array `(nx[, ny[, nz]], components)`, or `(nx)`.
pub fn centred(array: &Array, frame: &Frame) -> Result<FaceFlow, ReadError> {
    let axes = frame.axes;
    let is_plain = axes == 1 && array.shape.len() == 1;
    if !is_plain && (array.shape.len() != axes + 1 || array.shape[axes] != axes) {
        let wanted = ["(nx) or (nx, 1)", "(nx, ny, 2)", "(nx, ny, nz, 3)"][axes - 1];
        let message = format!("the array has the shape {:?}", array.shape);
        let help = match array.shape.len() == axes + 1 && array.shape[0] == axes {
            true => {
                "its components come first: `numpy.moveaxis(array, 0, -1)` puts them last, and `array.T` turns round \
                     all axes of an array that counts z, y, x; "
            }
            false => "",
        };
        return Err(ReadError::new(Kind::Mismatch, message)
            .help(format!("{help}discharge at the middles of cells has the shape {wanted}")));
    }
    let cells = cells(&array.shape[..axes], frame)?;
    let component = |axis: usize| array.values.iter().skip(axis).step_by(axes).map(|q| q * frame.factor);
    let q = (0..axes).map(|axis| component(axis).collect()).collect();
    let porosity = porosity(&cells, frame.porosity)?;
    into_faces(Centred { cells, quantity: frame.quantity, q, porosity, head: None, conductivity: None })
}

/// A flow from one array per direction, each with one face more along its own axis than there are cells.
pub fn staggered(arrays: &[Array], frame: &Frame) -> Result<FaceFlow, ReadError> {
    let axes = frame.axes;
    if arrays.len() != axes {
        let message = format!("{} arrays of faces for {axes} axes", arrays.len());
        return Err(ReadError::new(Kind::Mismatch, message).help("one array per axis of the domain"));
    }
    if frame.quantity == Quantity::PoreVelocity {
        let message = "a pore velocity at faces has no one porosity to go with";
        return Err(ReadError::new(Kind::Unsupported, message).help("give the specific discharge at faces"));
    }
    let first = &arrays[0].shape;
    let n: Vec<usize> =
        first.iter().enumerate().map(|(axis, n)| n.saturating_sub((axis == 0) as usize)).collect();
    for (axis, array) in arrays.iter().enumerate() {
        let fits =
            array.shape.len() == axes
                && array.shape.iter().enumerate().all(|(other, &length)| {
                    n.get(other).is_some_and(|n| length == n + (other == axis) as usize)
                });
        if !fits {
            let name = ["x", "y", "z"][axis];
            let turned: Vec<Vec<usize>> =
                arrays.iter().map(|array| array.shape.iter().rev().copied().collect()).collect();
            if fit(&turned) {
                let message = format!(
                    "the axes of the arrays are swapped: that of {name} has the shape {:?}",
                    array.shape
                );
                return Err(ReadError::new(Kind::Mismatch, message).help(format!(
                    "axes come in the order x, y, z, as in {:?}: `numpy.save(file, array.T)`",
                    turned[axis]
                )));
            }
            let message = format!("the faces normal to {name} have the shape {:?}", array.shape);
            return Err(ReadError::new(Kind::Mismatch, message).help(format!(
                "with {n:?} cells, as the faces normal to x have it, there is one face more along {name} and as \
                 many as cells along the others"
            )));
        }
    }
    let cells = cells(&n, frame)?;
    let flux = [0, 1, 2].map(|axis| match arrays.get(axis) {
        Some(array) => array.values.iter().map(|q| q * frame.factor).collect(),
        None => vec![0.0; cells.n_faces(axis)],
    });
    let porosity = porosity(&cells, frame.porosity)?;
    Ok(FaceFlow { cells, flux, porosity, head: None, conductivity: None, sinks: Vec::new() })
}

/// Whether shapes are those of faces normal to x, y, z of the same cells.
fn fit(shapes: &[Vec<usize>]) -> bool {
    let cells = |axis: usize, shape: &Vec<usize>| {
        let own = |(other, n): (usize, &usize)| n.checked_sub(usize::from(other == axis));
        shape.iter().enumerate().map(own).collect::<Option<Vec<_>>>()
    };
    let all: Vec<_> = shapes.iter().enumerate().map(|(axis, shape)| cells(axis, shape)).collect();
    let is_one =
        |own: &Option<Vec<usize>>| own.as_ref().is_some_and(|n| n.len() == shapes.len()) && *own == all[0];
    all.iter().all(is_one)
}

fn cells(n: &[usize], frame: &Frame) -> Result<Cells, ReadError> {
    let mut all = [1; 3];
    all[..n.len()].copy_from_slice(n);
    let empty = || ReadError::new(Kind::Mismatch, format!("there are no cells: {n:?}"));
    if all.contains(&0) {
        return Err(empty());
    }
    Cells::equal(frame.low, frame.high, all).ok_or_else(empty)
}

/// Porosity of every cell.
pub(super) fn porosity(cells: &Cells, of: PorosityOf) -> Result<Vec<f64>, ReadError> {
    let at = |cell| of(cell, cells.centre(cells.place(cell)));
    let porosity: Vec<f64> = (0..cells.n_cells()).map(at).collect();
    check_porosity(&porosity)?;
    Ok(porosity)
}

impl Number {
    fn values(self, data: &[u8], is_big_endian: bool) -> Vec<f64> {
        match (self, is_big_endian) {
            (Self::Single, false) => {
                data.as_chunks().0.iter().map(|x| f32::from_le_bytes(*x).into()).collect()
            }
            (Self::Single, true) => {
                data.as_chunks().0.iter().map(|x| f32::from_be_bytes(*x).into()).collect()
            }
            (Self::Double, false) => data.as_chunks().0.iter().map(|x| f64::from_le_bytes(*x)).collect(),
            (Self::Double, true) => data.as_chunks().0.iter().map(|x| f64::from_be_bytes(*x)).collect(),
        }
    }
}
