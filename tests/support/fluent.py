"""Fluent files made by hand, with binary sections: faces by zones, each with the cells on its two sides."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

Face = tuple[Sequence[int], int, int]  # nodes and two cells, all counted from 0; −1: no cell


def saved_faces(
    points: np.ndarray, zones: Mapping[int, tuple[int, Sequence[Face]]], cells: Mapping[int, tuple[int, int]],
    names: Mapping[int, str], kind: str = "f8", order: str = "<", cuts: Sequence[int] = (),
) -> bytes:  # fmt: skip
    """zones: number → type of boundary, and faces. cells: number → first and last. cuts: nodes where zones end."""
    dimension, machine = points.shape[1], "60 0" if order == "<" else "0 60"
    key = 2000 if kind == "f4" else 3000
    out = b'(0 "made up (by hand")\n(2 %d)\n(4 (%s 0 1 2 4 4 4 8 4 4))\n' % (dimension, machine.encode())
    total = sum(len(faces) for _, faces in zones.values())
    out += b"(10 (0 1 %x 0 %d))\n(13 (0 1 %x 0))\n" % (len(points), dimension, total)

    def section(number: int, head: str, body: bytes) -> bytes:
        return b"(%d (%s)(%s\n)End of Binary Section   %d)\n" % (number, head.encode(), body, number)

    ends = [*cuts, len(points)]
    for zone, (first, last) in reversed([*enumerate(zip([0, *cuts], ends, strict=True), 100)]):
        body = points[first:last].astype(order + kind).tobytes()
        out += section(key + 10, f"{zone:x} {first + 1:x} {last:x} 1 {dimension}", body)
    for zone, (first, last) in cells.items():
        out += b"(12 (%x %x %x 1 0))\n" % (zone, first + 1, last + 1)
    at = 1
    for zone, (type_, faces) in zones.items():
        sizes = {len(nodes) for nodes, _, _ in faces}
        same = sizes.pop() if len(sizes) == 1 else 0
        rows = [[*([] if same else [len(n)]), *(k + 1 for k in n), one + 1, other + 1] for n, one, other in faces]
        body = np.array([value for row in rows for value in row], order + "i4").tobytes()
        out += section(key + 13, f"{zone:x} {at:x} {at + len(faces) - 1:x} {type_:x} {same}", body)
        at += len(faces)
    for zone, name in names.items():
        out += b"(45 (%d wall %s)())\n" % (zone, name.encode())
    return out
