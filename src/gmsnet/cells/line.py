"""Vertices and lines."""

from __future__ import annotations

from gmsnet.cells.kind import CellKind, higher_order

VERTEX = CellKind("vertex", dimension=0, nodes=1, corners=1)
LINE = CellKind("line", dimension=1, nodes=2, corners=2, edges=((0, 1),), facets=((0,), (1,)))

KINDS = (VERTEX, LINE, higher_order(LINE, "line3", 3), higher_order(LINE, "line4", 4, order=3))
