"""Metrics as arrays, and their logarithms in three numbers (t, u, v): see kernels/metric/quality.py.

log M = t·I + [[u, v], [v, −u]]. Sums and means of logarithms are those of Arsigny, Fillard, Pennec, Ayache:
Log-Euclidean metrics for fast and simple calculus on diffusion tensors, Magnetic Resonance in Medicine 56, 2006.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from gmsnet.errors import InputError
from gmsnet.mesh.arrays import plain_array

Floats = NDArray[np.float64]

FORMS = "metric must be an array (N, 3) of m11, m12, m22 at the nodes, or a function from points (n, 2) to one (n, 3)"
SIZES = "size must be an array (N,) of edge lengths at the nodes, or a function from points (n, 2) to one (n,)"


def logs_of(tensors: Floats) -> Floats:
    """(n, 3) of positive definite tensors m11, m12, m22 (n, 3)."""
    largest = np.abs(tensors).max(axis=1)
    a, b, c = (tensors / largest[:, None]).T
    root = np.sqrt(a * c - b * b)
    u, v = 0.5 * (a - c) / root, b / root
    sine = np.hypot(u, v)
    share = np.where(sine > 0.0, np.arcsinh(sine) / np.where(sine > 0.0, sine, 1.0), 1.0)
    return np.column_stack([np.log(root) + np.log(largest), share * u, share * v])


def tensors_of(logs: Floats) -> Floats:
    """The tensors m11, m12, m22 (n, 3) of logarithms (n, 3)."""
    t, u, v = logs.T
    r = np.hypot(u, v)
    grown = np.exp(t)
    cosine, share = np.cosh(r), np.where(r > 0.0, np.sinh(r) / np.where(r > 0.0, r, 1.0), 1.0)
    return np.column_stack([grown * (cosine + share * u), grown * share * v, grown * (cosine - share * u)])


def checked_metric(values: Any, count: int, where: str) -> Floats:
    """The logarithms (count, 3) of tensors as given. where: in words, for messages: "node" or "point".

    Raises InputError for another shape, and for tensors that are not positive definite.
    """
    tensors = _numbers(values, FORMS)
    if tensors.shape != (count, 3):
        raise InputError(f"{FORMS}; for {count:,} {where}s it has the shape {tensors.shape}")
    a, _, c = tensors.T
    with np.errstate(over="ignore", invalid="ignore"):
        largest = np.maximum(np.abs(a), np.abs(c))
        scaled = tensors / np.where(largest > 0.0, largest, 1.0)[:, None]
        good = (
            (a > 0.0) & (c > 0.0) & (scaled[:, 0] * scaled[:, 2] > scaled[:, 1] ** 2) & np.isfinite(tensors).all(axis=1)
        )
    if not good.all():
        row = int(np.flatnonzero(~good)[0])
        raise InputError(
            f"the metric at {where} {row} (counted from 0) is not positive definite: {tensors[row].tolist()}; m11, m22 "
            "and m11·m22 − m12² must be positive"
        )
    return logs_of(tensors)


def checked_sizes(values: Any, count: int, where: str) -> Floats:
    """The logarithms (count, 3) of h⁻²·I, of lengths h as given.

    Raises InputError for another shape, and for lengths that are not positive.
    """
    sizes = _numbers(values, SIZES)
    if sizes.shape == (count, 1):
        sizes = sizes[:, 0]
    if sizes.shape != (count,):
        raise InputError(f"{SIZES}; for {count:,} {where}s it has the shape {sizes.shape}")
    good = (sizes > 0.0) & np.isfinite(sizes)
    if not good.all():
        row = int(np.flatnonzero(~good)[0])
        got = float(sizes[row])
        raise InputError(f"the size at {where} {row} (counted from 0) must be a positive number, got {got!r}")
    logs = np.zeros((count, 3))
    logs[:, 0] = -2.0 * np.log(sizes)
    return logs


def _numbers(values: Any, forms: str) -> Floats:
    found = plain_array(values, forms.split()[0])
    if found.dtype.kind not in "iuf":
        raise InputError(f"{forms}, got {found.dtype} values")
    return np.asarray(found, dtype=np.float64)
