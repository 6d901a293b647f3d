//! Values as bytes and back.
//!
//! Owns the encoding of frames: little-endian, lengths before contents, no padding. May use the shapes
//! that it encodes. It deliberately trusts no length: what does not fit is no value.

use crate::engine::snapshot::{MixingState, Row, Snapshot, Values};
use crate::table::{ErrorRow, Norms, PointRow, Status, Swept, SweptValue, Value};

/// A value with an encoding; `take` gives nothing for bytes that are not whole.
pub trait Code: Sized {
    fn put(&self, out: &mut Vec<u8>);
    fn take(input: &mut &[u8]) -> Option<Self>;
}

macro_rules! numbers {
    ($($kind:ty),*) => {$(
        impl Code for $kind {
            fn put(&self, out: &mut Vec<u8>) {
                out.extend_from_slice(&self.to_le_bytes());
            }

            fn take(input: &mut &[u8]) -> Option<Self> {
                let (bytes, rest) = input.split_first_chunk()?;
                *input = rest;
                Some(Self::from_le_bytes(*bytes))
            }
        }
    )*};
}

numbers!(u8, u16, u32, u64, i64, f64);

macro_rules! structs {
    ($($kind:ty { $($field:ident),* $(,)? })*) => {$(
        impl Code for $kind {
            fn put(&self, out: &mut Vec<u8>) {
                $(self.$field.put(out);)*
            }

            fn take(input: &mut &[u8]) -> Option<Self> {
                Some(Self { $($field: Code::take(input)?),* })
            }
        }
    )*};
}

structs! {
    Swept { name, value }
    Value { name, unit, value }
    Norms { l1, l2, linf, rmse }
    MixingState { m, m_mean, m_cov, gamma }
    Row { place, numbers }
    ErrorRow {
        point, replicate, t, reference, output, kind, species_a, species_b, n, n_empty, norms, relative, noise,
        unit,
    }
    PointRow {
        point, replicate, key, swept, seed, status, error_code, error_message, wall, loop_wall, cpu,
        compile_wall, write_wall, peak_memory, particles, step, duration, steps, sub_steps, mass_defect, values, version,
        numerics, host, threads, started, finished,
    }
}

impl Code for usize {
    fn put(&self, out: &mut Vec<u8>) {
        (*self as u64).put(out);
    }

    fn take(input: &mut &[u8]) -> Option<Self> {
        usize::try_from(u64::take(input)?).ok()
    }
}

impl Code for [u8; 32] {
    fn put(&self, out: &mut Vec<u8>) {
        out.extend_from_slice(self);
    }

    fn take(input: &mut &[u8]) -> Option<Self> {
        let (bytes, rest) = input.split_first_chunk()?;
        *input = rest;
        Some(*bytes)
    }
}

impl Code for String {
    fn put(&self, out: &mut Vec<u8>) {
        self.len().put(out);
        out.extend_from_slice(self.as_bytes());
    }

    fn take(input: &mut &[u8]) -> Option<Self> {
        let n = usize::take(input)?;
        let (bytes, rest) = input.split_at_checked(n)?;
        *input = rest;
        String::from_utf8(bytes.to_vec()).ok()
    }
}

impl<T: Code> Code for Option<T> {
    fn put(&self, out: &mut Vec<u8>) {
        u8::from(self.is_some()).put(out);
        self.iter().for_each(|value| value.put(out));
    }

    fn take(input: &mut &[u8]) -> Option<Self> {
        match u8::take(input)? {
            0 => Some(None),
            1 => Some(Some(T::take(input)?)),
            _ => None,
        }
    }
}

impl<T: Code> Code for Vec<T> {
    fn put(&self, out: &mut Vec<u8>) {
        self.len().put(out);
        self.iter().for_each(|value| value.put(out));
    }

    fn take(input: &mut &[u8]) -> Option<Self> {
        let n = usize::take(input)?;
        // Every value takes a byte at least: a length beyond what is left is no length.
        let mut values = Vec::with_capacity(n.min(input.len()));
        for _ in 0..n {
            values.push(T::take(input)?);
        }
        Some(values)
    }
}

impl Code for Status {
    fn put(&self, out: &mut Vec<u8>) {
        match self {
            Self::Done => 0_u8,
            Self::Failed => 1,
            Self::Interrupted => 2,
        }
        .put(out);
    }

    fn take(input: &mut &[u8]) -> Option<Self> {
        [Self::Done, Self::Failed, Self::Interrupted].get(usize::from(u8::take(input)?)).copied()
    }
}

