"""Surfaces in files that keep normals, written and read in the plainest way, and normals by a slow twin."""

from __future__ import annotations

import math
import struct
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gmsnet.mesh.mesh import Mesh

Floats = NDArray[np.float64]


def faces_of(mesh: Mesh) -> list[list[int]]:
    """The nodes of each face, in the order of the mesh."""
    return [row for block in mesh.cells if block.dimension == 2 for row in block.nodes.tolist()]


def normals_of_faces(faces: list[list[int]], points: Floats) -> Floats:
    """(F, 3) unit vector areas."""
    found = []
    for face in faces:
        places = points[face]
        area = sum(np.cross(a, b) for a, b in zip(places, np.roll(places, -1, axis=0), strict=True))
        found.append(area / np.linalg.norm(area))
    return np.array(found)


def normals_of_points(faces: list[list[int]], points: Floats) -> Floats:
    """(N, 3) sums of those of the faces around, by their angles."""
    total = np.zeros_like(points)
    for face, normal in zip(faces, normals_of_faces(faces, points), strict=True):
        for k, node in enumerate(face):
            one, other = points[face[k - 1]] - points[node], points[face[(k + 1) % len(face)]] - points[node]
            cosine = one @ other / (np.linalg.norm(one) * np.linalg.norm(other))
            total[node] += math.acos(max(-1.0, min(1.0, cosine))) * normal
    return total / np.linalg.norm(total, axis=1)[:, None]


def _rows(rows: Any) -> str:
    return "".join(" ".join(repr(x.item() if isinstance(x, np.generic) else x) for x in row) + "\n" for row in rows)


def text_stl(mesh: Mesh, normals: Floats) -> str:
    """One solid, with these normals of its facets."""
    text = "solid a\n"
    for face, normal in zip(faces_of(mesh), normals, strict=True):
        text += "facet normal " + _rows([normal]) + "outer loop\n"
        text += "".join("vertex " + _rows([place]) for place in mesh.points[face]) + "endloop\nendfacet\n"
    return text + "endsolid a\n"


def binary_stl(mesh: Mesh, normals: Floats) -> bytes:
    """The same in single precision."""
    data = b" " * 80 + struct.pack("<I", len(normals))
    for face, normal in zip(faces_of(mesh), normals, strict=True):
        data += struct.pack("<12fH", *normal, *mesh.points[face].ravel(), 7)
    return data


def obj(mesh: Mesh, normals: Floats, smooth: bool) -> str:
    """With texture and normals: smooth: of points, or else of faces, which the first names from behind."""
    text = (
        "".join("v " + _rows([p]) for p in mesh.points) + "vt 0.5 0.5\n" + "".join("vn " + _rows([n]) for n in normals)
    )
    for k, face in enumerate(faces_of(mesh)):
        named = [n + 1 for n in face] if smooth else [k - len(normals) if k == 0 else k + 1] * len(face)
        texture = "1" if k % 2 else ""
        text += "f " + " ".join(f"{n + 1}/{texture}/{m}" for n, m in zip(face, named, strict=True)) + "\n"
    return text


def off(mesh: Mesh, normals: Floats) -> str:
    """With normals and colours of points."""
    faces = faces_of(mesh)
    rows = [[*p, *n, 0.25] for p, n in zip(mesh.points.tolist(), normals.tolist(), strict=True)]
    return f"CNOFF\n{len(rows)} {len(faces)} 0\n" + _rows(rows) + _rows([[len(face), *face] for face in faces])


def medit(mesh: Mesh, of_points: Floats, of_corner: Floats) -> str:
    """Triangles alone; normals of points, but one corner of the first triangle has its own."""
    faces, count = faces_of(mesh), len(mesh.points)
    text = f"MeshVersionFormatted 2\nDimension 3\nVertices\n{count}\n" + _rows([[*p, 0] for p in mesh.points])
    text += f"Triangles\n{len(faces)}\n" + _rows([[*(n + 1 for n in face), 1] for face in faces])
    text += f"Normals\n{count + 1}\n" + _rows(of_points) + _rows([of_corner])
    text += f"NormalAtVertices\n{count}\n" + _rows([[k + 1, k + 1] for k in range(count)])
    return text + f"NormalAtTriangleVertices\n1\n1 2 {count + 1}\nEnd\n"


def numbers_behind(path: Path, *words: str) -> Floats:
    """(n, 3) the numbers of each line of a text that begins with these words."""
    begin = " ".join(words) + " "
    lines = [line[len(begin) :].split() for line in path.read_text().splitlines() if line.startswith(begin)]
    return np.array(lines, dtype=float)


def binary_normals(path: Path) -> Floats:
    """(n, 3) those of the facets of a binary STL file."""
    data = path.read_bytes()
    return np.array([struct.unpack_from("<3f", data, k) for k in range(84, len(data), 50)], dtype=float)


def ply_variants(mesh: Mesh, normals: Floats) -> Iterator[tuple[str, bytes]]:
    """(description, file): text and binary, floats and doubles, of triangles alone (of as many corners each)."""
    faces = faces_of(mesh)
    for order, mark in (("ascii", ""), ("binary_little_endian", "<"), ("binary_big_endian", ">")):
        for of_point, of_normal in (("float", "float"), ("double", "float"), ("double", "double")):
            axes = "".join(f"property {of_point} {axis}\n" for axis in "xyz")
            axes += "".join(f"property {of_normal} n{axis}\nproperty uchar c{axis}\n" for axis in "xyz")
            head = f"ply\nformat {order} 1.0\nelement vertex {len(mesh.points)}\n{axes}"
            head += f"element face {len(faces)}\nproperty list uchar int vertex_indices\nend_header\n"
            rows = [[*p, n[0], 1, n[1], 2, n[2], 3] for p, n in zip(mesh.points, normals, strict=True)]
            if not mark:
                body = (_rows(rows) + _rows([[len(face), *face] for face in faces])).encode()
            else:
                p, n = (kind[0] for kind in (of_point, of_normal))
                body = b"".join(struct.pack(f"{mark}3{p}{n}B{n}B{n}B", *row) for row in rows)
                body += b"".join(struct.pack(f"{mark}B{len(face)}i", len(face), *face) for face in faces)
            yield f"{order} {of_point} {of_normal}", head.encode() + body
