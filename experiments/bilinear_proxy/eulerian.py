"""What A and B make of C on a grid, for the same aquifer: an independent reference of `bilinear_proxy`.

    lamella run experiments/bilinear_proxy/monod.lam --set s2=0.1 --set mu="0.03 mol/m^3/d" --out results/smooth
    python experiments/bilinear_proxy/eulerian.py results/smooth monod

reads the conductivity of the run's cells, solves for heads anew (conjugate gradients, harmonic means between cells), and takes
A and B over 60 d by finite volumes: van Leer's limiter for advection, the whole dispersion tensor, Heun's two stages. Prints
C in mol per metre of depth on cells of 1 m, of 0.5 m, and what both say of cells of no size.
"""

import glob
import sys

import numpy as np
import pyarrow.parquet as pq

POROSITY, LENGTH, WIDTH, DAYS = 0.3, 400.0, 200.0, 60.0
ALONG, ACROSS = 0.5, 0.05
SHOWN = (10.0, 20.0, 40.0, 60.0)


def conductivity(folder):
    """m/d on cells, x first."""
    table = pq.read_table(glob.glob(f"{folder}/flow/*.parquet")[0])
    x, y, k = (table[name].to_numpy() for name in ("x", "y", "conductivity"))
    order = np.lexsort((y, x))
    n = (len(np.unique(x)), len(np.unique(y)))
    return k[order].reshape(n) * 86400.0


def velocities(k, high=12.0, low=0.0):
    """Pore velocities on faces along x and y, m/d, of heads held at the left and the right side."""
    edge = LENGTH / k.shape[0]
    across_x = 2.0 / (1.0 / k[1:] + 1.0 / k[:-1])
    across_y = 2.0 / (1.0 / k[:, 1:] + 1.0 / k[:, :-1])
    diagonal = np.zeros_like(k)
    diagonal[1:] += across_x
    diagonal[:-1] += across_x
    diagonal[:, 1:] += across_y
    diagonal[:, :-1] += across_y
    diagonal[0] += 2.0 * k[0]
    diagonal[-1] += 2.0 * k[-1]

    def apply(h):
        out = diagonal * h
        out[1:] -= across_x * h[:-1]
        out[:-1] -= across_x * h[1:]
        out[:, 1:] -= across_y * h[:, :-1]
        out[:, :-1] -= across_y * h[:, 1:]
        return out

    right = np.zeros_like(k)
    right[0] += 2.0 * k[0] * high
    right[-1] += 2.0 * k[-1] * low
    h = np.linspace(high, low, k.shape[0])[:, None] + np.zeros_like(k)
    rest = right - apply(h)
    z = rest / diagonal
    way, size = z.copy(), (rest * z).sum()
    first = np.abs(right).max()
    for _ in range(20_000):
        moved = apply(way)
        step = size / (way * moved).sum()
        h += step * way
        rest -= step * moved
        if np.abs(rest).max() < 1e-12 * first:
            break
        z = rest / diagonal
        new = (rest * z).sum()
        way = z + new / size * way
        size = new
    vx = np.zeros((k.shape[0] + 1, k.shape[1]))
    vy = np.zeros((k.shape[0], k.shape[1] + 1))
    vx[1:-1] = across_x * (h[:-1] - h[1:])
    vx[0] = 2.0 * k[0] * (high - h[0])
    vx[-1] = 2.0 * k[-1] * (h[-1] - low)
    vy[:, 1:-1] = across_y * (h[:, :-1] - h[:, 1:])
    return vx / (edge * POROSITY), vy / (edge * POROSITY)


def finer(vx, vy):
    """The same flow on cells of half the size: velocities vary evenly along their own axis within a cell."""
    for axis, v in ((0, vx), (1, vy)):
        v = np.moveaxis(v, axis, 0)
        fine = np.empty((2 * v.shape[0] - 1, v.shape[1]))
        fine[::2] = v
        fine[1::2] = 0.5 * (v[1:] + v[:-1])
        fine = np.moveaxis(np.repeat(fine, 2, axis=1), 0, axis)
        if axis == 0:
            vx = fine
        else:
            vy = fine
    return vx, vy


