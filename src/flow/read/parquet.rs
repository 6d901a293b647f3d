//! Parquet tables of a flow.
//!
//! Owns the way from columns to rows of a flow. May use the columns and the tables. It deliberately knows no
//! types of Parquet.

use super::error::{Kind, Place, ReadError};
use super::table::{Frame, Layout, Raw, RowPlaces, axis_of};
use crate::data::parquet::columns;
use crate::flow::FaceFlow;

/// The flow of a Parquet table.
pub fn flow(bytes: Vec<u8>, layout: &Layout, frame: &Frame) -> Result<FaceFlow, ReadError> {
    let names: Vec<&str> = layout.numeric().iter().map(|wanted| wanted.name.as_str()).collect();
    let mut normals = Vec::new();
    let numbers = match layout.normal() {
        None => columns(bytes.into(), &names, None, usize::MAX)?,
        Some(name) => {
            let mut take = |row: usize, text: Option<&str>| {
                normals.push(text.and_then(axis_of).ok_or_else(|| {
                    let message = format!("column `{name}` names no axis here");
                    ReadError::new(Kind::Value, message).at(Place::Row(row + 1)).help("write x, y or z")
                })?);
                Ok(())
            };
            columns(bytes.into(), &names, Some((name, &mut take)), usize::MAX)?
        }
    };
    layout.flow(Raw { numbers, normals, places: RowPlaces::Counted }, frame)
}
