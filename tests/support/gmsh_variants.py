"""A small mesh written by hand in all variants of Gmsh's format, text and binary."""

from __future__ import annotations

import struct
from collections.abc import Sequence

NAMES = b'$PhysicalNames\n3\n1 7 "far wall"\n2 3 "steel"\n2 4 "air"\n$EndPhysicalNames\n'
POINTS = [(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (1.0, 1.0, 0.0), (0.0, 1.0, 0.0), (0.45, 0.55, 0.0), (2.5, 0.5, 0.0)]
TAGS = [3, 10, 4, 7, 900, 12]  # with gaps, in no order
# type, physical tag, entity, nodes (indices)
LINES = [(1, 7, 11, (0, 1)), (1, 7, 11, (1, 2))]
TRIANGLES = [(2, 3, 21, (0, 1, 4)), (2, 3, 21, (1, 2, 4)), (2, 4, 22, (2, 3, 4)), (2, 4, 22, (3, 0, 4)),
             (2, 0, 23, (1, 5, 2))]  # fmt: skip
POINT = [(15, 0, 5, (5,))]


class Out:
    """Collects numbers as text or binary."""

    def __init__(self, order: str) -> None:
        self.order, self.parts = order, list[bytes]()

    def put(self, code: str, *values: float, end: str = "\n") -> None:
        if self.order:
            self.parts.append(struct.pack(f"{self.order}{len(values)}{code}", *values))
        else:
            self.parts.append((" ".join(map(repr, values)) + end).encode())

    def text(self, text: str) -> None:
        self.parts.append(text.encode())

    def close(self, section: str) -> None:
        self.text(("\n" if self.order else "") + f"$End{section}\n")


def _head(out: Out, version: str) -> None:
    out.text(f"$MeshFormat\n{version} {int(bool(out.order))} 8\n")
    if out.order:
        out.put("i", 1)
    out.close("MeshFormat")


def old(
    order: str = "", tags: Sequence[int] = TAGS, follow: bool = False, again: Sequence[tuple[object, ...]] = ()
) -> bytes:
    """Version 2.2. order: '<' or '>' for binary; follow: whether elements of one kind share a head (binary). again:
    triangles that follow the others."""
    out = Out(order)
    _head(out, "2.2")
    out.parts.append(NAMES)
    out.text(f"$Nodes\n{len(POINTS)}\n")
    for tag, point in zip(tags, POINTS, strict=True):
        out.put("i", tag, end=" ")
        out.put("d", *point)
    out.close("Nodes")
    groups = [POINT, LINES, [*TRIANGLES, *again]]
    out.text(f"$Elements\n{sum(map(len, groups))}\n")
    number = 0
    for group in groups:
        for rows in [group] if follow else [[cell] for cell in group]:
            if order:
                out.put("i", rows[0][0], len(rows), 2)
            for code, physical, entity, nodes in rows:
                number += 1
                head = (number,) if order else (number, code, 2)
                out.put("i", *head, physical, entity, *(tags[k] for k in nodes))
    out.close("Elements")
    return b"".join(out.parts)


def new(
    order: str = "", tags: Sequence[int] = TAGS, parametric: bool = False, groups: dict[int, list[int]] | None = None
) -> bytes:
    """Version 4.1, the nodes in two blocks. parametric: u and v follow; groups: surface → physical tags."""
    out = Out(order)
    _head(out, "4.1")
    out.parts.append(NAMES)
    surfaces = {21: [3], 22: [4], 23: []} | (groups or {})
    out.text("$Entities\n")
    out.put("q", 1, 1, len(surfaces), 0)
    out.put("i", 5, end=" ")
    out.put("d", *POINTS[5], end=" ")
    out.put("q", 0)
    for _dimension, entities in ((1, {11: [7]}), (2, surfaces)):
        for tag, physical in entities.items():
            out.put("i", tag, end=" ")
            out.put("d", 0.0, 0.0, 0.0, 1.0, 1.0, 0.0, end=" ")
            out.put("q", len(physical), end=" ")
            out.put("i", *physical, end=" ")
            out.put("q", 2, end=" ")
            out.put("i", 5, -5)
    out.close("Entities")
    out.text("$Nodes\n")
    out.put("q", 2, len(POINTS), min(tags), max(tags))
    for dimension, entity, rows in ((2, 21, range(4)), (1, 11, range(4, len(POINTS)))):
        out.put("i", dimension, entity, int(parametric), end=" ")
        out.put("q", len(rows))
        for k in rows:
            out.put("q", tags[k])
        for k in rows:
            out.put("d", *POINTS[k], *((0.25, 0.75)[:dimension] if parametric else ()))
    out.close("Nodes")
    out.text("$Elements\n")
    blocks = [(0, 5, POINT), (1, 11, LINES)]
    blocks += [(2, entity, [cell for cell in TRIANGLES if cell[2] == entity]) for entity in surfaces]
    out.put("q", len(blocks), sum(len(cells) for *_, cells in blocks), 1, 8)
    number = 0
    for dimension, entity, cells in blocks:
        out.put("i", dimension, entity, cells[0][0], end=" ")
        out.put("q", len(cells))
        for _, _, _, nodes in cells:
            number += 1
            out.put("q", number, *(tags[k] for k in nodes))
    out.close("Elements")
    return b"".join(out.parts)


VARIANTS = {
    "2.2 text": old(),
    "2.2 little": old("<"),
    "2.2 big": old(">"),
    "2.2 little, heads shared": old("<", follow=True),
    "4.1 text": new(),
    "4.1 little": new("<"),
    "4.1 big": new(">"),
    "4.1 text, parametric": new(parametric=True),
    "4.1 little, parametric": new("<", parametric=True),
}