def upwind(c, inside):
    """Advective flux through inner faces along the first axis, limited."""
    jump = np.diff(c, axis=0)
    flux = np.where(inside > 0.0, c[:-1], c[1:])
    before = np.zeros_like(jump)
    before[1:] = jump[:-1]
    after = np.zeros_like(jump)
    after[:-1] = jump[1:]
    ratio = np.where(inside > 0.0, before, after)
    product = jump * ratio
    limited = np.where(product > 0.0, 2.0 * product / np.where(product > 0.0, jump + ratio, 1.0), 0.0)
    return inside * (flux + np.where(inside > 0.0, 0.5, -0.5) * limited)


def tensor(own, other):
    """Dispersion along and aslant on inner faces, of velocities through them and beside them."""
    size = np.sqrt(own * own + other * other) + 1e-300
    return ACROSS * size + (ALONG - ACROSS) * own * own / size, (ALONG - ACROSS) * own * other / size


def beside(v):
    """Means of the four faces of the other axis that touch an inner face along the first one."""
    middle = 0.5 * (v[:, 1:] + v[:, :-1])
    return 0.5 * (middle[1:] + middle[:-1])


def slopes(c):
    """Slopes along the second axis on inner faces along the first, per cell."""
    wide = np.concatenate([c[:, :1], c, c[:, -1:]], axis=1)
    middle = 0.5 * (wide[:, 2:] - wide[:, :-2])
    return 0.5 * (middle[1:] + middle[:-1])


def made(vx, vy, law):
    """C by day, mol per metre of depth."""
    n, m = vx.shape[0] - 1, vx.shape[1]
    edge = LENGTH / n
    x, y = (np.arange(n) + 0.5) * edge, (np.arange(m) + 0.5) * edge
    box = ((x > 20.0) & (x < 30.0))[:, None] & ((y > 50.0) & (y < 150.0))[None, :]
    a, b, total = box.astype(float), 1.0 - box, 0.0
    dx, ax = tensor(vx[1:-1], beside(vy))
    dy, ay = tensor(vy[:, 1:-1].T, beside(vx.T))
    fastest = max(np.abs(vx).max(), np.abs(vy).max())
    spread = max(dx.max(), dy.max())
    dt = 1.0 / (2.0 * fastest / edge / 0.8 + 4.0 * spread / edge**2 / 0.8)
    steps = int(np.ceil(SHOWN[0] / dt))
    dt = SHOWN[0] / steps

    def change(c, entering):
        fx = np.empty_like(vx)
        fx[1:-1] = upwind(c, vx[1:-1]) - (dx * np.diff(c, axis=0) + ax * slopes(c)) / edge
        fx[0], fx[-1] = vx[0] * entering, vx[-1] * c[-1]
        fy = np.zeros_like(vy)
        fy[:, 1:-1] = (
            upwind(c.T, vy[:, 1:-1].T) - (dy * np.diff(c.T, axis=0) + ay * slopes(c.T)) / edge
        ).T
        return -(np.diff(fx, axis=0) + np.diff(fy, axis=1)) / edge

    found = {}
    for step in range(1, int(round(DAYS / dt)) + 1):
        rate = law(a, b)
        da, db = change(a, 0.0) - rate, change(b, 1.0) - rate
        a1, b1 = a + dt * da, b + dt * db
        late = law(np.maximum(a1, 0.0), np.maximum(b1, 0.0))
        a = a + 0.5 * dt * (da + change(a1, 0.0) - late)
        b = b + 0.5 * dt * (db + change(b1, 1.0) - late)
        a, b = np.maximum(a, 0.0), np.maximum(b, 0.0)
        total += 0.5 * dt * (rate + late).sum() * edge * edge * POROSITY
        day = step * dt
        for shown in SHOWN:
            if abs(day - shown) < 0.5 * dt:
                found[shown] = total
    return found


def main():
    folder, name = sys.argv[1], sys.argv[2]
    mu = float(sys.argv[3]) if len(sys.argv) > 3 else 0.03
    k = mu * 2.0 / (2.0 * 0.1 * 0.2 + 0.3 * np.log(2.0) + 0.25)
    laws = {
        "monod": lambda a, b: mu * a / (0.1 + a) * b / (0.2 + b),
        "bilinear": lambda a, b: k * a * b,
    }
    flow = velocities(conductivity(folder))
    coarse, fine = made(*flow, laws[name]), made(*finer(*flow), laws[name])
    for day in SHOWN:
        print(f"{day:4.0f} d  {coarse[day]:8.3f}  {fine[day]:8.3f}  {2.0 * fine[day] - coarse[day]:8.3f}")


if __name__ == "__main__":
    main()