impl Code for SweptValue {
    fn put(&self, out: &mut Vec<u8>) {
        match self {
            Self::Real(value, unit) => {
                0_u8.put(out);
                value.put(out);
                unit.put(out);
            }
            Self::Integer(value) => {
                1_u8.put(out);
                value.put(out);
            }
            Self::Text(text) => {
                2_u8.put(out);
                text.put(out);
            }
        }
    }

    fn take(input: &mut &[u8]) -> Option<Self> {
        Some(match u8::take(input)? {
            0 => Self::Real(f64::take(input)?, String::take(input)?),
            1 => Self::Integer(i64::take(input)?),
            2 => Self::Text(String::take(input)?),
            _ => return None,
        })
    }
}

impl Code for Snapshot {
    fn put(&self, out: &mut Vec<u8>) {
        self.output_idx.put(out);
        self.t.put(out);
        self.values.put(out);
    }

    fn take(input: &mut &[u8]) -> Option<Self> {
        Some(Self { output_idx: Code::take(input)?, t: Code::take(input)?, values: Code::take(input)? })
    }
}

impl Code for Values {
    fn put(&self, out: &mut Vec<u8>) {
        match self {
            Self::Binned { mean, standard_error, n_particles } => {
                0_u8.put(out);
                mean.put(out);
                standard_error.put(out);
                n_particles.put(out);
            }
            Self::Covariance { covariance, n_particles } => {
                1_u8.put(out);
                covariance.put(out);
                n_particles.put(out);
            }
            Self::Total { amount } => {
                2_u8.put(out);
                amount.put(out);
            }
            Self::Mixing(states) => {
                3_u8.put(out);
                states.put(out);
            }
            Self::Particles { positions, concentrations } => {
                4_u8.put(out);
                positions.put(out);
                concentrations.put(out);
            }
            Self::Rows(rows) => {
                5_u8.put(out);
                rows.put(out);
            }
        }
    }

    fn take(input: &mut &[u8]) -> Option<Self> {
        Some(match u8::take(input)? {
            0 => Self::Binned {
                mean: Code::take(input)?,
                standard_error: Code::take(input)?,
                n_particles: Code::take(input)?,
            },
            1 => Self::Covariance { covariance: Code::take(input)?, n_particles: Code::take(input)? },
            2 => Self::Total { amount: Code::take(input)? },
            3 => Self::Mixing(Code::take(input)?),
            4 => Self::Particles { positions: Code::take(input)?, concentrations: Code::take(input)? },
            5 => Self::Rows(Code::take(input)?),
            _ => return None,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn snapshots() -> Vec<Snapshot> {
        let state = MixingState { m: 1.0, m_mean: 2.0, m_cov: -1.0, gamma: -0.5 };
        let all = [
            Values::Binned {
                mean: vec![vec![1.0, f64::INFINITY]],
                standard_error: vec![vec![0.0, -0.0]],
                n_particles: vec![3, u64::MAX],
            },
            Values::Covariance { covariance: vec![vec![1e-300]], n_particles: vec![1] },
            Values::Total { amount: vec![] },
            Values::Mixing(vec![state, state]),
            Values::Particles { positions: vec![vec![1.0]], concentrations: vec![vec![2.0], vec![3.0]] },
            Values::Rows(vec![vec![Row { place: 2, numbers: vec![1.5, -3.0] }], vec![]]),
        ];
        let snapshot = |(output_idx, values)| Snapshot { output_idx, t: 0.25, values };
        all.into_iter().enumerate().map(snapshot).collect()
    }

    #[test]
    fn what_is_put_is_taken() {
        let mut bytes = Vec::new();
        let (values, text) = (snapshots(), Some("ü".to_owned()));
        values.put(&mut bytes);
        Code::put(&text, &mut bytes);
        SweptValue::Real(1.5, "m".to_owned()).put(&mut bytes);
        let mut input = &bytes[..];
        assert_eq!(Vec::<Snapshot>::take(&mut input), Some(values));
        assert_eq!(<Option<String> as Code>::take(&mut input), Some(text));
        assert_eq!(SweptValue::take(&mut input), Some(SweptValue::Real(1.5, "m".to_owned())));
        assert!(input.is_empty());
    }

    /// Every way to cut the bytes, and lengths beyond all memory.
    #[test]
    fn what_is_not_whole_is_nothing() {
        let mut bytes = Vec::new();
        snapshots().put(&mut bytes);
        for end in 0..bytes.len() {
            assert_eq!(Vec::<Snapshot>::take(&mut &bytes[..end]), None);
        }
        let mut long = Vec::new();
        u64::MAX.put(&mut long);
        assert_eq!(Vec::<f64>::take(&mut &long[..]), None);
        assert_eq!(String::take(&mut &long[..]), None);
    }
}
