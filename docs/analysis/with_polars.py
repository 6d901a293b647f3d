"""A sweep in polars: mean error by particles and step, the order of convergence, units.

Usage: with_polars.py RESULTS [MEASURE]

RESULTS is the folder of a sweep over `particles` and `step`.
"""

import sys
from pathlib import Path

import polars
from polars import col

folder = Path(sys.argv[1])
measure = sys.argv[2] if len(sys.argv) > 2 else "err"

# %% One row for each point and replicate; swept values and measures are columns.
done = polars.scan_parquet(folder / "points.parquet").filter(col("status") == "done")

# %% Units: a row for each column of each table.
columns = polars.read_parquet(folder / "columns.parquet").filter(col("table") == "points")
units = dict(columns.select("column", "unit").iter_rows())

# %% The mean over the replicates, with its standard error.
means = (
    done.group_by("particles", "step")
    .agg(
        mean=col(measure).mean(),
        standard_error=col(measure).std() / col(measure).count().sqrt(),
        count=col(measure).count(),
    )
    .sort("particles", "step")
    .collect()
)
print(f"step in {units['step']}, {measure} in {units[measure] or '1'}")
print(means)

# %% The slope of ln(mean) by ln(particles), with a level of its own for each step.
x, y = col("particles").cast(polars.Float64).log(), col("mean").log()
centred = means.select(x=x - x.mean().over("step"), y=y - y.mean().over("step"))
order = centred.select((col("x") * col("y")).sum() / (col("x") ** 2).sum()).item()
print(f"order of {measure} by particles: {order:.12f}")

# %% A large table: polars reads only the row groups and columns that are asked for.
band = (
    polars.scan_parquet(folder / "profile" / "*.parquet")
    .filter(col("point") == 0)
    .filter(col("t") == col("t").max())
    .group_by("species", "x")
    .agg(mean=col("concentration").mean(), deviation=col("concentration").std())
    .collect()
)
print(f"largest mean concentration of point 0: {band['mean'].max():.12f}")
