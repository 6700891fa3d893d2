"""Nodes of periodic boundaries, each of which has an image: they are held, or they would no longer match."""

from __future__ import annotations

import itertools
import os
from pathlib import Path

import numpy as np
import pytest
from support.foam import VOLUMES, in_text, layer
from support.gmsh_variants import Out
from test_fluent import PLAIN as FLUENT
from test_netgen import PLAIN as NETGEN

import gmsnet
from gmsnet.errors import FormatError
from gmsnet.io import fluent, gmsh, netgen, openfoam

SIZE = 5  # nodes along the side of a square


def square(version: str, order: str, level: float = 0.0) -> tuple[bytes, np.ndarray]:
    """A grid in a plane whose right side is the image of the left one, and the nodes of both. level: z of its middle,
    so that it is in no plane."""
    out, wide = Out(order), range(SIZE)
    out.text(f"$MeshFormat\n{version} {int(bool(order))} 8\n")
    if order:
        out.put("i", 1)
    out.close("MeshFormat")
    points = [(x + 0.3 * (0 < x < SIZE - 1) * (y % 2), float(y) * 0.9 ** (x % 4), level * (x == 2)) for y in wide
              for x in wide]  # fmt: skip
    quads = [(a, a + 1, a + SIZE + 1, a + SIZE) for y in range(SIZE - 1) for a in range(SIZE * y, SIZE * (y + 1) - 1)]
    images = [(SIZE * (y + 1), SIZE * y + 1) for y in wide]
    old = version == "2.2"
    out.text("$Nodes\n")
    if old:
        out.text(f"{len(points)}\n")
        for k, point in enumerate(points):
            out.put("i", k + 1, end=" ")
            out.put("d", *point)
    else:
        out.put("Q", 1, len(points), 1, len(points))
        out.put("i", 2, 1, 0, end=" ")
        out.put("Q", len(points))
        for k in range(len(points)):
            out.put("Q", k + 1)
        for point in points:
            out.put("d", *point)
    out.close("Nodes")
    out.text("$Elements\n")
    if old:
        out.text(f"{len(quads)}\n")
        if order:
            out.put("i", 3, len(quads), 2)
        for k, quad in enumerate(quads):
            out.put("i", k + 1, *(() if order else (3, 2)), 0, 1, *(node + 1 for node in quad))
    else:
        out.put("Q", 1, len(quads), 1, len(quads))
        out.put("i", 2, 1, 3, end=" ")
        out.put("Q", len(quads))
        for k, quad in enumerate(quads):
            out.put("Q", k + 1, *(node + 1 for node in quad))
    out.close("Elements")
    out.text("$Periodic\n")
    if old:
        rows = "".join(f"{a} {b}\n" for a, b in images)
        out.text(f"2\n0 2 1\n1\n{SIZE} 1\n1 2 1\nAffine{' 1' * 16}\n{len(images)}\n{rows}$EndPeriodic\n")
    else:
        out.put("Q", 2)
        for dimension, pairs in ((0, images[:1]), (1, images)):
            out.put("i", dimension, 2, 1)
            out.put("Q", 16 * dimension, end=" ")
            out.put("d", *([1.0] * 16 * dimension))
            out.put("Q", len(pairs))
            for pair in pairs:
                out.put("Q", *pair)
        out.close("Periodic")
    return b"".join(out.parts), np.unique(images) - 1


FORMS = list(itertools.product(("2.2", "4.1"), ("", "<", ">")))


