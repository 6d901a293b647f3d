"""Writes flow fields with other programs, and what these programs read in them again.

Usage: flow_files.py FOLDER

The MODFLOW 6 model is solved here by finite volumes: the flows add up as those of MODFLOW do. flopy writes
its files but the grid file, which no program but MODFLOW writes from nothing: that one is written here by
the description of input and output, read by flopy and written again by flopy.
"""

import json
import sys
from pathlib import Path

import duckdb
import numpy as np
import pandas
import polars
from flopy.mf6.utils import MfGrdFile
from flopy.mf6.utils.postprocessing import get_structured_faceflows
from flopy.utils import CellBudgetFile, HeadFile

LAYERS, ROWS, COLUMNS = 3, 4, 5
N = LAYERS * ROWS * COLUMNS
DELR = np.array([10.0, 5.0, 2.5, 5.0, 20.0])
DELC = np.array([8.0, 4.0, 2.0, 16.0])
HEIGHTS = np.array([12.0, 9.0, 5.0, -1.0])
INACTIVE = {(0, 0, 4), (1, 2, 2)}
ORIGIN, ROTATION = (1000.0, 2000.0), 30.0


def node(layer, row, column):
    return (layer * ROWS + row) * COLUMNS + column


def place(cell):
    return cell // (ROWS * COLUMNS), cell // COLUMNS % ROWS, cell % COLUMNS


def connections(idomain):
    """ia and ja, the cell itself first, then rising: the order of MODFLOW 6."""
    ia, ja = [0], []
    for cell in range(N):
        if idomain[cell] > 0:
            here = np.array(place(cell))
            ja.append(cell)
            for other in range(N):
                if idomain[other] > 0 and np.abs(here - place(other)).sum() == 1:
                    ja.append(other)
        ia.append(len(ja))
    return np.array(ia), np.array(ja)


def conductance(a, b, k, saturation):
    """Harmonic mean of two half cells."""
    (la, ra, ca), (lb, rb, cb) = place(a), place(b)
    thickness = -np.diff(HEIGHTS)
    halves = []
    for cell, (layer, row, column) in ((a, (la, ra, ca)), (b, (lb, rb, cb))):
        height = thickness[layer] * saturation[cell]
        if la != lb:
            halves.append(k[cell] * DELR[column] * DELC[row] / (height / 2))
        elif ra != rb:
            halves.append(k[cell] * DELR[column] * height / (DELC[row] / 2))
        else:
            halves.append(k[cell] * DELC[row] * height / (DELR[column] / 2))
    return 1 / (1 / halves[0] + 1 / halves[1])


def solve(ia, ja, k, saturation, fixed, sources):
    """Heads, and the flow into each cell from each of its neighbours."""
    matrix, right = np.eye(N), np.zeros(N)
    for cell in range(N):
        if ia[cell] == ia[cell + 1]:
            continue
        if cell in fixed:
            right[cell] = fixed[cell]
            continue
        matrix[cell, cell] = 0
        right[cell] = -sources[cell]
        for other in ja[ia[cell] + 1 : ia[cell + 1]]:
            c = conductance(cell, other, k, saturation)
            matrix[cell, cell] -= c
            matrix[cell, other] += c
    heads = np.linalg.solve(matrix, right)
    flows = np.zeros(len(ja))
    for cell in range(N):
        for entry in range(ia[cell] + 1, ia[cell + 1]):
            # The same for both cells, to the last bit.
            low, high = sorted((cell, ja[entry]))
            flow = conductance(low, high, k, saturation) * (heads[high] - heads[low])
            flows[entry] = flow if cell == low else -flow
    return heads, flows


