"""A mesh of two partitions in one Gmsh file, and what Gmsh adds between them."""

from __future__ import annotations

from support.gmsh_variants import Out

POINTS = [(float(x), float(y), 0.0) for y in range(3) for x in range(3)]
POINTS[4] = (1.125, 0.875, 0.0)
LEFT = [(0, 1, 4), (0, 4, 3), (3, 4, 7), (3, 7, 6)]
RIGHT = [(1, 2, 5), (1, 5, 4), (4, 5, 8), (4, 8, 7)]
WALL = [[(1, 0), (0, 3), (3, 6), (6, 7)], [(1, 2), (2, 5), (5, 8), (8, 7)]]  # of each partition
BETWEEN = [(1, 4), (4, 7)]
POINT, LINE, TRIANGLE = 15, 1, 2
GROUPS = {  # of wall 1, wall 2, between, face 1, face 2: as Gmsh leaves them, and as it can make them
    "none": ("", [0, 0, 0, 0, 0]),
    "kept": ('$PhysicalNames\n2\n1 2 "wall"\n2 1 "fluid"\n$EndPhysicalNames\n', [2, 2, 0, 1, 1]),
    "cut": (
        '$PhysicalNames\n7\n1 2 "wall"\n1 3 "_part{1}_physical{2}_dim{1}"\n1 4 "_part{2}_physical{2}_dim{1}"\n'
        '1 5 "_part{1,2}_physical{1}_dim{1}"\n2 1 "fluid"\n2 6 "_part{1}_physical{1}_dim{2}"\n'
        '2 7 "_part{2}_physical{1}_dim{2}"\n$EndPhysicalNames\n',
        [3, 4, 5, 6, 7],
    ),
}


def head(out: Out, version: str, names: str) -> None:
    out.text(f"$MeshFormat\n{version} {int(bool(out.order))} 8\n")
    if out.order:
        out.put("i", 1)
    out.close("MeshFormat")
    out.text(names)


def new(order: str, case: str, internal: bool = False) -> bytes:
    """Version 4.1. internal: the lines are parts of a curve of the geometry, not of a surface."""
    out, (names, groups) = Out(order), GROUPS[case]
    head(out, "4.1", names)
    out.text("$PartitionedEntities\n")
    out.put("Q", 2)
    out.put("Q", 0)
    out.put("Q", 2, 3, 2, 0)
    parents = [(0, 1, 1, [1, 2]), (0, 2, 1, [1, 2]), (1, 11, 1, [1]), (1, 12, 1, [2]),
               (1, 13, 1 if internal else 2, [1, 2]), (2, 21, 2, [1]), (2, 22, 2, [2])]  # fmt: skip
    physical = {11: groups[0], 12: groups[1], 13: groups[2], 21: groups[3], 22: groups[4]}
    for dim, tag, parent, parts in parents:
        out.put("i", tag, end=" ")
        out.put("i", parent, 1, end=" ")
        out.put("Q", len(parts), end=" ")
        out.put("i", *parts, end=" ")
        out.put("d", *([0.0] * (6 if dim else 3)), end=" ")
        tags = [physical[tag]] if physical.get(tag) else []
        out.put("Q", len(tags), end=" ")
        out.put("i", *tags, end=" ")
        if dim:
            out.put("Q", 0, end=" ")
        out.put("i", end="\n")
    out.close("PartitionedEntities")
    out.text("$Nodes\n")
    out.put("Q", 1, 9, 1, 9)
    out.put("i", 2, 21, 0, end=" ")
    out.put("Q", 9)
    for k in range(9):
        out.put("Q", k + 1)
    for point in POINTS:
        out.put("d", *point)
    out.close("Nodes")
    out.text("$Elements\n")
    blocks = [(0, 1, POINT, [(1,)]), (0, 2, POINT, [(7,)]), (1, 11, LINE, WALL[0]), (1, 12, LINE, WALL[1]),
              (1, 13, LINE, BETWEEN), (2, 21, TRIANGLE, LEFT), (2, 22, TRIANGLE, RIGHT)]  # fmt: skip
    count = sum(len(cells) for *_, cells in blocks)
    out.put("Q", len(blocks), count, 1, count)
    number = 0
    for dim, tag, code, cells in blocks:
        out.put("i", dim, tag, code, end=" ")
        out.put("Q", len(cells))
        for cell in cells:
            number += 1
            out.put("Q", number, *(node + 1 for node in cell))
    out.close("Elements")
    return b"".join(out.parts)


def old(order: str, case: str, internal: bool = False) -> bytes:
    """Version 2.2, in which Gmsh gives what lies between partitions no partition."""
    out, (names, groups) = Out(order), GROUPS[case]
    head(out, "2.2", names)
    out.text("$Nodes\n9\n")
    for k, point in enumerate(POINTS):
        out.put("i", k + 1, end=" ")
        out.put("d", *point)
    out.close("Nodes")
    inner = (1, 1) if internal else ()
    blocks = [(POINT, (0, 1), [(1,), (7,)]),
              (LINE, (groups[0], 11, 1, 1), WALL[0]), (LINE, (groups[1], 12, 1, 2), WALL[1]),
              (LINE, (groups[2], 13, *inner), BETWEEN), (TRIANGLE, (groups[3], 21, 1, 1), LEFT),
              (TRIANGLE, (groups[4], 22, 2, 2, -1), RIGHT)]  # fmt: skip
    out.text(f"$Elements\n{sum(len(cells) for *_, cells in blocks)}\n")
    number = 0
    for code, tags, cells in blocks:
        if order:
            out.put("i", code, len(cells), len(tags))
        for cell in cells:
            number += 1
            out.put("i", number, *(() if order else (code, len(tags))), *tags, *(node + 1 for node in cell))
    out.close("Elements")
    return b"".join(out.parts)
