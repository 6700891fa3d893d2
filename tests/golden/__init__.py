"""What every method makes of some planar triangle meshes and of a block of volumes, to the last bit, as hashes.

What is rebuilt without meaning to change a result must leave them as they are. After a change that is meant,

    PYTHONPATH=src:tests python -m golden

writes them anew, and the commit says which changed and why.
"""

from __future__ import annotations

import hashlib
import json
import os
from pathlib import Path

import numpy as np
from support import blocks

import gmsnet
from gmsnet import METHODS, CellBlock, Mesh
from gmsnet.generate import disturb, layered_mesh
from gmsnet.topology.solids import KINDS

FILE = Path(__file__).with_name("golden.json")
LEVELS = ("valid", "worst", "star")
CHOICES = {
    "-".join(filter(None, (name, variant, objective))): {
        "method": name,
        **({"variant": variant} if variant else {}),
        **({"objective": objective} if objective else {}),
    }
    for name, method in METHODS.items()
    for variant in method.variants or [""]
    for objective in method.objectives or [""]
}
FILES = ("mesh_NACA0012_inv.su2", "japan_sea.msh", "osteonT1_11.mesh", "internal.msh", "helmholtz_apartment.vtk")


def two_regions(nodes: int, seed: int) -> Mesh:
    """A random square whose cells wind at random, with an interface along x = 0.5 as far as cells allow."""
    mesh = gmsnet.random_mesh(nodes, seed=seed)
    triangles = mesh.cells[0].nodes.copy()
    backwards = np.random.default_rng(seed).random(len(triangles)) < 0.5
    triangles[backwards] = triangles[backwards][:, ::-1]
    right = mesh.points[triangles].mean(axis=1)[:, 0] > 0.5
    return Mesh(mesh.points, (CellBlock("triangle", triangles, right.astype(np.int64)),))


def tangled(nodes: int, seed: int) -> Mesh:
    """A random square with a tenth of its free nodes thrown until cells are inverted."""
    mesh = gmsnet.random_mesh(nodes, seed=seed)
    inner = np.flatnonzero(((mesh.points > 0) & (mesh.points < 1)).all(axis=1))
    chosen = np.random.default_rng(seed).permutation(inner)[: len(inner) // 10]
    return disturb(mesh, chosen, 1.0, seed=seed, keep_valid=False)


def generated() -> dict[str, Mesh]:
    """The meshes that are made here."""
    return {
        "small": gmsnet.random_mesh(400, seed=1),
        "large": gmsnet.random_mesh(6500, seed=2),
        "regions": two_regions(500, 3),
        "tangled": tangled(600, 4),
        "layers": rounded(layered_mesh()),
    }


def rounded(mesh: Mesh) -> Mesh:
    """The mesh with nine digits behind the point: sines have other last bits on other processors."""
    return mesh.with_points(np.round(mesh.points, 9))


def of_files(folder: str | None) -> dict[str, Mesh]:
    """The real meshes, where there are any."""
    return {name: gmsnet.read(Path(folder) / name) for name in FILES} if folder else {}


def solid() -> Mesh:
    """A block of hexahedra, wedges and pyramids, some of them inverted."""
    return blocks.block(6, 6, 6, wedges=[(2, 2), (3, 4)], pyramids=[(1, 4, 3), (4, 1, 2)], jitter=0.4, seed=5)


def results_of_solid(mesh: Mesh) -> dict[str, str]:
    """The hashes of all rows that move its cells, at all levels."""
    rows = {}
    for name, choice in CHOICES.items():
        method, part = METHODS[choice["method"]], choice.get("objective") or choice.get("variant")
        if all(method.moves(kind, part) for kind in KINDS):
            for level in LEVELS:
                rows[f"{name} {level}"] = result_of(mesh, **choice, guard=level, max_sweeps=4)
    return rows


def digest(array: np.ndarray) -> str:
    """Sixteen characters that stand for the bytes of an array."""
    return hashlib.sha256(np.ascontiguousarray(array).tobytes()).hexdigest()[:16]


def result_of(mesh: Mesh, **options: object) -> str:
    """What a run makes of a mesh: points, record and counts."""
    result = gmsnet.smooth(mesh, threads=1, **options)
    record = np.array([[s.index, s.moved, s.truncated, s.dropped, s.inverted, s.qhat] for s in result.history])
    return digest(result.points) + digest(record)


def results(mesh: Mesh, *, every: bool) -> dict[str, str]:
    """The hashes of all rows and levels (every), and of the default method with its options."""
    rows = {}
    if every:
        for name, choice in CHOICES.items():
            for level in LEVELS:
                rows[f"{name} {level}"] = result_of(mesh, **choice, guard=level, max_sweeps=4)
    for level in LEVELS:
        rows[f"default {level}"] = result_of(mesh, guard=level)
    for name, options in {
        "size": {"preserve": "size"},
        "none": {"preserve": "none"},
        "quality": {"target_quality": 0.55},
        "angle": {"target_angle": 24.0},
    }.items():
        rows[f"default {name}"] = result_of(mesh, **options)
    return rows


def all_results(folder: str | None = os.environ.get("GMSNET_MESHES")) -> dict[str, dict[str, str]]:
    """Mesh → row → hash; "input" is that of the mesh itself."""
    table = {"solid": {"input": digest(solid().points), **results_of_solid(solid())}}
    for name, mesh in generated().items():
        table[name] = {"input": digest(mesh.points), **results(mesh, every=name != "large")}
    for name, mesh in of_files(folder).items():
        table[name] = {"input": digest(mesh.points), **results(mesh, every=False)}
    return table


def recorded() -> dict[str, dict[str, str]]:
    """The hashes as they were written."""
    return json.loads(FILE.read_text())
