//! Tables of numbers: the `data` statements, and calls of their columns as functions.
//!
//! Owns the way from a call such as `plume.c(x, y)` to a table of so many coordinates. May use the checker and
//! `data`. It deliberately finds no file: `data_files` does.

use super::check::Checker;
use super::collect::Statements;
use super::expression::{Expr, Type};
use super::scope::Origin;
use crate::data::{Column, DataFile, ReadError, Rule, Table};
use crate::diagnostic::codes::{D002, D004, D007, M001, T101, T102, U104};
use crate::diagnostic::{Diagnostic, did_you_mean};
use crate::source::Span;
use crate::syntax::tree;
use crate::units::{Dimension, Unit};
use std::sync::Arc;

mod extent;

pub(super) use extent::check_extents;

/// Columns that one table may have.
const MAX_COLUMNS: usize = 256;

/// A table whose file could be read.
#[derive(Clone)]
pub(in crate::scenario) struct Known {
    pub file: Arc<DataFile>,
    pub columns: Arc<Vec<Column>>,
    pub rule: Rule,
}

impl Known {
    /// Where a column stands.
    pub(super) fn column(&self, name: &str) -> Option<usize> {
        self.columns.iter().position(|column| column.name == name)
    }
}

/// Finds the files of all tables and reads their columns.
pub(super) fn read<'a>(checker: &mut Checker<'a>, statements: &Statements<'a>) {
    for statement in &statements.data {
        let known = table(checker, statement);
        checker.tables.entry(statement.name.value.clone()).or_insert(known);
    }
}

fn table<'a>(checker: &mut Checker<'a>, statement: &'a tree::Data) -> Option<Known> {
    let columns = columns(checker, statement);
    let words = [("linear", Rule::Linear), ("steps", Rule::Steps)];
    let rule = match &statement.rule {
        Some(word) => checker.word(word, "a rule between rows", &words),
        None => Some(Rule::Linear),
    };
    let file = checker.file_of_numbers(&statement.path);
    let (columns, rule, file) = (columns?, rule?, file?);
    if let Err(error) = file.columns(&columns) {
        checker.report(unread(statement, &error));
        return None;
    }
    Some(Known { file, columns: Arc::new(columns), rule })
}

fn columns<'a>(checker: &mut Checker<'a>, statement: &'a tree::Data) -> Option<Vec<Column>> {
    if let Some(one_more) = statement.columns.get(MAX_COLUMNS) {
        let found = format!("{} columns", statement.columns.len());
        let expected = "at most 256; those of a file that are not needed may be left out";
        return checker
            .require(false, "the number of columns", found, expected, one_more.name.span)
            .map(|()| vec![]);
    }
    let mut list = Vec::new();
    let mut is_right = true;
    for (idx, written) in statement.columns.iter().enumerate() {
        let name = &written.name;
        if let Some(first) = statement.columns[..idx].iter().find(|it| it.name.value == name.value) {
            checker.report(
                Diagnostic::error(D002, format!("column `{}` is declared twice", name.value))
                    .at(name.span, "here again")
                    .also(first.name.span, "first here")
                    .found("one column twice")
                    .expected("each column once"),
            );
            is_right = false;
        }
        match checker.unit_of_column(written) {
            Some(unit) => list.push(Column { name: name.value.clone(), unit }),
            None => is_right = false,
        }
    }
    if list.len() == 1 && is_right {
        checker.report(
            Diagnostic::error(M001, "a table of one column is no function")
                .at(statement.columns[0].name.span, "the only column")
                .found("one column")
                .expected("a coordinate and a value, such as `(t [d], c [mg/L])`"),
        );
        is_right = false;
    }
    is_right.then_some(list)
}

/// Where in its file a mistake is, if that can be said.
fn at(error: &ReadError) -> String {
    error.place.map_or(String::new(), |place| format!("{place}: "))
}

fn with_help(message: Diagnostic, error: &ReadError) -> Diagnostic {
    match &error.help {
        Some(help) => message.help(help.clone()),
        None => message,
    }
}

fn unread(statement: &tree::Data, error: &ReadError) -> Diagnostic {
    let path = &statement.path;
    let message = Diagnostic::error(
        T101,
        format!("\"{}\" cannot be read as the table `{}`", path.value, statement.name.value),
    )
    .at(path.span, format!("{}{}", at(error), error.message))
    .found(error.message.clone())
    .expected("the declared columns, each a number in every row");
    with_help(message, error)
}

impl<'a> Checker<'a> {
    fn unit_of_column(&mut self, column: &'a tree::DataColumn) -> Option<Unit> {
        let Some(written) = &column.unit else { return Some(Unit::ONE) };
        match Unit::parse(&written.value) {
            Ok(unit) => Some(unit),
            Err(error) => {
                let number = tree::Number { digits: "1".to_owned(), unit: Some(written.clone()) };
                self.unknown_unit(&error, &number, written.span);
                None
            }
        }
    }

