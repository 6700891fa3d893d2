"""Generates docs/formats.md: what of a file is kept when it is smoothed, and what of a mesh when it is converted.

python docs/formats.py                    # the section about other programs stays as it is
python docs/formats.py --peers            # that too, for the programs that are installed (VTK, Gmsh, meshlane, meshio)
"""

from __future__ import annotations

import argparse
import tempfile
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

import format_conversions
import format_peers
import numpy as np
from format_samples import VARIANTS, Files, Variant, points_of

import gmsnet
from gmsnet.errors import FormatError
from gmsnet.io.convert import in_space
from gmsnet.mesh.mesh import Mesh

TARGET = Path(__file__).with_name("formats.md")

FORM = ("comments", "line ends", "blanks", "node numbers", "cell numbers", "cell order", "entities", "unused node",
        "more")  # fmt: skip
CONTENT = ("regions", "names of regions", "lines", "vertices", "markers", "names of markers", "point data",
           "cell data", "quads", "curved", "tetrahedra", "hexahedra", "other plane")  # fmt: skip
NEEDS = {  # what a fact is about must be there as well
    "names of regions": ("regions",), "markers": ("lines",), "names of markers": ("lines", "markers"),
    "more": ("lines",), "hexahedra": ("tetrahedra",),
}  # fmt: skip


@dataclass(frozen=True)
class Smoothed:
    """A sample that was read, smoothed, written and read again. same: it is the sample with other points, exactly."""

    mesh: Mesh
    result: Mesh
    again: Mesh
    untouched: bool
    same: bool
    written: Files


def saved(files: Files, stem: Path) -> Path:
    """Writes the files of a mesh; returns the name of the first."""
    for suffix, data in files.items():
        Path(f"{stem}{suffix}").write_bytes(data)
    return Path(f"{stem}{next(iter(files))}")


def smoothed(variant: Variant, facts: Iterable[str], folder: Path, plain: bool = False) -> Smoothed:
    """Smooths a sample (plain: without odd spellings of numbers).

    Raises FormatError where it cannot be read, AssertionError where nothing moves.
    """
    facts, points = frozenset(facts), points_of(facts, plain)
    files = variant.make(facts, points)
    path = saved(files, folder / "sample")
    mesh = gmsnet.read(path)
    main = next(iter(files))
    said = gmsnet.write(mesh, folder / f"untouched{main}")
    result = gmsnet.smooth(mesh).mesh
    said += gmsnet.write(result, folder / f"smoothed{main}")
    untouched, written = (_saved_as(folder / stem, files) for stem in ("untouched", "smoothed"))
    again = gmsnet.read(folder / f"smoothed{main}")
    moved = (mesh.points != result.points).any(axis=1)
    assert moved.any(), f"{variant.title} with {sorted(facts)}: no node has moved"
    expected = variant.make(facts, _moved(points, mesh, result))
    return Smoothed(mesh, result, again, untouched == files and not said, written == expected, written)


def _saved_as(stem: Path, files: Files) -> Files:
    return {suffix: Path(f"{stem}{suffix}").read_bytes() for suffix in files}


def _moved(points: Sequence[Sequence[str]], old: Mesh, new: Mesh) -> list[list[str]]:
    """The decimals of the sample's points, other ones where a coordinate has changed."""
    kind = np.float32 if old.single else np.float64
    places = {tuple(point): k for k, point in enumerate(in_space(old).astype(kind).tolist())}
    (height,) = set(old.points[:8, 2:].ravel().tolist()) or {0.0}  # of the points of which two coordinates are given
    found = []
    for texts in points:
        flat = old.points.shape[1] == 2
        at = places.get(
            (*(float(kind(text)) for text in texts[: 2 if flat else 3]), *[height] * (flat or len(texts) < 3))
        )
        if at is None:  # in no cell, in a format that has no such nodes
            found.append(list(texts))
            continue
        rows = zip(texts, old.points[at], new.points[at], strict=False)
        found.append([text if a == b else repr(float(b)) for text, a, b in rows])
    return found


def facts_of(mesh: Mesh) -> tuple[object, ...]:
    """All that a mesh holds but for its points, in a form that compares."""
    return (
        mesh.points.shape, mesh.single,
        [(b.kind, b.nodes.tolist(), b.regions.tolist()) for b in mesh.cells], dict(mesh.region_names),
        {name: values.tolist() for name, values in mesh.point_data.items()},
        {name: [part.tolist() for part in parts] for name, parts in mesh.cell_data.items()},
        {name: nodes.tolist() for name, nodes in mesh.node_sets.items()},
    )  # fmt: skip


