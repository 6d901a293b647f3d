"""Velocity variances of lognormal fields by another way: numpy, and a direct solver of scipy.

Takes nothing from Lamella. `python independent.py [fields]` prints, per variance of ln K, the effective conductivity
over the geometric mean and the variances of velocity over the squared mean: through faces, and in the middle of cells.
"""

import sys

import numpy as np
import scipy.sparse as sparse
from scipy.sparse.linalg import spsolve

NX, NY, LENGTH = 400, 200, 8.0


def log_conductivity(random):
    """One field with covariance exp(-r / LENGTH), from a periodic one of twice the size."""
    lag = [np.minimum(np.arange(2 * n), 2 * n - np.arange(2 * n)) for n in (NX, NY)]
    covariance = np.exp(-np.hypot(lag[0][:, None], lag[1][None, :]) / LENGTH)
    spectrum = np.maximum(np.fft.fft2(covariance).real, 0.0)
    noise = random.standard_normal(spectrum.shape) + 1j * random.standard_normal(spectrum.shape)
    return np.fft.fft2(np.sqrt(spectrum / spectrum.size) * noise).real[:NX, :NY]


def flow(k):
    """Flow through faces under a mean gradient of one, walls below and above."""
    number = np.arange(NX * NY).reshape(NX, NY)
    tx, ty = 2 / (1 / k[1:] + 1 / k[:-1]), 2 / (1 / k[:, 1:] + 1 / k[:, :-1])
    diagonal, right = np.zeros((NX, NY)), np.zeros((NX, NY))
    diagonal[1:] += tx
    diagonal[:-1] += tx
    diagonal[:, 1:] += ty
    diagonal[:, :-1] += ty
    diagonal[0] += 2 * k[0]
    diagonal[-1] += 2 * k[-1]
    right[0] = 2 * k[0] * NX
    pairs = [(number[1:], number[:-1], -tx), (number[:, 1:], number[:, :-1], -ty)]
    entries = [(number, number, diagonal)] + pairs + [(b, a, t) for a, b, t in pairs]
    rows, columns, values = (np.concatenate([entry[place].ravel() for entry in entries]) for place in range(3))
    head = spsolve(sparse.csc_matrix((values, (rows, columns))), right.ravel()).reshape(NX, NY)
    qx = np.vstack([2 * k[:1] * (NX - head[:1]), tx * (head[:-1] - head[1:]), 2 * k[-1:] * head[-1:]])
    return qx, ty * (head[:, :-1] - head[:, 1:])


def main():
    n_fields = int(sys.argv[1]) if len(sys.argv) > 1 else 12
    for variance in (0.25, 1.0, 4.0):
        found = []
        for field in range(n_fields):
            k = np.exp(np.sqrt(variance) * log_conductivity(np.random.default_rng(100 + field)))
            qx, qy = flow(k)
            mean = qx.mean()
            walled = np.pad(qy, ((0, 0), (1, 1)))
            middle = 0.5 * (qx[1:] + qx[:-1]), 0.5 * (walled[:, 1:] + walled[:, :-1])
            found.append([mean] + [v.var() / mean**2 for v in (qx[1:-1], qy, *middle)])
        found = np.array(found)
        print(variance, found.mean(0).round(4), "+-", (found.std(0, ddof=1) / np.sqrt(n_fields)).round(4))


if __name__ == "__main__":
    main()
