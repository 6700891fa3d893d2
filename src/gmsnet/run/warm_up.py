"""Compiling ahead: small meshes of each kind, smoothed in each of the ways that files bring about."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from gmsnet import io
from gmsnet.errors import InputError
from gmsnet.generate import (
    Curve,
    block_volume,
    disturb,
    good_mesh,
    layered_mesh,
    random_mesh,
    random_quad_mesh,
    random_volume,
    second_order,
    sheared_mesh,
)
from gmsnet.kernels.jit.watch import Compilation
from gmsnet.mesh.mesh import Mesh
from gmsnet.run.api import smooth

NODES = 150  # of a small mesh
FAR = 0.6  # of a mesh that is to be tangled, nodes are thrown by up to so many edges

Way = Mapping[str, Any]
SECOND_ORDER, SURFACE, SOLID = "second-order", "surface", "hexahedron"
WAYS: Sequence[Way] = ({}, {"preserve": "none"}, {"slide": True}, {"guard": "star"})
PLANAR: Sequence[Way] = (*WAYS, {"preserve": "size"}, {"target_quality": 0.35}, {"target_angle": 25.0})
SPACE: Sequence[Way] = (*WAYS, {"target_quality": 0.4}, {"target_dihedral": 20.0})
KINDS: Mapping[str, Sequence[Way]] = {
    "triangle": PLANAR,
    "quad": PLANAR,
    "tetra": SPACE,
    SOLID: (*WAYS, {"target_quality": 0.4}),
    SURFACE: ({}, {"slide": True}, {"guard": "star"}),
    SECOND_ORDER: ({}, {"preserve": "none"}),
}


def warm_up(kinds: Sequence[str] | None = None) -> Iterator[tuple[str, float]]:
    """Compiles what the default method needs for meshes of some kinds (default: all), those in files included.

    "quad" is for meshes of quads and triangles, "hexahedron" for those of hexahedra, wedges and pyramids, too.
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
    meshes = _meshes(kind)
    tangled = [] if kind == SURFACE else _tangled(meshes[0])
    for mesh, ways in [(mesh, KINDS[kind]) for mesh in (meshes[0], *tangled)] + [
        (mesh, KINDS[kind][:1]) for mesh in meshes[1:]
    ]:
        for way in ways:
            result = smooth(mesh, max_sweeps=20, **way)
            _ = result.limits, result.after.summary()  # which reports show
    with TemporaryDirectory() as folder:
        for suffix in (".vtk", ".su2") if kind not in (SECOND_ORDER, SURFACE) else (".vtk",):
            path = Path(folder) / f"mesh{suffix}"
            io.write(meshes[0], path)
            io.write(smooth(io.read(path), max_sweeps=2).mesh, path)


def _tangled(mesh: Mesh) -> list[Mesh]:
    """Nodes inside are thrown, which is soon mended; and nodes of the boundary as well, so that cells stay inverted."""
    every = np.arange(len(mesh.points))
    free = np.setdiff1d(every, smooth(mesh, max_sweeps=0).held["boundary"])
    most = every[: 3 * len(every) // 4]
    return [disturb(mesh, nodes, far * FAR, seed=1, keep_valid=False) for nodes, far in ((free, 1.0), (most, 2.0))]


def _meshes(kind: str) -> list[Mesh]:
    """Of the planar ones: random, with layers, refined towards a wall, deformed as a whole."""
    if kind == "tetra":
        return [random_volume(NODES, seed=1)]
    if kind == SOLID:
        return [block_volume(4, "mixed")]
    quads = random_quad_mesh(NODES, cells="mixed", seed=1)
    if kind == SURFACE:
        return [_bent(random_mesh(NODES, seed=1)), _bent(quads)]
    if kind == SECOND_ORDER:
        return [second_order(random_mesh(NODES, seed=1)), second_order(quads)]
    if kind == "quad":
        return [quads, layered_mesh(cells="mixed"), sheared_mesh(24, cells="quad")]
    turn = np.linspace(0.0, 2.0 * np.pi, 400)
    hole = Curve(0.5 * np.column_stack([np.cos(turn), np.sin(turn)]), "hole")
    square = Curve(4.0 * np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0]]), "square")
    refined = good_mesh([[square], [hole]], lambda p: 0.01 + 0.25 * np.abs(np.hypot(*p.T) - 0.5))
    return [random_mesh(NODES, seed=1), layered_mesh(cells="triangle"), refined, sheared_mesh(24)]


def _bent(mesh: Mesh) -> Mesh:
    """The same in space, on a paraboloid."""
    x, y = mesh.points[:, :2].T
    return Mesh(np.column_stack([x, y, 0.3 * (x * x + y * y)]), mesh.cells)
