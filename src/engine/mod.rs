//! Plan and seed in, snapshots out. (under construction)
pub mod snapshot;
