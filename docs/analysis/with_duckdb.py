"""A sweep in DuckDB: mean error by particles and step, the order of convergence, units.

Usage: with_duckdb.py RESULTS [MEASURE]

RESULTS is the folder of a sweep over `particles` and `step`. The SQL works in the `duckdb` program, too.
"""

import sys
from pathlib import Path

import duckdb

folder = Path(sys.argv[1])
measure = sys.argv[2] if len(sys.argv) > 2 else "err"
quoted = '"' + measure.replace('"', '""') + '"'
db = duckdb.connect()


def table(name: str) -> duckdb.DuckDBPyRelation:
    """The files of a table; its name needs no quotes in SQL then."""
    return db.read_parquet(str(folder / name))


# %% One row for each point and replicate; swept values and measures are columns.
points, columns = table("points.parquet"), table("columns.parquet")

# %% Units: a row for each column of each table.
units = dict(db.sql("SELECT \"column\", unit FROM columns WHERE \"table\" = 'points'").fetchall())

# %% The mean over the replicates, with its standard error.
means = db.sql(f"""
    SELECT particles, step, avg({quoted}) AS mean, stddev_samp({quoted}) / sqrt(count(*)) AS standard_error,
           count(*) AS n
    FROM points WHERE status = 'done' GROUP BY particles, step ORDER BY particles, step
""")
print(f"step in {units['step']}, {measure} in {units[measure] or '1'}")
for row in means.fetchall():
    print(*row)

# %% The slope of ln(mean) by ln(particles), with a level of its own for each step.
order = db.sql("""
    SELECT sum(x * y) / sum(x * x) FROM (
        SELECT ln(particles) - avg(ln(particles)) OVER (PARTITION BY step) AS x,
               ln(mean) - avg(ln(mean)) OVER (PARTITION BY step) AS y
        FROM means)
""").fetchall()[0][0]
print(f"order of {measure} by particles: {order:.12f}")

# %% A large table: DuckDB reads only the row groups and columns that are asked for.
profile = table("profile/*.parquet")
largest = db.sql("""
    SELECT max(mean) FROM (
        SELECT species, x, avg(concentration) AS mean, stddev_samp(concentration) AS deviation
        FROM profile WHERE point = 0 AND t = (SELECT max(t) FROM profile WHERE point = 0)
        GROUP BY species, x)
""").fetchall()[0][0]
print(f"largest mean concentration of point 0: {largest:.12f}")
