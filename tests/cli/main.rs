//! The program, run as a user would: each command, each exit code, each way a file can be wrong.

mod basics;
mod cache;
mod density;
mod error_bars;
mod files;
mod flow_table;
mod numbers;
mod overhead;
mod program;
mod runs;
mod scenes;
mod stops;
mod stress;
mod used;