def write_grid(file, ia, ja, idomain, cell_type):
    """The binary grid file by its description."""
    top = np.full(ROWS * COLUMNS, HEIGHTS[0])
    bottom = np.repeat(HEIGHTS[1:], ROWS * COLUMNS)
    variables = [
        ("NCELLS", "INTEGER", N), ("NLAY", "INTEGER", LAYERS), ("NROW", "INTEGER", ROWS),
        ("NCOL", "INTEGER", COLUMNS), ("NJA", "INTEGER", len(ja)), ("XORIGIN", "DOUBLE", ORIGIN[0]),
        ("YORIGIN", "DOUBLE", ORIGIN[1]), ("ANGROT", "DOUBLE", ROTATION), ("DELR", "DOUBLE", DELR),
        ("DELC", "DOUBLE", DELC), ("TOP", "DOUBLE", top), ("BOTM", "DOUBLE", bottom),
        ("IA", "INTEGER", ia + 1), ("JA", "INTEGER", ja + 1), ("IDOMAIN", "INTEGER", idomain),
        ("ICELLTYPE", "INTEGER", cell_type),
    ]  # fmt: skip
    with open(file, "wb") as out:
        for line in ("GRID DIS", "VERSION 1", f"NTXT {len(variables)}", "LENTXT 100"):
            out.write(line.ljust(49).encode() + b"\n")
        for name, kind, value in variables:
            size = f"1 {len(value)}" if np.ndim(value) else "0"
            out.write(f"{name} {kind} NDIM {size}".ljust(99).encode() + b"\n")
        for _, kind, value in variables:
            out.write(np.asarray(value, "<i4" if kind == "INTEGER" else "<f8").tobytes())


def rows(entries, columns=()):
    """A list of a budget: cells from 1, flows, further columns."""
    kinds = [("ID1", "i4"), ("ID2", "i4"), ("FLOW", "f8")] + [(name, "f8") for name in columns]
    numbered = [(cell + 1, idx + 1, *values) for idx, (cell, *values) in enumerate(entries)]
    return np.array(numbered, dtype=kinds)


def step(kstp, kper, end, length, rate, model):
    """Heads and the records of one time step."""
    ia, ja, idomain, k, saturation = model
    sides = {node(l, r, c): (20.0 if c == 0 else 18.0, 1.0 if c == 0 else 3.0)
             for l in range(LAYERS) for r in range(ROWS) for c in (0, COLUMNS - 1)
             if idomain[node(l, r, c)] > 0}  # fmt: skip
    fixed = {cell: head for cell, (head, _) in sides.items()}
    well = node(1, 1, 2)
    recharge = [(node(0, r, c), 0.001 * DELR[c] * DELC[r]) for r in range(ROWS) for c in range(1, COLUMNS - 1)]
    sources = np.zeros(N)
    sources[well] += rate
    for cell, flow in recharge:
        sources[cell] += flow
    heads, flows = solve(ia, ja, k, saturation, fixed, sources)
    held = [(cell, -flows[ia[cell] + 1 : ia[cell + 1]].sum(), face) for cell, (_, face) in sides.items()]
    active = [cell for cell in range(N) if idomain[cell] > 0]
    when = {"kstp": kstp, "kper": kper, "totim": end, "pertim": length, "delt": length, "modelnam": "GWF",
            "paknam": "GWF", "modelnam2": "GWF"}  # fmt: skip
    listed = lambda text, name, data: {**when, "text": text, "paknam2": name, "data": data, "imeth": 6}
    records = [
        {**when, "text": "FLOW-JA-FACE", "data": flows, "imeth": 1},
        listed("DATA-SAT", "NPF", rows([(cell, 0.0, saturation[cell]) for cell in active], ["sat"])),
        {**when, "text": "STO-SS", "data": np.zeros((LAYERS, ROWS, COLUMNS)), "imeth": 1},
        listed("WEL", "PUMP", rows([(well, rate)])),
        listed("RCH", "RAIN", rows([(cell, flow, -1.0) for cell, flow in recharge], ["IFLOWFACE"])),
        listed("CHD", "SIDES", rows(held, ["IFLOWFACE"])),
    ]
    heads = np.where(np.array(idomain) > 0, heads, 1e30).reshape(LAYERS, ROWS, COLUMNS)
    return heads, records


