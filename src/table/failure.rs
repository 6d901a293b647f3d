//! What can go wrong with files of results, in the user's words.
//!
//! Owns the errors of this module. May use nothing else. It deliberately prints nothing.

use std::fmt;
use std::io;
use std::path::{Path, PathBuf};

/// Why a table could not be written or read.
#[derive(Debug)]
pub enum TableError {
    /// The device, or the user's share of it, has no room left.
    DiskFull { file: PathBuf, bytes_written: u64 },
    /// The system does not let this user write there.
    NotAllowed { path: PathBuf },
    /// Any other refusal of the system.
    System { path: PathBuf, doing: &'static str, reason: io::Error },
    /// Another run is writing into the same folder.
    InUse { folder: PathBuf },
    /// A snapshot does not fit the plan's output; `what` names the column or the count that differs.
    Shape { output_idx: usize, what: &'static str, expected: usize, found: usize },
    /// The encoder or decoder of Parquet refused.
    Format { file: PathBuf, reason: String },
    /// A table that Lamella did not write, or of a later version.
    Foreign { file: PathBuf, reason: String },
}

impl TableError {
    /// An error of the system, sorted into what a user can do about it.
    pub fn system(path: &Path, doing: &'static str, reason: io::Error, bytes_written: u64) -> Self {
        match reason.kind() {
            io::ErrorKind::StorageFull | io::ErrorKind::QuotaExceeded => {
                Self::DiskFull { file: path.to_path_buf(), bytes_written }
            }
            io::ErrorKind::PermissionDenied | io::ErrorKind::ReadOnlyFilesystem => {
                Self::NotAllowed { path: path.to_path_buf() }
            }
            _ => Self::System { path: path.to_path_buf(), doing, reason },
        }
    }

    /// An error of the Parquet library; an error of the system inside it is taken out.
    pub fn parquet(path: &Path, reason: parquet::errors::ParquetError, bytes_written: u64) -> Self {
        use parquet::errors::ParquetError;
        let reason = match reason {
            ParquetError::External(inner) => match inner.downcast::<io::Error>() {
                Ok(inner) => return Self::system(path, "write", *inner, bytes_written),
                Err(inner) => inner.to_string(),
            },
            other => other.to_string(),
        };
        Self::Format { file: path.to_path_buf(), reason }
    }
}

impl fmt::Display for TableError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::DiskFull { file, bytes_written } => write!(
                f,
                "the disk is full: `{}` could not be finished after {bytes_written} bytes; results of an \
                 earlier run there are unchanged",
                file.display()
            ),
            Self::NotAllowed { path } => {
                write!(
                    f,
                    "no permission to write `{}`; choose another place with `--out DIR`",
                    path.display()
                )
            }
            Self::System { path, doing, reason } => {
                write!(f, "could not {doing} `{}`: {reason}", path.display())
            }
            Self::InUse { folder } => write!(
                f,
                "another run is writing into `{}`; wait for it, or choose another place with `--out DIR`",
                folder.display()
            ),
            Self::Shape { output_idx, what, expected, found } => {
                write!(f, "output {output_idx} of the plan has {expected} {what}, its snapshot has {found}")
            }
            Self::Format { file, reason } => {
                write!(f, "`{}` is not a whole Parquet file: {reason}", file.display())
            }
            Self::Foreign { file, reason } => {
                write!(f, "`{}` is not a table of this version of Lamella: {reason}", file.display())
            }
        }
    }
}

impl std::error::Error for TableError {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        match self {
            Self::System { reason, .. } => Some(reason),
            _ => None,
        }
    }
}