    /// The table that a name, or a name with a column, speaks of.
    pub(super) fn table_of(&mut self, name: &str) -> Option<&'a tree::Data> {
        let first = name.split('.').next().unwrap_or(name);
        let entry = self.scope.get_mut(first)?;
        let Origin::Data(statement) = entry.origin else { return None };
        entry.n_uses += 1;
        Some(statement)
    }

    /// The table and the column that a path such as `cloud.m` means, without a call.
    pub(super) fn column_of(&mut self, expr: &'a tree::Expr) -> Option<(&'a tree::Data, Known, usize)> {
        let tree::ExprKind::Path(path) = &expr.kind else { return None };
        let [table, column] = &path[..] else { return None };
        let statement = self.table_of(&table.value)?;
        let known = self.tables.get(&table.value)?.clone()?;
        let idx = known.column(&column.value)?;
        Some((statement, known, idx))
    }

    /// Reports a column that stands where a value is needed, without its coordinates; `false` for another path.
    pub(super) fn is_column_alone(&mut self, path: &'a [tree::Name], span: Span) -> bool {
        let [table, column] = path else { return false };
        let Some(statement) = self.table_of(&table.value) else { return false };
        let Some(idx) = statement.columns.iter().position(|own| own.name.value == column.value) else {
            // The same message as of a call.
            let name = tree::Name::new(format!("{}.{}", table.value, column.value), span);
            if let Some(known) = self.tables.get(&table.value).cloned().flatten() {
                self.value_column(statement, &known, &name, 1);
            }
            return true;
        };
        let before = &statement.columns[..idx.min(3)];
        let list: Vec<&str> = before.iter().map(|own| own.name.value.as_str()).collect();
        let (what, expected) = match list.is_empty() {
            true => ("the first coordinate of the table", "a column after the coordinates".to_owned()),
            false => ("a column of the table: a function of those before it", list.join(", ")),
        };
        let message = Diagnostic::error(
            D007,
            format!("`{}.{}` has no value without a place", table.value, column.value),
        )
        .at(span, what)
        .also(statement.name.span, "declared here")
        .found("a column without arguments")
        .expected(if list.is_empty() { expected } else { format!("its coordinates: {expected}") });
        let example = || format!("write for example `{}.{}({})`", table.value, column.value, list.join(", "));
        self.report(if list.is_empty() { message } else { message.help(example()) });
        true
    }

    /// What kind of value such a column has.
    pub(super) fn kind_of_column(&mut self, expr: &'a tree::Expr) -> Option<Type> {
        let (_, known, idx) = self.column_of(expr)?;
        Some(Type::Number(known.columns[idx].unit.dimension))
    }

    /// A column of a table as a function of the leading columns, as many as there are arguments.
    pub(super) fn lookup(
        &mut self,
        statement: &'a tree::Data,
        function: &tree::Name,
        arguments: &'a [tree::Argument],
        checked: Vec<Option<Expr>>,
        span: Span,
    ) -> Option<Expr> {
        if let Some(argument) = arguments.iter().find_map(|argument| argument.name.as_ref()) {
            self.report(
                Diagnostic::error(D007, format!("`{}` takes its arguments by place", function.value))
                    .at(argument.span, "a named argument")
                    .found(format!("`{} = …`", argument.value))
                    .expected("values only, in the order of the columns"),
            );
            return None;
        }
        let values: Vec<Expr> = checked.into_iter().collect::<Option<_>>()?;
        let known = self.tables.get(&statement.name.value).cloned().flatten()?;
        let value = self.value_column(statement, &known, function, values.len())?;
        for (expr, column) in values.iter().zip(known.columns.iter()) {
            self.check_coordinate(statement, expr, column)?;
        }
        if known.rule == Rule::Steps && values.len() > 1 {
            let n = values.len();
            self.report(
                Diagnostic::error(T102, "steps go along one coordinate")
                    .at(span, format!("{n} coordinates here"))
                    .also(statement.name.span, format!("`{}` is a table of steps", statement.name.value))
                    .found(format!("steps over {n} coordinates"))
                    .expected("one coordinate, or a table without `steps`"),
            );
            return None;
        }
        let table = match known.file.table(&known.columns, values.len(), value, known.rule) {
            Ok(table) => table,
            Err(error) => {
                self.report(no_function(statement, &error, values.len(), span));
                return None;
            }
        };
        self.is_spoken_of(statement, &table, &values, span)?;
        let kind = Type::Number(known.columns[value].unit.dimension);
        Some(Expr::table(table, values, kind, span))
    }

    /// The column that a call means: the named one, or the only one after its coordinates.
    fn value_column(
        &mut self,
        statement: &tree::Data,
        known: &Known,
        function: &tree::Name,
        n_axes: usize,
    ) -> Option<usize> {
        let names = || known.columns.iter().map(|column| column.name.as_str());
        let listed =
            |list: &[Column]| list.iter().map(|it| format!("`{}`", it.name)).collect::<Vec<_>>().join(", ");
        let table = &statement.name.value;
        let given = if n_axes == 1 { "1 argument".to_owned() } else { format!("{n_axes} arguments") };
        let is_possible = (1..=3).contains(&n_axes) && n_axes < known.columns.len();
        let Some((_, name)) = function.value.split_once('.') else {
            if is_possible && known.columns.len() == n_axes + 1 {
                return Some(n_axes);
            }
            self.report(
                Diagnostic::error(D007, format!("which column of `{table}` is meant?"))
                    .at(function.span, format!("{given}, and {} columns", known.columns.len()))
                    .also(statement.name.span, "declared here")
                    .found(format!("`{table}` with {given}"))
                    .expected(format!(
                        "a column, as in `{table}.{}(…)`",
                        names().next_back().unwrap_or_default()
                    )),
            );
            return None;
        };
        let Some(idx) = known.column(name) else {
            let mut message = Diagnostic::error(D004, format!("`{table}` has no column `{name}`"))
                .at(function.span, "no such column")
                .also(statement.name.span, "declared here")
                .found(format!("`{name}`"))
                .expected(listed(&known.columns));
            if let Some(near) = did_you_mean(name, names()) {
                message = message.help(format!("did you mean `{table}.{near}`?"));
            }
            self.report(message);
            return None;
        };
        if is_possible && idx >= n_axes {
            return Some(idx);
        }
        let most = idx.min(3);
        let expected = match most {
            0 => "a column after the coordinates".to_owned(),
            1 => format!("1 argument: {}", listed(&known.columns[..1])),
            n => format!("1 to {n} arguments, out of {}", listed(&known.columns[..n])),
        };
        self.report(
            Diagnostic::error(D007, format!("`{table}.{name}` is no function of {given}"))
                .at(function.span, given.clone())
                .also(statement.name.span, "the columns before it are its coordinates")
                .found(given)
                .expected(expected),
        );
        None
    }

    fn check_coordinate(&mut self, statement: &tree::Data, expr: &Expr, column: &Column) -> Option<()> {
        let wanted = column.unit.dimension;
        let fits = match expr.kind {
            Type::Zero => true,
            Type::Number(dimension) => dimension == wanted,
            Type::Truth => false,
        };
        if fits {
            return Some(());
        }
        self.report(
            Diagnostic::error(U104, format!("column `{}` has another dimension", column.name))
                .at(expr.span, format!("this is {}", expr.kind.describe()))
                .also(statement.name.span, format!("`{}` is {}", column.name, shown(wanted)))
                .found(expr.kind.describe())
                .expected(shown(wanted)),
        );
        None
    }

    /// Whether constant coordinates lie within the rows.
    fn is_spoken_of(
        &mut self,
        statement: &tree::Data,
        table: &Table,
        values: &[Expr],
        span: Span,
    ) -> Option<()> {
        if values.iter().any(|value| value.value().is_none()) {
            return Some(());
        }
        for (axis, expr) in values.iter().enumerate() {
            let Some(value) = expr.value() else { continue };
            if !table.speaks_of(axis, value, value) {
                let dimension = expr.kind.dimension().unwrap_or_default();
                let found = self.shown(value, dimension, expr.span);
                let rows = self.shown_range(table.extent(axis), dimension, expr.span);
                let column = &statement.columns[axis].name.value;
                self.report(extent::beyond(column, &found, &rows, span));
                return None;
            }
        }
        Some(())
    }
}

fn shown(dimension: Dimension) -> String {
    Type::Number(dimension).describe()
}

fn no_function(statement: &tree::Data, error: &ReadError, n_axes: usize, span: Span) -> Diagnostic {
    let name = &statement.name.value;
    let coordinates: Vec<String> =
        statement.columns.iter().take(n_axes).map(|column| format!("`{}`", column.name.value)).collect();
    let coordinates = coordinates.join(", ");
    let message = Diagnostic::error(T102, format!("the rows of `{name}` make no function of {coordinates}"))
        .at(span, format!("read over {coordinates}"))
        .also(statement.path.span, format!("{}{}", at(error), error.message))
        .found(error.message.clone())
        .expected(if n_axes == 1 {
            "each coordinate once"
        } else {
            "a row at each point of a rectangular grid"
        });
    with_help(message, error)
}