def modflow(folder):
    random = np.random.default_rng(5)
    idomain = np.array([0 if place(cell) in INACTIVE else 1 for cell in range(N)])
    cell_type = np.array([1] * (ROWS * COLUMNS) + [0] * (N - ROWS * COLUMNS))
    saturation = np.where(cell_type == 1, random.uniform(0.4, 0.9, N), 1.0)
    ia, ja = connections(idomain)
    model = (ia, ja, idomain, np.exp(random.normal(0.0, 2.0, N)), saturation)
    write_grid(folder / "written.dis.grb", ia, ja, idomain, cell_type)
    MfGrdFile(folder / "written.dis.grb").export(folder / "model.dis.grb")
    MfGrdFile(folder / "written.dis.grb").export(folder / "model_crs.dis.grb", crs="EPSG:26916")
    first, records = step(1, 1, 10.0, 10.0, -5.0, model)
    second, more = step(3, 2, 40.0, 10.0, 2.5, model)
    CellBudgetFile.write(folder / "model.bud", records + more, nlay=LAYERS, nrow=ROWS, ncol=COLUMNS)
    times = {(1, 1): 10.0, (3, 2): 40.0}
    HeadFile.write(folder / "model.hds", {(1, 1): first, (3, 2): second}, totim=times, text="HEAD")
    return read_again(folder, idomain, saturation)


def read_again(folder, idomain, saturation):
    """What flopy finds in the files."""
    grid = MfGrdFile(folder / "model.dis.grb")
    budget = CellBudgetFile(folder / "model.bud", precision="double")
    heads = HeadFile(folder / "model.hds", precision="double")
    x, y, z = grid.modelgrid.xyzcellcenters
    steps = []
    for kstpkper in budget.get_kstpkper():
        flowja = budget.get_data(text="FLOW-JA-FACE", kstpkper=kstpkper)[0]
        right, front, lower = get_structured_faceflows(flowja, grb_file=folder / "model.dis.grb")
        listed = {}
        for text in ("WEL", "RCH", "CHD"):
            data = budget.get_data(text=text, kstpkper=kstpkper)[0]
            listed[text] = [[int(row["node"]) - 1, float(row["q"])] for row in data]
        steps.append({
            "right": right.ravel().tolist(), "front": front.ravel().tolist(), "lower": lower.ravel().tolist(),
            "heads": heads.get_data(kstpkper=kstpkper).ravel().tolist(), **listed,
        })  # fmt: skip
    return {
        "x": np.tile(x.ravel(), LAYERS).tolist(), "y": np.tile(y.ravel(), LAYERS).tolist(),
        "z": z.ravel().tolist(), "idomain": idomain.tolist(), "saturation": saturation.tolist(),
        "times": [float(time) for time in budget.get_times()], "steps": steps,
    }  # fmt: skip


def arrays(folder):
    """The same discharge q = (x + 2 y, 3 - 2 x) on 4 x 3 cells of 0.5 m, in every form."""
    x, y = np.meshgrid((np.arange(4) + 0.5) / 2, (np.arange(3) + 0.5) / 2, indexing="ij")
    q = np.stack([x + 2 * y, 3 - 2 * x], axis=-1)
    np.save(folder / "c_f8.npy", q)
    np.save(folder / "f_f8.npy", np.asfortranarray(q))
    np.save(folder / "c_big.npy", q.astype(">f8"))
    np.save(folder / "f_f4.npy", np.asfortranarray(q.astype("f4")))
    for version in ((2, 0), (3, 0)):
        with open(folder / f"version_{version[0]}.npy", "wb") as out:
            np.lib.format.write_array(out, q.astype(">f4"), version=version)
    table = {"x": x.ravel(), "y": y.ravel(), "qx": q[..., 0].ravel(), "qy": q[..., 1].ravel()}
    frame = pandas.DataFrame(table).sample(frac=1, random_state=3)
    frame.to_csv(folder / "pandas.csv", index=False)
    frame.to_parquet(folder / "pandas.parquet")
    polars.DataFrame(table).write_parquet(folder / "polars.parquet")
    polars.DataFrame(table).write_csv(folder / "polars.csv")
    duckdb.sql("SELECT * FROM frame").write_parquet(str(folder / "duckdb.parquet"))
    duckdb.sql("SELECT * FROM frame").write_csv(str(folder / "duckdb.csv"))


if __name__ == "__main__":
    target = Path(sys.argv[1])
    arrays(target)
    (target / "expected.json").write_text(json.dumps(modflow(target)))
