//! Tables of numbers: the parts of `data` in the order of the grammar.
//!
//! Owns the shape of the statement. May use the parts beside it. It deliberately knows no unit.

use super::{Parts, spanned};
use crate::syntax::climb::Built;
use crate::syntax::grammar::Rule;
use crate::syntax::tree::{Data, DataColumn};

pub fn data(parts: &mut Parts) -> Built<Data> {
    let (name, path) = (parts.name()?, parts.text()?);
    let columns = super::statements::each(parts, Rule::column, column)?;
    let rule = parts.take(Rule::data_rule).map(|pair| Parts::of(parts.place, pair).name()).transpose()?;
    Ok(Data { name, path, columns, rule, doc: parts.optional_text()? })
}

fn column(parts: &mut Parts) -> Built<DataColumn> {
    let name = parts.name()?;
    let unit = parts.take(Rule::column_unit).map(|pair| Parts::of(parts.place, pair).need(Rule::unit));
    Ok(DataColumn { name, unit: unit.transpose()?.map(|pair| spanned(parts.place, &pair)) })
}
