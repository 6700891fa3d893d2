"""What is known of the cells of a mesh, by their kinds, and how many there are of which kind, in words."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from gmsnet.cells.jacobian import has_form
from gmsnet.cells.table import CELLS
from gmsnet.mesh.cell_block import CellBlock, cells_in_words
from gmsnet.mesh.display import amount
from gmsnet.mesh.mesh import Mesh


def counts(mesh: Mesh) -> str:
    """How many nodes and cells of which kind a mesh has, in words."""
    return ", ".join([amount(len(mesh.points), "node"), *cells_in_words(mesh.cells)])


def unmeasured(mesh: Mesh) -> str:
    """How many cells of which kind are no triangles and no plane quads, in words: no quality is known of them.

    Where there are volumes, of these polyhedra and pyramids of second order. "" if there are none. Those of a kind that
    is not known count among them, as they may be faces, or volumes; vertices and lines do not.
    """
    dimension = 3 if mesh.has_volumes else 2
    return _counted(block for block in mesh.cells if block.dimension in (dimension, None) and not measured(mesh, block))


def unmoved(counts: Mapping[str, int]) -> str:
    """How many volumes are of kinds whose nodes are held, in words; "" if there are none. counts: kind → cells."""
    volumes = [kind for kind in counts if kind not in CELLS or CELLS[kind].dimension == 3]
    return _in_words({kind: counts[kind] for kind in volumes if not has_form(kind)})


def unmoved_faces(mesh: Mesh) -> str:
    """How many cells of a surface in space are of second order, whose nodes are held, in words. "" if none are."""
    return _counted(block for block in mesh.cells if measured(mesh, block) and block.cell.order > 1)


def measured(mesh: Mesh, block: CellBlock) -> bool:
    """Is the quality of these cells known: are they triangles, or quads in a plane? Second-order ones by their
    corners. Where there are volumes: is their Jacobian determinant known in Bernstein form?"""
    if mesh.has_volumes:
        return has_form(block.kind)
    return block.triangular or (block.dimension == 2 and block.corners == 4)


def unknown_cells(mesh: Mesh) -> str:
    """How many cells are of a kind that is not known, in words: their nodes are held. "" if there are none."""
    return _counted(block for block in mesh.cells if block.dimension is None)


def _counted(blocks: Iterable[CellBlock]) -> str:
    counts: dict[str, int] = {}
    for block in blocks:
        if len(block.nodes):
            counts[block.kind] = counts.get(block.kind, 0) + len(block.nodes)
    return _in_words(counts)


def _in_words(counts: Mapping[str, int]) -> str:
    return ", ".join(f"{count:,} {kind} cell{'s' if count > 1 else ''}" for kind, count in counts.items() if count)
