"""Solves a small aquifer by finite volumes and writes it as MODFLOW 6 writes it: valley.dis.grb, valley.bud.

Usage: write_model.py [FOLDER]

One layer of 30 x 16 cells of 10 m, 10 m thick, 10 m/d with a lens of 1 m/d. General heads of 103 m and 100 m stand half a
cell outside of the western and the eastern column, so that a fixed head on the side itself is the same condition; a well
takes out 48 m3/d. Nothing but Python itself is needed. Layout of the files: MODFLOW 6, Description of Input and Output.
"""

import struct
import sys
from pathlib import Path

COLUMNS, ROWS, SIDE, THICKNESS = 30, 16, 10.0, 10.0
WEST, EAST = 103.0, 100.0
WELL, RATE = (11, 22), -48.0  # row from the north, column; m3/d
N = ROWS * COLUMNS


def cell(row, column):
    return row * COLUMNS + column


def conductivity(row, column):
    x, y = (column + 0.5) * SIDE, (ROWS - row - 0.5) * SIDE
    return 1.0 if 120 < x < 180 and 60 < y < 120 else 10.0


def neighbours(row, column):
    """Beside each other, in the order of their numbers."""
    for r, c in ((row - 1, column), (row, column - 1), (row, column + 1), (row + 1, column)):
        if 0 <= r < ROWS and 0 <= c < COLUMNS:
            yield r, c


def conductances():
    """Between cells, and to the two sides."""
    between, outside = {}, {}
    for row in range(ROWS):
        for column in range(COLUMNS):
            own = conductivity(row, column)
            for other in neighbours(row, column):
                harmonic = 2 * own * conductivity(*other) / (own + conductivity(*other))
                between[cell(row, column), cell(*other)] = harmonic * THICKNESS
        for column in (0, COLUMNS - 1):
            outside[cell(row, column)] = 2 * conductivity(row, column) * THICKNESS
    return between, outside


def solve(between, outside):
    """Heads by conjugate gradients."""
    head_outside = {own: WEST if own % COLUMNS == 0 else EAST for own in outside}
    diagonal = [outside.get(own, 0.0) for own in range(N)]
    for (own, _), c in between.items():
        diagonal[own] += c

    def times(h):
        out = [d * value for d, value in zip(diagonal, h)]
        for (own, other), c in between.items():
            out[own] -= c * h[other]
        return out

    right = [outside.get(own, 0.0) * head_outside.get(own, 0.0) for own in range(N)]
    right[cell(*WELL)] += RATE
    heads = [EAST] * N
    rest = [b - a for b, a in zip(right, times(heads))]
    direction = [r / d for r, d in zip(rest, diagonal)]
    energy = sum(r * p for r, p in zip(rest, direction))
    for _ in range(2000):
        image = times(direction)
        step = energy / sum(p * q for p, q in zip(direction, image))
        heads = [h + step * p for h, p in zip(heads, direction)]
        rest = [r - step * q for r, q in zip(rest, image)]
        if max(map(abs, rest)) < 1e-12:
            break
        scaled = [r / d for r, d in zip(rest, diagonal)]
        new = sum(r * z for r, z in zip(rest, scaled))
        direction = [z + new / energy * p for z, p in zip(scaled, direction)]
        energy = new
    return heads, head_outside


def write_grid(file):
    ia, ja = [1], []
    for row in range(ROWS):
        for column in range(COLUMNS):
            ja += [cell(row, column) + 1] + [cell(*other) + 1 for other in neighbours(row, column)]
            ia.append(len(ja) + 1)
    variables = [
        ("NCELLS", "INTEGER", N), ("NLAY", "INTEGER", 1), ("NROW", "INTEGER", ROWS), ("NCOL", "INTEGER", COLUMNS),
        ("NJA", "INTEGER", len(ja)), ("XORIGIN", "DOUBLE", 0.0), ("YORIGIN", "DOUBLE", 0.0), ("ANGROT", "DOUBLE", 0.0),
        ("DELR", "DOUBLE", [SIDE] * COLUMNS), ("DELC", "DOUBLE", [SIDE] * ROWS), ("TOP", "DOUBLE", [THICKNESS] * N),
        ("BOTM", "DOUBLE", [0.0] * N), ("IA", "INTEGER", ia), ("JA", "INTEGER", ja), ("IDOMAIN", "INTEGER", [1] * N),
        ("ICELLTYPE", "INTEGER", [0] * N),
    ]  # fmt: skip
    with open(file, "wb") as out:
        for line in ("GRID DIS", "VERSION 1", f"NTXT {len(variables)}", "LENTXT 100"):
            out.write(line.ljust(49).encode() + b"\n")
        for name, kind, value in variables:
            size = f"1 {len(value)}" if isinstance(value, list) else "0"
            out.write(f"{name} {kind} NDIM {size}".ljust(99).encode() + b"\n")
        for _, kind, value in variables:
            values = value if isinstance(value, list) else [value]
            out.write(struct.pack(f"<{len(values)}{'i' if kind == 'INTEGER' else 'd'}", *values))


def header(text, sizes, method):
    """One time step of 1 d in the first stress period."""
    return struct.pack("<ii16siiii3d", 1, 1, text.rjust(16).encode(), *sizes, method, 1.0, 1.0, 1.0)


def listed(text, package, entries):
    names = b"".join(name.ljust(16).encode() for name in ("VALLEY", "VALLEY", "VALLEY", package))
    rows = b"".join(struct.pack("<iid", own + 1, idx + 1, flow) for idx, (own, flow) in enumerate(entries))
    return header(text, (COLUMNS, ROWS, -1), 6) + names + struct.pack("<ii", 1, len(entries)) + rows


def write_budget(file, between, outside, heads, head_outside):
    through = []
    for row in range(ROWS):
        for column in range(COLUMNS):
            own = cell(row, column)
            through.append(0.0)
            through += [between[own, cell(*o)] * (heads[cell(*o)] - heads[own]) for o in neighbours(row, column)]
    inflow = [(own, outside[own] * (head_outside[own] - heads[own])) for own in sorted(outside)]
    with open(file, "wb") as out:
        out.write(header("FLOW-JA-FACE", (len(through), 1, -1), 1) + struct.pack(f"<{len(through)}d", *through))
        out.write(listed("GHB", "WEST_HEAD", [(own, flow) for own, flow in inflow if own % COLUMNS == 0]))
        out.write(listed("GHB", "EAST_HEAD", [(own, flow) for own, flow in inflow if own % COLUMNS != 0]))
        out.write(listed("WEL", "PUMP", [(cell(*WELL), RATE)]))


if __name__ == "__main__":
    folder = Path(sys.argv[1] if len(sys.argv) > 1 else ".")
    links = conductances()
    write_grid(folder / "valley.dis.grb")
    write_budget(folder / "valley.bud", *links, *solve(*links))
