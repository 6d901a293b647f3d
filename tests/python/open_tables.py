"""Opens every table of one or more runs with pyarrow, polars, DuckDB and pandas.

Usage: open_tables.py SCHEMA RESULTS [RESULTS ...]

SCHEMA is docs/schema/footer-1.json. Checks names, types and units of the columns, the footers
against the schema, that all readers see equal values, and that the same table of several runs can
be read as one. Prints each failure; exit code 1 if there is any.
"""

import json
import math
import sys
from pathlib import Path

import duckdb
import jsonschema
import pandas
import polars
import pyarrow
import pyarrow.dataset
import pyarrow.parquet

REAL, WORD, TEXT = "double", "dictionary<values=string, indices=uint16, ordered=0>", "string"
HEAD = [("point", "uint32", ""), ("replicate", "uint32", ""), ("t", REAL, "s")]
PLACE = [("x", REAL, "m"), ("y", REAL, "m"), ("z", REAL, "m")]
PAIR = [("species_a", WORD, ""), ("species_b", WORD, "")]
TAIL = [("unit", WORD, ""), ("output", "uint16", "")]
ROW = "the unit of the rows"
NORMS = ["l1", "l2", "linf", "rmse"]

# The published columns: name, type, unit. They are written down here once more, so that a change
# of the program's own list is noticed.
TABLES = {
    "profile": HEAD + PLACE + [("species", WORD, ""), ("concentration", REAL, ROW), ("standard_error", REAL, ROW),
                               ("n_particles", "uint64", "")] + TAIL,
    "covariance": HEAD + PLACE + PAIR + [("covariance", REAL, ROW), ("n_particles", "uint64", "")] + TAIL,
    "total": HEAD + [("species", WORD, ""), ("amount", REAL, ROW)] + TAIL,
    "mixing": HEAD + PAIR + [("m", REAL, ROW), ("m_mean", REAL, ROW), ("m_cov", REAL, ROW), ("gamma", REAL, "1")] + TAIL,
    "particles": HEAD + [("particle", "uint64", "")] + PLACE + [("species", WORD, ""), ("concentration", REAL, ROW)] + TAIL,
    "errors": HEAD + [("reference", WORD, ""), ("output", "uint16", ""), ("kind", WORD, "")] + PAIR + [("n", "uint64", ""), ("n_empty", "uint64", "")]
    + [(name, REAL, ROW) for name in NORMS] + [("relative_" + name, REAL, "1") for name in NORMS]
    + [("noise", REAL, ROW), ("unit", WORD, "")],
}
AMOUNT, RATE = "see column amount_unit", "see column amount_unit, per s"
STATION = [("place", WORD, "")] + PLACE + [("species", WORD, "")]
MOMENTS = [("mean_" + axis, REAL, "m") for axis in "xyz"] + [(pair, REAL, "m^2") for pair in ("xx", "yy", "zz", "xy", "xz", "yz")]
TABLES |= {
    "map": TABLES["profile"],
    "breakthrough": HEAD + STATION + [("concentration", REAL, ROW), ("rate", REAL, RATE), ("cumulative", REAL, AMOUNT),
                                      ("n_particles", "uint64", ""), ("amount_unit", WORD, "")] + TAIL,
    "first_passage": HEAD + STATION + [("cumulative", REAL, ROW), ("rate", REAL, RATE), ("n_particles", "uint64", ""),
                                       ("amount_unit", WORD, "")] + TAIL,
    "moments": HEAD + [("species", WORD, ""), ("amount", REAL, ROW)] + MOMENTS + TAIL,
    "dilution": HEAD + [("species", WORD, ""), ("index", REAL, ROW), ("entropy", REAL, "1"), ("reactor_ratio", REAL, "1")] + TAIL,
    "budget": HEAD + [("place", WORD, ""), ("species", WORD, ""), ("amount", REAL, ROW), ("entered", REAL, ROW),
                      ("left", REAL, ROW)] + TAIL,
    "flow": HEAD + PLACE + [("head", REAL, "m"), ("conductivity", REAL, "m/s"), ("porosity", REAL, "1")]
    + [("discharge_" + axis, REAL, "m/s") for axis in "xyz"],
}

