"""The meshes that tools are compared on. They are kept in a folder: a good one takes its time to make."""

from __future__ import annotations

from pathlib import Path

import numpy as np

import gmsnet
from gmsnet.generate import disturb
from gmsnet.generate.delaunay import labelled, triangulate, unique_edges
from gmsnet.generate.outline import SHAPES, divide
from gmsnet.topology.topology import Topology

NAMES = {"random": "random square", "jittered": "jittered good mesh"}
SEED = 0
OFF_LATTICE, ROUNDS, MARGIN = 0.3, 5, 0.3  # in edges; rounds of the relaxation; in edges
THROW = 0.3  # of the good mesh's nodes, in mean lengths of their edges


def stored(folder: Path, name: str, nodes: int) -> Path:
    """The file with the arrays of a mesh, about so many inner nodes; made if it is not there."""
    path = folder / f"{name}-{nodes}.npz"
    if not path.exists():
        mesh = {"random": random, "jittered": jittered}[name](nodes)
        triangles = next(block.nodes for block in mesh.cells if block.kind == "triangle")
        folder.mkdir(parents=True, exist_ok=True)
        unfinished = path.with_suffix(".part.npz")
        np.savez(unfinished, points=mesh.points, cells=triangles)
        unfinished.replace(path)
    return path


def random(nodes: int) -> gmsnet.Mesh:
    """Mean 1/q 0.69, least 1/q next to 0."""
    return gmsnet.random_mesh(nodes, seed=SEED)


def jittered(nodes: int) -> gmsnet.Mesh:
    """A good mesh (mean 1/q 0.99; eight of ten inner nodes have six neighbours, two have five or seven) thrown to 0.90.

    It stays valid.
    """
    mesh = good(nodes)
    return disturb(mesh, Topology.of(mesh).free, THROW, seed=SEED)


def good(nodes: int) -> gmsnet.Mesh:
    """Rows of equilateral triangles, pushed off the lattice; then to the means of neighbours and triangulated anew.

    (``gmsnet.generate.good_mesh`` makes such meshes of any domain, but takes a minute for 10,000 nodes.)
    """
    edge = np.sqrt(2.0 / np.sqrt(3.0) / nodes)
    _, shape = SHAPES["square"]
    rings = shape(edge, None)
    boundary = divide(rings, edge, None)
    rows = lattice(edge)
    pushed = rows + edge * np.random.default_rng(SEED).uniform(-OFF_LATTICE, OFF_LATTICE, rows.shape)
    inner = np.clip(pushed, MARGIN * edge, 1.0 - MARGIN * edge)
    mesh = triangulate(*boundary, inner)
    for _ in range(ROUNDS):
        inner = means_of_neighbours(mesh.points, mesh.triangles)[-len(inner) :]
        mesh = triangulate(*boundary, inner)
    return labelled(mesh, [name for ring in rings for name in ring.markers])


def lattice(edge: float) -> np.ndarray:
    """(n, 2): points about an edge apart, in rows, every second one shifted by half an edge, inside of the square."""
    rows, columns = round(1.0 / (edge * np.sqrt(0.75))), round(1.0 / edge)
    shifted, plain = (np.arange(columns) + 0.5) / columns, np.arange(1, columns) / columns
    return np.concatenate(
        [np.column_stack([x := (plain if row % 2 else shifted), np.full(len(x), row / rows)]) for row in range(1, rows)]
    )


def means_of_neighbours(points: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """(N, 2): for each node the mean of its neighbours."""
    edges = unique_edges(triangles)
    tail, head = np.concatenate([edges, edges[:, ::-1]]).T
    sums = [np.bincount(tail, points[head, axis], len(points)) for axis in range(2)]
    return np.column_stack(sums) / np.bincount(tail, minlength=len(points))[:, None]