def entry(variant: Variant, fact: str, folder: Path) -> str:
    """What becomes of a fact that a file of this variant has: a word of the table."""
    less = frozenset(NEEDS.get(fact, ())) | variant.base
    more = less | {fact}
    points = points_of(less if fact == "unused node" else more)
    if less != more and variant.make(less, points) == variant.make(more, points_of(more)):
        return "–"
    try:
        found = smoothed(variant, more, folder)
    except FormatError as error:
        return f"refused: {str(error).partition(': ')[2]}"
    if not found.untouched or not found.same:
        return "**changed**"
    if facts_of(found.again) != facts_of(found.mesh) or not np.array_equal(found.again.points, found.result.points):
        return "**reads differently**"
    if less == more:
        return "used"
    files = variant.make(less, points_of(less))
    without = gmsnet.read(saved(files, folder / "without"))
    used = (facts_of(found.mesh), found.mesh.points.tolist()) != (facts_of(without), without.points.tolist())
    return "used" if used else "kept"


INTRODUCTION = """\
# What each format keeps

Generated by `python docs/formats.py`. Every entry was measured: a small file with that fact is written by hand
(`docs/format_samples.py`), read, smoothed or converted, and looked at again. A test makes a part of the tables anew.

What the names of facts mean that do not say it themselves:

- *blanks*: tabs, several blanks, empty lines. *line ends*: CRLF. *node numbers*, *cell numbers*: with gaps or in
  another order. *entities*: cells of one region that belong to several pieces of the geometry. *unused node*: one in no
  cell.
- *more*: what is not about the mesh. SU2: `AOA`, a box of free-form deformation; Gmsh: `$Periodic`; VTK, VTU: a field
  of the whole grid; Medit: ridges; OBJ: normals, a library of materials; PLY: another element;
  Abaqus, Nastran: a material; UGRID: what follows the volumes.
- *point data*, *cell data* of OBJ and OFF: colours; of binary STL: attributes. *comments* of VTK: the title.
- *markers*: lines in two groups. *curved*: triangles of six nodes. *other plane*: z = 5.
  *tetrahedra*: beside the faces; these are marks then.

SU2's markers `SEND_RECEIVE` (periodic boundaries, parts of a partitioned mesh) are vertices, so their nodes are held;
`NPERIODIC` and `PERIODIC_INDEX` are kept.

A file of any format may be compressed with gzip: its name then ends with `.gz` (`wing.su2.gz`). What it unpacks to is
promised byte for byte. It is compressed anew (level 6, without a name or a time), so its packed bytes differ.

A file of few digits (8 or 16 columns of Nastran, the 20 characters of a number that Abaqus and CalculiX read) gets new
coordinates that fit. The guard judges what they become there, and the result is what is written. A conversion says by
how much coordinates were rounded, and is refused where a cell would be inverted by it.

OpenFOAM meshes are folders, and not among the samples below. `gmsnet smooth CASE --in-place` splices
`constant/polyMesh/points`, in text or binary, plain or `.gz`; no other file is written. The output may also be a copy
of the case. One layer of cells between `empty` patches is read as the mesh of a plane, and both planes move together.
Patches are markers, zones of cells regions; points of other zones are held. Polyhedra are read and held. No other
format is converted into a case.

Meshes in several files that no file lists are one mesh, and all their files are written:

- `processor0`, `processor1`, … of a decomposed case, by the folder of the case. Where the case has a mesh of the whole,
  too, `--format decomposed` takes the processors. Faces between processors are no boundary. Only `points` change.
- `a_1.msh`, `a_2.msh`, … of Gmsh (`Mesh.PartitionSplitMeshFiles`), by the name `a.msh`, which is no file then. The
  output `b.msh` becomes `b_1.msh`, …; `--output-format gmsh` makes one file of them. Ghost cells are known as such.

What else these formats have:

- Abaqus: `*PART` and `*INSTANCE` are read, each part in its own coordinates. `*INCLUDE`, `SYSTEM=` and generated nodes
  are refused. Nodes in `*BOUNDARY`, `*CLOAD`, `*EQUATION` and `*MPC` are held; sets are names for `--fix`.
- Abaqus: C3D27 takes all of its 27 nodes; cells that leave some of the last six out are held.
- Medit: `HexahedraQ2Ordering` and its like are read. Without them, Q2 hexahedra have the middles of their faces at the
  bottom, at the top, then around; P2 prisms and pyramids have the order of VTK.
- Gmsh and MED: cells in several groups are a region "a + b", or "a, b". Each of the names means all cells of its
  group, for `--fix` and `--slide` too. Gmsh 2.2 lists such a cell once for each group; it is one cell here.
- Medit: Gmsh writes second-order quadrilaterals and hexahedra under `Quadrilaterals` and `Hexahedra`, in its own order.
  They are told by the keyword that follows.
- Nastran: nodes in another coordinate system (CP), INCLUDE and superelements are refused. Nodes of loads, supports,
  rigid elements, springs, masses and unknown elements are held. Regions are properties.
- VTK, VTU: polyhedra are read, with their nodes held, and stay in the file with their faces. No conversion holds them.
- What some programs read is refused, with the line: of VTK structured grids, triangle strips and Lagrange cells;
  several pieces in one VTU file; Nastran fields that tabs separate; lines of OBJ that go on with a backslash; a Medit
  section that comes twice; OFF without the word; a byte order mark of SU2.
- UGRID: the form is part of the name (`.b8.ugrid`, `.lb8.ugrid`, `.r8.ugrid`, …; `.ugrid` is text).

## Smoothing: the same file with other coordinates

The sample is made of the decimals of its points. It is read and written without smoothing: the same bytes. It is
smoothed and written: exactly the bytes of the sample made again with the new points, and held nodes keep the spelling
of their decimals (`1e0`, `+1.0`, `-0.0`, `.3`). It is read again: the same points, cells, regions, names and data.

**yes**: kept, and part of the mesh that gmsnet sees. **kept**: kept in the file, byte for byte, and not looked at.
–: the format, or this variant, has no such thing.
"""
CONVERTED = """\
## Converting: into another format

A mesh goes from each format that has the fact into each other format. **kept**: all of the mesh that is there because
of the fact is there again when the new file is read. **said**: left out, and named by the list that `gmsnet.write`
returns (the command line prints it). **kept, said**: kept, and something about it is named that is not, such as a name
or a number. **refused**: an error names the cells that the format cannot hold, and nothing is written. Sources are
named where they differ.
"""
BEYOND = """\
### What is in the file and not in the mesh

Into whatever other format, such facts cannot be kept. **said**: the list names them.

**silent** are only: comments, line ends and blanks; the numbers of cells, which are counted anew in the same order; the
indices behind points and cells of SU2 files, which mean nothing to SU2; the elementary entities of Gmsh 2.2.
"""


