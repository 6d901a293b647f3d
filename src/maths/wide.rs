//! Wide vector code on machines that have it, the same bits on those that do not.
//!
//! Owns the choice. May use nothing else of the crate. It deliberately offers no operations: plain
//! loops are compiled twice, and neither fuses multiplications with additions.

use pulp::{Arch, NullaryFnOnce};

/// Which code is run.
#[derive(Debug, Clone, Copy)]
pub struct Width(Arch);

impl Width {
    /// The widest code of this machine.
    pub fn widest() -> Self {
        Self(Arch::new())
    }

    /// What every x86-64 machine has, to compare.
    pub fn baseline() -> Self {
        Self(Arch::Scalar)
    }

    /// What they are called.
    pub fn name(self) -> &'static str {
        match self.0 {
            Arch::Scalar => "those of every machine of its kind",
            #[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
            Arch::V3(_) => "AVX2",
            #[allow(unreachable_patterns)] // Other machines have other arms.
            _ => "others",
        }
    }

    /// Runs an operation. Its `call` must be `#[inline(always)]`, as a closure is not compiled wide.
    #[inline(always)]
    pub fn run<T: NullaryFnOnce>(self, operation: T) -> T::Output {
        self.0.dispatch(operation)
    }
}
