"""The elements of Exodus II: their types, the order of their nodes, and their sides.

Source: L. A. Schoof and V. R. Yarberry, EXODUS II: A Finite Element Data Model, SAND92-2137, section 4.8.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gmsnet.cells.table import CELLS
from gmsnet.errors import FormatError

Ints = NDArray[np.int64]

# What the name of a type begins with, in capitals, and its kinds by how many nodes they have.
LINES = {2: "line", 3: "line3"}
TRIANGLES = {3: "triangle", 6: "triangle6", 7: "triangle7"}
QUADS = {4: "quad", 8: "quad8", 9: "quad9"}
TETRAHEDRA = {4: "tetra", 10: "tetra10"}
FAMILIES: tuple[tuple[tuple[str, ...], dict[int, str]], ...] = (
    (("TETRA", "TET"), TETRAHEDRA),
    (("HEX",), {8: "hexahedron", 20: "hexahedron20", 27: "hexahedron27"}),
    (("WEDGE",), {6: "wedge", 15: "wedge15", 18: "wedge18"}),
    (("PYRAMID", "PYR"), {5: "pyramid", 13: "pyramid13", 14: "pyramid14"}),
    (("TRI",), TRIANGLES),
    (("QUAD", "SHELL4", "SHELL8", "SHELL9"), QUADS),
    (("SHELL3", "SHELL6"), TRIANGLES),
    (("SHELL",), {**TRIANGLES, **QUADS}),
    (("BEAM", "TRUSS", "BAR", "EDGE", "LINE"), LINES),
    (("SPHERE", "CIRCLE", "POINT", "NODE"), {1: "vertex"}),
)
# Where the middles come in another order than in a Mesh, the place in the file of each of a Mesh's nodes. A file lists
# the middles of the edges between the two ends before those of the second end.
ORDERS: dict[str, tuple[int, ...]] = {
    "hexahedron20": (*range(12), *range(16, 20), *range(12, 16)),
    "hexahedron27": (*range(12), *range(16, 20), *range(12, 16), 23, 24, 25, 26, 21, 22, 20),
    "wedge15": (*range(9), 12, 13, 14, 9, 10, 11),
    "wedge18": (*range(9), 12, 13, 14, 9, 10, 11, 15, 16, 17),
}
SIDES: dict[str, tuple[tuple[int, ...], ...]] = {
    "triangle": ((0, 1), (1, 2), (2, 0)),
    "quad": ((0, 1), (1, 2), (2, 3), (3, 0)),
    "tetra": ((0, 1, 3), (1, 2, 3), (0, 3, 2), (0, 2, 1)),
    "hexahedron": ((0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (0, 4, 7, 3), (0, 3, 2, 1), (4, 5, 6, 7)),
    "wedge": ((0, 1, 4, 3), (1, 2, 5, 4), (0, 3, 5, 2), (0, 2, 1), (3, 4, 5)),
    "pyramid": ((0, 1, 4), (1, 2, 4), (2, 3, 4), (3, 0, 4), (0, 3, 2, 1)),
}
# Sides of second-order elements are kept by their corners: a marker says which nodes are meant.
_FIRST_ORDER = {"triangle6": "triangle", "triangle7": "triangle", "quad8": "quad", "quad9": "quad",
                "tetra10": "tetra", "hexahedron20": "hexahedron", "hexahedron27": "hexahedron", "wedge15": "wedge",
                "wedge18": "wedge", "pyramid13": "pyramid", "pyramid14": "pyramid"}  # fmt: skip
_SIDE_KINDS = {2: "line", 3: "triangle", 4: "quad"}


def kind_of(called: str, nodes: int, dimension: int) -> str:
    """The kind of elements of a type. Raises FormatError where it is not known, or has not so many nodes."""
    upper = "".join(c for c in called.upper() if c.isalnum())
    for beginnings, kinds in FAMILIES:
        if upper.startswith(beginnings):
            if nodes not in kinds:
                raise FormatError(f"elements of type {called[:24]!r} with {nodes} nodes are not known")
            return kinds[nodes]
    raise FormatError(f"elements of type {called[:24]!r} are not known in a mesh of {dimension} dimensions")


FACES_OF_SHELL = 2  # its first sides, which are the element itself and are not kept; its edges follow


class Sides(NamedTuple):
    """One side of some elements of a block. block: its number, from 0. rows: (n,) the elements, by their places in it.
    corners: those of an element that the side has."""

    block: int
    rows: Ints
    corners: tuple[int, ...]


def sides_of(
    blocks: Sequence[tuple[str, int]], elements: Ints, sides: Ints, dimension: int
) -> tuple[dict[str, list[Sides]], int]:
    """Sides by the kind of cell that they are, and how many are not kept: elements have fewer dimensions than the mesh.

    blocks: the kind of the elements of each, and how many. elements, sides: (n,) counted from 0. Raises FormatError for
    elements and sides that do not exist.
    """
    count = sum(number for _, number in blocks)
    if len(elements) and not 0 <= elements.min() <= elements.max() < count:
        raise FormatError(f"a side set names an element that is none of {count}")
    found: dict[str, list[Sides]] = {}
    kept, end = 0, 0
    for block, (whole, number) in enumerate(blocks):
        kind, start = _FIRST_ORDER.get(whole, whole), end
        end += number
        here = np.flatnonzero((elements >= start) & (elements < end))
        if CELLS[whole].dimension != dimension or kind not in SIDES or not len(here):
            continue
        of_shell = CELLS[whole].dimension == 2 and int(sides[here].max()) >= len(SIDES[kind])
        first = FACES_OF_SHELL if of_shell else 0
        if not 0 <= sides[here].min() <= sides[here].max() < first + len(SIDES[kind]):
            raise FormatError(f"a side set names a side that a {kind} does not have")
        for side, corners in enumerate(SIDES[kind], first):
            some = here[sides[here] == side]
            if len(some):
                found.setdefault(_SIDE_KINDS[len(corners)], []).append(Sides(block, elements[some] - start, corners))
                kept += len(some)
    return found, len(elements) - kept