def rows_of(variants: Iterable[Variant], facts: Sequence[str], folder: Path) -> list[str]:
    """The rows of these variants in the table of these facts."""
    shown = {"used": "yes"}
    return [
        " | ".join(["", variant.title, *(shown.get(word, word) for word in words), ""]).strip()
        for variant in variants
        for words in [[entry(variant, fact, folder) for fact in facts]]
    ]


def head_of(columns: Sequence[str]) -> list[str]:
    return [f"| {' | '.join(columns)} |", "|" + "---|" * len(columns)]


def own_format(folder: Path) -> list[str]:
    lines = [INTRODUCTION]
    for title, facts in (("The form of the file", FORM), ("The mesh", CONTENT)):
        lines += [f"### {title}", "", *head_of(["", *facts]), *rows_of(VARIANTS, facts, folder), ""]
    return lines


def page(folder: Path) -> str:
    """All but what other programs read."""
    facts = (*FORM, *CONTENT, *format_conversions.SAMPLE)
    found = list(format_conversions.measured(facts, NEEDS, folder))
    lines = [*own_format(folder), CONVERTED, *format_conversions.table(found), "", BEYOND]
    return "\n".join([*lines, *format_conversions.beyond(found), ""]) + "\n"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--peers", action="store_true", help="let other programs read the smoothed files, too")
    with tempfile.TemporaryDirectory() as folder:
        text = page(Path(folder))
        if parser.parse_args().peers:
            peers = format_peers.section(smoothed, Path(folder))
        else:
            old = TARGET.read_text(encoding="utf-8") if TARGET.exists() else ""
            peers = "".join(old.partition(format_peers.TITLE)[1:])
    TARGET.write_text(text + peers, encoding="utf-8")


if __name__ == "__main__":
    main()