@pytest.mark.parametrize(("version", "order"), FORMS)
def test_gmsh(version: str, order: str, tmp_path: Path) -> None:
    data, images = square(version, order)
    path, out = tmp_path / "a.msh", tmp_path / "b.msh"
    path.write_bytes(data)
    mesh = gmsnet.read(path)
    assert gmsh.read({".msh": data}).images.tolist() == images.tolist()
    result = gmsnet.smooth(mesh, slide="all")
    assert not result.moved[images].any()
    on_boundary = np.array([k % SIZE in (0, SIZE - 1) or k // SIZE in (0, SIZE - 1) for k in range(SIZE * SIZE)])
    assert result.moved[on_boundary].any()  # others slide
    assert f"nodes of periodic boundaries are held, so that they go on to match: {len(images)}" in result.notes
    gmsnet.write(result.mesh, out)
    again = gmsnet.smooth(gmsnet.read(out), "laplacian", slide="all")
    assert not again.moved[images].any()
    free = gmsnet.smooth(gmsnet.Mesh(mesh.points, mesh.cells), slide="all")
    assert free.moved[images].any()


@pytest.mark.parametrize("level", [0.0, 0.2])
def test_by_default_a_note_is_for_surfaces_alone(level: float) -> None:
    """In a plane and of volumes they are held as all of the boundary; a surface may have some within."""
    data, images = square("4.1", "", level)
    inner = data.replace(b"$Periodic\n2", b"$Periodic\n3").replace(b"$EndPeriodic", b"2 2 1\n0\n1\n7 8\n$EndPeriodic")
    mesh = gmsnet.io.read(_saved(inner), "gmsh")
    result = gmsnet.smooth(mesh)
    assert result.moved.any()
    assert not result.moved[[*images, 6, 7]].any()
    note = f"nodes of periodic boundaries are held, so that they go on to match: {len(images) + 2}"
    assert (note in result.notes) == bool(level)


def _saved(data: bytes) -> str:
    reading, writing = os.pipe()
    os.write(writing, data)
    os.close(writing)
    return f"/dev/fd/{reading}"


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        (b"$Periodic\n2\n", b"$Periodic\n3\n", "a count|expected|number"),
        (b"\n5 1\n10 6\n", b"\n5 1\n10 x\n", "x"),
        (b"$Periodic\n2\n", b"$Periodic\n1\n", "does not end|goes on"),
        (b"$EndPeriodic", b"", "EndPeriodic is missing"),
    ],
)
def test_damage_is_named(old: bytes, new: bytes, said: str) -> None:
    data, _ = square("4.1", "")
    assert data.count(old) >= 1
    with pytest.raises(FormatError, match=said):
        gmsh.read({".msh": data.replace(old, new)})


def test_images_that_are_not_in_the_file_are_left_out() -> None:
    data, images = square("2.2", "")
    parsed = gmsh.read({".msh": data.replace(b"\n10 6\n", b"\n1000 6\n")})
    assert parsed.images.tolist() == [node for node in images.tolist() if node not in (5, 9)]


@pytest.mark.parametrize("kind", ["cyclic", "cyclicAMI", "processorCyclic"])
def test_openfoam(kind: str) -> None:
    files = in_text({**VOLUMES, "boundary": [(n, kind, c, s) for n, _, c, s in VOLUMES["boundary"]]})
    assert openfoam.read(files).images.tolist() == list(range(12))
    assert openfoam.read(in_text(VOLUMES)).images.tolist() == []


def test_openfoam_in_a_plane() -> None:
    lists = layer(4, 3)
    patches = [(n, "cyclic" if n == "inlet" else t, c, s) for n, t, c, s in lists["boundary"]]
    parsed = openfoam.read(in_text({**lists, "boundary": patches}))
    assert parsed.images.tolist() == np.flatnonzero(parsed.points[:, 0] == 0.0).tolist()


def test_fluent() -> None:
    assert fluent.read({".msh": FLUENT}).images.tolist() == []
    wall = b"(13 (5 3 8 3 2)("
    for kind in (b"8", b"c"):  # of a periodic boundary and its image, in hexadecimal numbers
        parsed = fluent.read({".msh": FLUENT.replace(wall, wall.replace(b" 3 2)", b" %b 2)" % kind))})
        assert parsed.images.tolist() == list(range(6))


def test_netgen() -> None:
    assert netgen.read({".vol": NETGEN}).images.tolist() == []
    pairs = NETGEN.replace(b"face_colours", b"identifications\n2\n1 4 1\n2 3 1\nface_colours")
    assert netgen.read({".vol": pairs}).images.tolist() == [0, 1, 2, 3]
    with pytest.raises(FormatError, match="line 45: an identification is of two points"):
        netgen.read({".vol": pairs.replace(b"\n2 3 1\n", b"\n2\n")})
    with pytest.raises(FormatError, match="the node 9"):
        netgen.read({".vol": pairs.replace(b"\n2 3 1\n", b"\n2 9 1\n")})
