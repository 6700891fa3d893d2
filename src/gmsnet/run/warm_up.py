"""Compiling ahead: small meshes of each kind, smoothed in each of the ways that files bring about."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from gmsnet import io
from gmsnet.errors import InputError
from gmsnet.generate import Curve, disturb, good_mesh, layered_mesh, random_mesh, random_quad_mesh, random_volume
from gmsnet.kernels.jit.watch import Compilation
from gmsnet.mesh.mesh import Mesh
from gmsnet.run.api import smooth

NODES = 300  # of a small mesh
FAR = 0.6  # of a mesh that is to be tangled, nodes are thrown by up to so many edges

Way = Mapping[str, Any]
WAYS: Sequence[Way] = ({}, {"preserve": "none"}, {"slide": True}, {"guard": "star"})
PLANAR: Sequence[Way] = (*WAYS, {"target_quality": 0.35}, {"target_angle": 25.0})
KINDS: Mapping[str, Sequence[Way]] = {"triangle": PLANAR, "quad": PLANAR, "tetra": WAYS}


def warm_up(kinds: Sequence[str] | None = None) -> Iterator[tuple[str, float]]:
    """Compiles what the default method needs for meshes of some kinds (default: all), those in files included.

    "quad" is for meshes of quads and triangles, too.
    Yields each kind when it is done, with the seconds that went into compilation. Raises InputError for other kinds.
    """
    for kind in kinds or KINDS:
        if kind not in KINDS:
            raise InputError(f"unknown kind of cells {kind!r}: known are {', '.join(KINDS)}")
    for kind in dict.fromkeys(kinds or KINDS):
        with Compilation() as compilation:
            _use(kind)
        yield kind, compilation.seconds


def _use(kind: str) -> None:
    mesh = _mesh(kind)
    free = np.setdiff1d(np.arange(len(mesh.points)), np.concatenate(list(smooth(mesh, max_sweeps=0).held.values())))
    tangled = disturb(mesh, free, FAR, seed=1, keep_valid=False)
    for given in (
        mesh,
        tangled,
        *([] if kind == "tetra" else [layered_mesh(cells="mixed" if kind == "quad" else kind)]),
    ):
        for way in KINDS[kind]:
            result = smooth(given, max_sweeps=20, **way)
            _ = result.limits, result.after.summary()  # which reports show
    with TemporaryDirectory() as folder:
        for suffix in (".vtk", ".su2"):
            path = Path(folder) / f"mesh{suffix}"
            io.write(mesh, path)
            io.write(smooth(io.read(path), max_sweeps=2).mesh, path)


def _walled(kind: str) -> list[Mesh]:
    """With layers along a wall, and refined towards one."""
    if kind == "tetra":
        return []
    turn = np.linspace(0.0, 2.0 * np.pi, 200)
    hole = Curve(0.5 * np.column_stack([np.cos(turn), np.sin(turn)]), "hole")
    square = Curve(4.0 * np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0]]), "square")
    refined = good_mesh([[square], [hole]], lambda p: 0.02 + 0.25 * np.abs(np.hypot(*p.T) - 0.5))
    return [layered_mesh(cells="mixed" if kind == "quad" else kind), refined]


def _mesh(kind: str) -> Mesh:
    if kind == "tetra":
        return random_volume(NODES, seed=1)
    return random_mesh(NODES, seed=1) if kind == "triangle" else random_quad_mesh(NODES, cells="mixed", seed=1)
