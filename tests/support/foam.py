"""Meshes of OpenFOAM made by hand: lists of points, faces and patches, and the files of them in each form."""

from __future__ import annotations

import struct
from collections.abc import Mapping, Sequence

import numpy as np

from gmsnet.mesh.mesh import Mesh

Lists = dict[str, object]

# A hexahedron, a wedge on it, a pyramid beside it with a tetrahedron on one of its sides.
POINTS = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1],
          [0, 0.5, 1.7], [1, 0.5, 1.7], [2, 0.5, 0.5], [2, 0.5, 2]]  # fmt: skip
CELLS = [
    [[0, 3, 2, 1], [4, 5, 6, 7], [0, 1, 5, 4], [3, 7, 6, 2], [0, 4, 7, 3], [1, 2, 6, 5]],
    [[4, 7, 6, 5], [4, 8, 7], [5, 6, 9], [4, 5, 9, 8], [7, 8, 9, 6]],
    [[1, 5, 6, 2], [1, 2, 10], [2, 6, 10], [6, 5, 10], [5, 1, 10]],
    [[6, 10, 5], [6, 11, 10], [10, 11, 5], [5, 11, 6]],
]  # the faces of each, seen from outside counter-clockwise


def poly_mesh(points: object, cells: list[list[list[int]]], patch_of: object = None) -> Lists:
    """The lists of a polyMesh: internal faces by owner and neighbour, then those of the patches."""
    seen: dict[tuple[int, ...], tuple[int, list[int]]] = {}
    inner, outer = [], []
    for cell, faces in enumerate(cells):
        for face in faces:
            key = tuple(sorted(face))
            if key in seen:
                owner, listed = seen.pop(key)
                inner.append((owner, cell, listed))
            else:
                seen[key] = (cell, face)
    choose = patch_of or (lambda face: "walls")
    outer = sorted((choose(face), cell, face) for cell, face in seen.values())  # type: ignore[operator]
    inner.sort()
    names = list(dict.fromkeys(name for name, _, _ in outer))
    counts = [sum(name == other for other, _, _ in outer) for name in names]
    return {
        "points": points, "faces": [face for *_, face in inner] + [face for *_, face in outer],
        "owner": [owner for owner, _, _ in inner] + [cell for _, cell, _ in outer],
        "neighbour": [other for _, other, _ in inner],
        "boundary": [(name, "empty" if name == "sides" else "wall", count, len(inner) + sum(counts[:k]))
                     for k, (name, count) in enumerate(zip(names, counts, strict=True))],
    }  # fmt: skip


def head(kind: str, name: str, form: str = "ascii", arch: str = "") -> str:
    arch = f'    arch "{arch}";\n' * bool(arch)
    entries = f"    format {form};\n    class {kind};\n{arch}    object {name};\n"
    return f"/* made up */\nFoamFile\n{{\n{entries}}}\n// * * //\n\n"


CLASSES = {"points": "vectorField", "faces": "faceList", "owner": "labelList", "neighbour": "labelList",
           "boundary": "polyBoundaryMesh"}  # fmt: skip


def in_text(lists: Lists, end: str = "\n") -> dict[str, bytes]:
    rows = {
        "points": [f"({' '.join(map(repr, map(float, p)))})" for p in lists["points"]],  # type: ignore[attr-defined]
        "faces": [f"{len(f)}({' '.join(map(str, f))})" for f in lists["faces"]],  # type: ignore[attr-defined]
        "owner": [str(k) for k in lists["owner"]], "neighbour": [str(k) for k in lists["neighbour"]],  # type: ignore[attr-defined]
        "boundary": [f"{n}\n{{\n type {t};\n inGroups List<word> 1({t});\n nFaces {c};\n startFace {s};\n}}"
                     for n, t, c, s in lists["boundary"]],  # type: ignore[attr-defined]
    }  # fmt: skip
    return {
        key: (head(CLASSES[key], key) + f"{len(each)}\n(\n" + "\n".join(each) + "\n)\n\n// *** //\n")
        .replace("\n", end)
        .encode()
        for key, each in rows.items()
    }


