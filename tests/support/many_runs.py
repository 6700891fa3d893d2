"""Runs of many kinds, printed as hashes of what they make: python -m support.many_runs."""

from __future__ import annotations

import json
from collections.abc import Iterator
from typing import Any

import numpy as np
from golden import digest, solid, tangled

import gmsnet
from gmsnet import Mesh, generate
from gmsnet.generate import disturb_on


def meshes() -> dict[str, Mesh]:
    """Small ones, of every kind."""
    return {
        "triangles": gmsnet.random_mesh(300, seed=1),
        "quads": generate.random_quad_mesh(300, seed=1),
        "triangles and quads": generate.random_quad_mesh(400, seed=0, cells="mixed"),
        "layers": generate.layered_mesh(8, 100.0, 40, cells="mixed"),
        "tangled": tangled(300, 4),
        "second order": generate.second_order(gmsnet.random_mesh(100, seed=1)),
        "surface": disturb_on(generate.torus_surface(400), 0.4, seed=1).mesh,
        "surface of quads": disturb_on(generate.torus_surface(400, cells="quad"), 0.4, seed=1).mesh,
        "tetrahedra": disturb_on(generate.ball_volume(400), 0.4, seed=1).mesh,
        "solids": solid(),
        "second order in space": generate.second_order_volume(generate.ball_volume(100).mesh),
    }


def choices(name: str) -> Iterator[dict[str, Any]]:
    """What is asked for, of one of them."""
    yield from ({}, {"target_quality": 0.5}, {"preserve": "none"}, {"guard": "star"}, {"slide": True})
    if name in ("tetrahedra", "solids"):
        yield {"target_dihedral": 20.0}
    elif "second" not in name:
        yield {"target_angle": 20.0}
    yield from ({"method": method, "max_sweeps": 2} for method in ("barrier", "worst-first", "laplacian"))
    if name in ("triangles", "triangles and quads"):
        yield {"size": _size}


def _size(points: np.ndarray) -> np.ndarray:
    return 0.05 + 0.1 * points[:, 0] ** 2


def rows() -> dict[str, str]:
    """The hash of the points and the reason to stop, by the run."""
    found = {}
    for name, mesh in meshes().items():
        for choice in choices(name):
            try:
                result = gmsnet.smooth(mesh, threads=1, **choice)
            except gmsnet.GmsnetError as error:
                outcome = str(error)
            else:
                outcome = f"{digest(result.points)} {result.stop_reason}"
            found[f"{name}: {', '.join(choice) or 'default'} {choice.get('method', '')}"] = outcome
    return found


if __name__ == "__main__":
    print(json.dumps(rows(), indent=1))
