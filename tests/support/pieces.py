"""Meshes in several files, as parallel programs write them: cut from one mesh, with ghost cells and ids of points."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

import gmsnet
from gmsnet.mesh.cell_block import CellBlock
from gmsnet.mesh.mesh import Mesh

INDEX = """<?xml version="1.0"?>
<!-- written by hand -->
<VTKFile type="PUnstructuredGrid" version="0.1" byte_order="LittleEndian">
  <PUnstructuredGrid GhostLevel="0">
    <PPoints><PDataArray type="Float64" NumberOfComponents="3"/></PPoints>
{pieces}
  </PUnstructuredGrid>
</VTKFile>
"""
BLOCKS = """<?xml version="1.0"?>
<VTKFile type="vtkMultiBlockDataSet" version="1.0" byte_order="LittleEndian">
  <vtkMultiBlockDataSet>
{blocks}
  </vtkMultiBlockDataSet>
</VTKFile>
"""


def index(paths: Sequence[str]) -> str:
    """A .pvtu file that names these."""
    return INDEX.format(pieces="\n".join(f'    <Piece Source="{path}"/>' for path in paths))


def strips(mesh: Mesh, count: int) -> list[np.ndarray]:
    """The cells of a mesh of one block in so many parts, cut across x."""
    middle = mesh.points[mesh.cells[0].nodes].mean(axis=1)[:, 0]
    return [np.sort(part) for part in np.array_split(np.argsort(middle, kind="stable"), count)]


def ring(mesh: Mesh, own: np.ndarray) -> np.ndarray:
    """The cells that touch those of a part: its ghost cells."""
    nodes = mesh.cells[0].nodes
    touched = np.isin(nodes, np.unique(nodes[own])).any(axis=1)
    touched[own] = False
    return np.flatnonzero(touched)


def piece(mesh: Mesh, own: np.ndarray, ghosts: np.ndarray | None = None, ids: bool = False) -> Mesh:
    """The cells of one part and its ghost cells as a mesh by itself."""
    ghosts = np.empty(0, dtype=np.int64) if ghosts is None else ghosts
    chosen = np.concatenate([own, ghosts])
    used, nodes = np.unique(mesh.cells[0].nodes[chosen], return_inverse=True)
    block = CellBlock(mesh.cells[0].kind, nodes.reshape(len(chosen), -1), np.zeros(len(chosen), dtype=np.int64))
    data = {"cell": (chosen.astype(np.float64) * 0.5,)}
    if len(ghosts):
        data["vtkGhostType"] = (np.repeat([0, 1], [len(own), len(ghosts)]).astype(np.uint8),)
    fields = {"height": used * 0.25, **({"GlobalPointIds": used} if ids else {})}
    return Mesh(mesh.points[used], (block,), point_data=fields, cell_data=data)


def save_pieces(
    mesh: Mesh, folder: Path, count: int = 3, ghosts: bool = False, ids: bool = False, suffix: str = ".vtu"
) -> Path:
    """Writes ``a.pvtu`` and its pieces ``a/a_0.vtu``, …; returns the path of the former."""
    (folder / "a").mkdir()
    paths = []
    for k, own in enumerate(strips(mesh, count)):
        part = piece(mesh, own, ring(mesh, own) if ghosts else None, ids)
        gmsnet.write(replace(part, source=None), folder / "a" / f"a_{k}{suffix}")
        paths.append(f"a/a_{k}{suffix}")
    (folder / "a.pvtu").write_text(index(paths))
    return folder / "a.pvtu"
