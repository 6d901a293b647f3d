"""A sweep in pandas: mean error by particles and step, the order of convergence, units.

Usage: with_pandas.py RESULTS [MEASURE]

Needs pandas and pyarrow. RESULTS is the folder of a sweep over `particles` and `step`.
"""

import sys
from pathlib import Path

import numpy
import pandas

folder = Path(sys.argv[1])
measure = sys.argv[2] if len(sys.argv) > 2 else "err"

# %% One row for each point and replicate; swept values and measures are columns.
points = pandas.read_parquet(folder / "points.parquet")
done = points[points["status"] == "done"]

# %% Units: a row for each column of each table.
columns = pandas.read_parquet(folder / "columns.parquet")
units = columns[columns["table"] == "points"].set_index("column")["unit"]

# %% The mean over the replicates, with its standard error.
means = done.groupby(["particles", "step"])[measure].agg(["mean", "sem", "count"]).reset_index()
print(f"step in {units['step']}, {measure} in {units[measure] or '1'}")
print(means.to_string(index=False))

# %% The slope of ln(mean) by ln(particles), with a level of its own for each step.
logs = pandas.DataFrame(
    {"step": means["step"], "x": numpy.log(means["particles"].astype(float)), "y": numpy.log(means["mean"])}
)
centred = logs - logs.groupby("step").transform("mean")
order = (centred["x"] * centred["y"]).sum() / (centred["x"] ** 2).sum()
print(f"order of {measure} by particles: {order:.12f}")

# %% A large table: read what is needed, not all of it.
profile = pandas.read_parquet(
    folder / "profile", columns=["replicate", "t", "x", "species", "concentration"], filters=[("point", "==", 0)]
)
last = profile[profile["t"] == profile["t"].max()]
band = last.groupby(["species", "x"], observed=True)["concentration"].agg(["mean", "std"])
print(f"largest mean concentration of point 0: {band['mean'].max():.12f}")
