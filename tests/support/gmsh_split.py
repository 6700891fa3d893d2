"""A mesh as Gmsh writes it with one file a partition (Mesh.PartitionSplitMeshFiles): ``a_1.msh``, ``a_2.msh``, …."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from gmsnet.mesh.mesh import Mesh
from support.gmsh_variants import Out
from support.pieces import ring, strips

CODES = {"triangle": 2, "quad": 3, "tetra": 4, "hexahedron": 5}
NAMES = '$PhysicalNames\n1\n%d 1 "fluid"\n$EndPhysicalNames\n'


def save_split(
    mesh: Mesh, folder: Path, count: int = 3, *, ghosts: bool = False, order: str = "", version: str = "4.1"
) -> Path:
    """Writes the parts of a mesh of one block, in strips; returns the path that stands for them, which is no file.

    ghosts: with the cells of other parts around each (version 4.1). order: '<' or '>' for binary.
    """
    for k, data in enumerate(split(mesh, count, ghosts=ghosts, order=order, version=version), 1):
        (folder / f"a_{k}.msh").write_bytes(data)
    return folder / "a.msh"


def split(mesh: Mesh, count: int = 3, *, ghosts: bool = False, order: str = "", version: str = "4.1") -> list[bytes]:
    """The files."""
    make = _new if version == "4.1" else _old
    return [
        make(mesh, own, ring(mesh, own) if ghosts else own[:0], (k, count), order)
        for k, own in enumerate(strips(mesh, count), 1)
    ]


def _head(mesh: Mesh, order: str, version: str) -> Out:
    out = Out(order)
    out.text(f"$MeshFormat\n{version} {int(bool(out.order))} 8\n")
    if order:
        out.put("i", 1)
    out.close("MeshFormat")
    out.text(NAMES % mesh.cells[0].cell.dimension)
    return out


def _new(mesh: Mesh, own: np.ndarray, ghosts: np.ndarray, which: tuple[int, int], order: str) -> bytes:
    out, (part, count), block = _head(mesh, order, "4.1"), which, mesh.cells[0]
    dim, others = block.cell.dimension, range(count * bool(len(ghosts)))
    out.text("$PartitionedEntities\n")
    out.put("Q", count)
    out.put("Q", len(others))
    for k in others:
        out.put("i", 101 + k, 1 + k)
    out.put("Q", *(int(dim == each) for each in range(4)))
    out.put("i", 10 + part, dim, 1, end=" ")
    out.put("Q", 1, end=" ")
    out.put("i", part, end=" ")
    out.put("d", *([0.0] * 6), end=" ")
    out.put("Q", 1, end=" ")
    out.put("i", 1, end=" ")
    out.put("Q", 0)
    out.close("PartitionedEntities")
    nodes = np.unique(block.nodes[np.concatenate([own, ghosts])]).tolist()
    out.text("$Nodes\n")
    out.put("Q", 1, len(nodes), nodes[0] + 1, nodes[-1] + 1)
    out.put("i", dim, 10 + part, 0, end=" ")
    out.put("Q", len(nodes))
    for node in nodes:
        out.put("Q", node + 1)
    for node in nodes:
        out.put("d", *mesh.points[node].tolist())
    out.close("Nodes")
    out.text("$Elements\n")
    cells = [(10 + part, own), (100 + part, ghosts)][: 1 + bool(len(ghosts))]
    out.put("Q", len(cells), len(own) + len(ghosts), 1, len(block.nodes))
    for tag, some in cells:
        out.put("i", dim, tag, CODES[block.kind], end=" ")
        out.put("Q", len(some))
        for cell in some.tolist():
            out.put("Q", cell + 1, *(node + 1 for node in block.nodes[cell].tolist()))
    out.close("Elements")
    return b"".join(out.parts)


def _old(mesh: Mesh, own: np.ndarray, _ghosts: np.ndarray, which: tuple[int, int], order: str) -> bytes:
    out, block = _head(mesh, order, "2.2"), mesh.cells[0]
    nodes = np.unique(block.nodes[own]).tolist()
    out.text(f"$Nodes\n{len(nodes)}\n")
    for node in nodes:
        out.put("i", node + 1, end=" ")
        out.put("d", *mesh.points[node].tolist())
    out.close("Nodes")
    out.text(f"$Elements\n{len(own)}\n")
    if order:
        out.put("i", CODES[block.kind], len(own), 4)
    for cell in own.tolist():
        row = [] if order else [CODES[block.kind], 4]
        out.put("i", cell + 1, *row, 1, 1, 1, which[0], *(node + 1 for node in block.nodes[cell].tolist()))
    out.close("Elements")
    return b"".join(out.parts)