# Columns of points.parquet that every run has; scenes add more.
POINTS = {
    "point": ("uint32", ""), "replicate": ("uint32", ""), "key": (TEXT, ""), "seed": ("uint64", ""),
    "status": (TEXT, ""), "error_code": (TEXT, ""), "error_message": (TEXT, ""),
    "wall": (REAL, "s"), "cpu": (REAL, "s"), "loop_wall": (REAL, "s"), "compile_wall": (REAL, "s"),
    "write_wall": (REAL, "s"), "peak_memory": ("uint64", "byte"), "particles": ("uint64", ""), "step": (REAL, "s"),
    "duration": (REAL, "s"), "steps": ("uint64", ""), "sub_steps": ("uint64", ""), "particle_steps": ("uint64", ""), "mass_defect": (REAL, "1"),
    "version": (TEXT, ""), "numerics": ("uint32", ""), "host": (TEXT, ""), "threads": ("uint32", ""),
    "started": ("timestamp[us]", "UTC"), "finished": ("timestamp[us]", "UTC"),
}

EXPONENTS = ["length", "mass", "time", "amount", "temperature", "current", "luminous_intensity"]
COLUMNS = ["table", "column", "species", "unit"] + EXPONENTS + ["description"]

failures = []


def expect(is_so, path, message):
    if not is_so:
        failures.append(f"{path}: {message}")


def main(arguments):
    if len(arguments) < 2:
        sys.exit(__doc__)
    schema = json.loads(Path(arguments[0]).read_text(encoding="utf-8"))
    runs = [Path(argument) for argument in arguments[1:]]
    n_files = 0
    for run in runs:
        files = sorted(path for path in run.rglob("*.parquet") if not path.name.startswith("."))
        expect(files, run, "no tables")
        for path in files:
            n_files += 1
            check_file(path, run, schema)
        check_points(run / "points.parquet")
        check_meanings(run)
    n_tables = check_together(runs)
    for failure in failures:
        print(f"FAILED {failure}")
    print(f"{n_files} files opened by pyarrow, polars, DuckDB and pandas; {n_tables} tables read across "
          f"{len(runs)} runs; {len(failures)} failures")
    return 1 if failures else 0


def check_file(path, run, schema):
    """Types, units and footer of one file, and its values in all readers."""
    table = path.parent.name if path.parent != run else path.stem
    arrow = pyarrow.parquet.ParquetFile(path)
    footer = check_footer(path, table, arrow, schema)
    fields = {field.name: field for field in arrow.schema_arrow}
    if table in TABLES:
        names = [name for name, _, _ in TABLES[table]]
        expect(list(fields) == names, path, f"columns are {list(fields)}, published are {names}")
        published = {name: (kind, unit) for name, kind, unit in TABLES[table]}
    else:
        published = POINTS if table == "points" else {}
    for name, (kind, unit) in published.items():
        expect(name in fields, path, f"column {name} is missing")
        if name in fields:
            expect(str(fields[name].type) == kind, path, f"{name} is {fields[name].type}, published is {kind}")
            check_unit(path, fields[name], unit, arrow)
    expect([column["name"] for column in footer.get("columns", [])] == list(fields), path, "footer lists other columns")
    check_encoding(path, arrow)
    check_equal(path, arrow.read())


def check_footer(path, table, arrow, schema):
    metadata = arrow.metadata.metadata or {}
    footer = json.loads(metadata.get(b"lamella", b"{}").decode("utf-8"))
    expect((arrow.schema_arrow.metadata or {}).get(b"lamella") == metadata.get(b"lamella"), path, "two footers differ")
    for error in jsonschema.Draft202012Validator(schema).iter_errors(footer):
        expect(False, path, f"footer at {list(error.absolute_path)}: {error.message}")
    expect(footer.get("table") == table, path, f"footer says table {footer.get('table')}")
    attributes = json.loads(metadata.get(b"PANDAS_ATTRS", b"{}").decode("utf-8"))
    expect(attributes.get("plan_hash") == footer.get("plan", {}).get("hash"), path, "PANDAS_ATTRS has another hash")
    return footer


def text_of(field, key):
    return (field.metadata or {}).get(key.encode(), b"").decode("utf-8")


def check_unit(path, field, unit, arrow):
    found = text_of(field, "unit")
    if unit == ROW:
        rows = set(arrow.read(columns=["unit"]).column(0).to_pylist())
        is_right = rows == {found} if len(rows) == 1 else found == "see column unit"
        # A table of one unit says so even if it has no rows; errors leave it to the rows.
        is_right = is_right or not rows or found == "see column unit" and path.parent.name == "errors"
        expect(is_right, path, f"{field.name} says `{found}`, its rows {sorted(rows)}")
    else:
        expect(found == unit, path, f"unit of {field.name} is `{found}`, published is `{unit}`")
    expect(text_of(field, "doc"), path, f"{field.name} has no description")