def in_binary(lists: Lists, label: int = 32, scalar: int = 64, order: str = "<") -> dict[str, bytes]:
    whole, real = {32: "i", 64: "q"}[label], {32: "f", 64: "d"}[scalar]
    arch = f"{'LSB' if order == '<' else 'MSB'};label={label};scalar={scalar}"

    def packed(values: list[float], code: str, count: int | None = None) -> bytes:
        raw = struct.pack(f"{order}{len(values)}{code}", *values)
        return b"%d\n(" % (len(values) if count is None else count) + raw + b")\n"

    corners = [k for face in lists["faces"] for k in face]  # type: ignore[attr-defined]
    offsets = [0, *np.cumsum([len(face) for face in lists["faces"]]).tolist()]  # type: ignore[attr-defined]
    flat = [float(x) for p in lists["points"] for x in p]  # type: ignore[attr-defined]
    bodies = {
        "points": packed(flat, real, len(flat) // 3), "faces": packed(offsets, whole) + b"\n" + packed(corners, whole),
        "owner": packed(lists["owner"], whole), "neighbour": packed(lists["neighbour"], whole),  # type: ignore[arg-type]
    }  # fmt: skip
    kinds = {**CLASSES, "faces": "faceCompactList"}
    made = {key: head(kinds[key], key, "binary", arch).encode() + body for key, body in bodies.items()}
    return {**made, "boundary": in_text(lists)["boundary"]}


VOLUMES = poly_mesh(POINTS, CELLS)


def layer(columns: int = 3, rows: int = 3, split: bool = True) -> Lists:
    """One layer of hexahedra, some of them cut into two wedges, between the empty patch ``sides``."""
    across = (columns + 1) * (rows + 1)
    points = [[x + 0.21 * (0 < x < columns and 0 < y < rows), y, z] for z in (0, 0.5) for y in range(rows + 1)
              for x in range(columns + 1)]  # fmt: skip
    cells = []
    for y in range(rows):
        for x in range(columns):
            a = y * (columns + 1) + x
            quad = [a, a + 1, a + columns + 2, a + columns + 1]
            for polygon in [quad[:3], [quad[0], quad[2], quad[3]]] if split and (x + y) % 2 else [quad]:
                sides = [
                    [p, q, q + across, p + across] for p, q in zip(polygon, polygon[1:] + polygon[:1], strict=True)
                ]
                cells.append([polygon[::-1], [k + across for k in polygon], *sides])

    def patch(face: list[int]) -> str:
        levels = {k // across for k in face}
        return "sides" if len(levels) == 1 else "inlet" if all(k % (columns + 1) == 0 for k in face) else "rest"

    return poly_mesh(points, cells, patch)


FORMS = {
    "text": in_text, "text, crlf": lambda lists: in_text(lists, "\r\n"), "binary": in_binary,
    "binary, 64": lambda lists: in_binary(lists, 64), "big endian": lambda lists: in_binary(lists, order=">"),
    "single": lambda lists: in_binary(lists, scalar=32),
}  # fmt: skip

# The faces of a cell of each kind, seen from outside counter-clockwise.
OUTWARD = {
    "tetra": [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]],
    "pyramid": [[0, 3, 2, 1], [0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]],
    "wedge": [[0, 2, 1], [3, 4, 5], [0, 1, 4, 3], [1, 2, 5, 4], [2, 0, 3, 5]],
    "hexahedron": [[0, 3, 2, 1], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]],
}


def cells_of_mesh(mesh: Mesh) -> list[list[list[int]]]:
    """The faces of each volume cell of a mesh, as ``poly_mesh`` takes them."""
    return [
        [[int(cell[k]) for k in face] for face in OUTWARD[block.kind]]
        for block in mesh.cells if block.kind in OUTWARD for cell in block.nodes
    ]  # fmt: skip


def zones_in_binary(key: str, zones: Mapping[str, Sequence[int]]) -> bytes:
    """A file of zones, whose faces have a side, too."""
    kind = key[:-5]
    body = b"%d\n(\n" % len(zones)
    for name, members in zones.items():
        raw = struct.pack(f"<{len(members)}i", *members)
        body += f"{name}\n{{\n    type {kind}Zone;\n{kind}Labels      List<label> \n{len(members)}\n(".encode()
        body += raw + b");\n"
        if kind == "face":
            body += b"flipMap      List<bool> \n%d\n(" % len(members) + b"\1" * len(members) + b");\n"
        body += b"}\n"
    return head("regIOobject", key, "binary", "LSB;label=32;scalar=64").encode() + body + b")\n"


def merged(cells: list[list[list[int]]], pairs: int) -> list[list[list[int]]]:
    """Pairs of cells with a common face become one cell each."""
    for _ in range(pairs):
        at = {tuple(sorted(face)): k for k, cell in enumerate(cells) for face in cell if len(cell) < 7}
        one, other, common = next(
            (k, at[key], key) for k, cell in enumerate(cells) if len(cell) < 7
            for key in (tuple(sorted(face)) for face in cell) if at[key] != k
        )  # fmt: skip
        both = [face for face in cells[one] + cells[other] if tuple(sorted(face)) != common]
        cells = [cell for k, cell in enumerate(cells) if k not in (one, other)] + [both]
    return cells
