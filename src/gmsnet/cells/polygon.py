"""Cells with any number of corners: polygons of five corners or more, and polyhedra."""

from __future__ import annotations

from gmsnet.cells.kind import CellKind

KINDS = (
    CellKind("polygon", dimension=2, nodes=None, corners=None),
    CellKind("polyhedron", dimension=3, nodes=None, corners=None),
)