def check_encoding(path, arrow):
    for group in range(arrow.metadata.num_row_groups):
        group = arrow.metadata.row_group(group)
        expect(group.num_rows <= 122_880, path, f"a row group of {group.num_rows} rows")
        for idx in range(group.num_columns):
            column = group.column(idx)
            expect(column.compression == "ZSTD", path, f"{column.path_in_schema} is {column.compression}")
            expect(column.is_stats_set, path, f"{column.path_in_schema} has no statistics")


def same(a, b):
    """Equal as values: a missing number is None here and NaN there."""
    def is_missing(value):
        return value is None or value is pandas.NaT or (isinstance(value, float) and math.isnan(value))
    if is_missing(a) or is_missing(b):
        return is_missing(a) and is_missing(b)
    return a == b


def check_equal(path, arrow):
    truth = {name: arrow.column(name).to_pylist() for name in arrow.column_names}
    frame = polars.read_parquet(path)
    compare(path, "polars", truth, {name: frame[name].to_list() for name in frame.columns})
    relation = duckdb.sql(f"SELECT * FROM read_parquet('{sql(path)}')")
    rows = relation.fetchall()
    compare(path, "DuckDB", truth, {name: [row[k] for row in rows] for k, name in enumerate(relation.columns)})
    data = pandas.read_parquet(path, engine="pyarrow")
    compare(path, "pandas", truth, {name: data[name].tolist() for name in data.columns})
    expect(data.attrs.get("table"), path, "pandas shows no attributes")


def compare(path, reader, truth, found):
    expect(list(found) == list(truth), path, f"{reader} sees columns {list(found)}")
    for name in truth.keys() & found.keys():
        is_equal = len(truth[name]) == len(found[name]) and all(map(same, truth[name], found[name]))
        expect(is_equal, path, f"{reader} sees other values in {name} than pyarrow")


def sql(path):
    return str(path).replace("'", "''")


def check_points(path):
    """The query that must work with nothing else."""
    rows = duckdb.sql(f"SELECT particles, step, avg(mass_defect) FROM '{sql(path)}' GROUP BY ALL").fetchall()
    expect(rows, path, "no points")


def check_meanings(run):
    """columns.parquet tells the unit of every column of every table, without Arrow's metadata."""
    path = run / "columns.parquet"
    meanings = pyarrow.parquet.read_table(path)
    expect(meanings.column_names == COLUMNS, path, f"columns are {meanings.column_names}")
    told = {(row["table"], row["column"]): row["unit"] for row in meanings.to_pylist() if row["species"] is None}
    for file in sorted(run.rglob("*.parquet")):
        table = file.parent.name if file.parent != run else file.stem
        if table == "columns" or file.name.startswith("."):
            continue
        for field in pyarrow.parquet.read_schema(file):
            expect((table, field.name) in told, path, f"{table}.{field.name} is missing")
            if told.get((table, field.name)) != "see column unit":
                unit = told.get((table, field.name)) or ""
                expect(text_of(field, "unit") in (unit, "see column unit"), path, f"{table}.{field.name}: unit {unit}")


def check_together(runs):
    """The same table of all runs as one: each reader counts and groups the same."""
    n_tables = 0
    for table, columns in TABLES.items():
        files = [str(path) for run in runs for path in sorted((run / table).glob("part-*.parquet"))]
        if len(files) < 2:
            continue
        n_tables += 1
        names = {name for name, _, _ in columns}
        word = next(name for name in ("species", "species_a", "point") if name in names)
        arrow = pyarrow.dataset.dataset(files, format="parquet").to_table()
        truth = counted(arrow.column(word).to_pylist())
        frame = polars.scan_parquet(files).group_by(word).len().collect()
        expect(dict(frame.iter_rows()) == truth, table, f"polars groups as {frame}, pyarrow as {truth}")
        listed = ", ".join(f"'{sql(file)}'" for file in files)
        rows = duckdb.sql(f"SELECT {word}, count(*) FROM read_parquet([{listed}]) GROUP BY ALL").fetchall()
        expect(dict(rows) == truth, table, f"DuckDB groups as {rows}, pyarrow as {truth}")
        data = pandas.concat([pandas.read_parquet(file) for file in files])
        expect(counted(data[word].tolist()) == truth, table, "pandas groups otherwise than pyarrow")
    return n_tables


def counted(values):
    return {value: values.count(value) for value in set(values)}


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
