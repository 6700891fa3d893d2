"""What holds for any file: it is refused in words, or the mesh that it holds can be moved and nothing else changes."""

from __future__ import annotations

import os
import resource
import shutil
import time
from collections.abc import Mapping
from contextlib import ExitStack
from pathlib import Path
from types import ModuleType
from unittest.mock import patch

import numpy as np

import gmsnet
from gmsnet.errors import InputError
from gmsnet.io import cells, contents, gmsh_sections, places, splice, stl, text
from gmsnet.io.file_source import FileSource
from gmsnet.io.formats import FORMATS
from gmsnet.io.split_files import DECOMPOSED, FILES, SPLIT
from gmsnet.mesh.mesh import Mesh

SECONDS = 5.0  # of the processor, for one file
MEMORY = 200_000_000  # bytes beyond the length of the file
LONGEST = 500  # characters of a message, without the name of the file
PAIR = b"\0"  # between the two files of Triangle, where both are one input
NEXT = b"\0next file\0"  # between those of a folder, and those that a file names


# What is looked at together, so small that a file of a few lines has many seams; and any file counts as large.
SEAMS: dict[ModuleType, dict[str, int]] = {
    contents: {"LARGE": 1},
    cells: {"MOST_BLOCKS": 3},
    places: {"MOST_LATTICES": 3},
    text: {"MOST_ROWS": 2},
    gmsh_sections: {"_TOGETHER": 8, "_ALIKE": 2},
    stl: {"_TOGETHER": 2},
    splice: {"ROWS": 2, "_PIECE": 128},
}


class Broken(AssertionError):
    """A promise is broken."""


def parts(key: str, data: bytes) -> dict[str, bytes]:
    """The files of an input by suffix."""
    suffixes = FORMATS[key].suffixes
    if FORMATS[key].folder:
        split = data.split(NEXT)
        split += [b""] * (len(suffixes) - len(split))
        return dict(zip((*suffixes, *FORMATS[key].optional), split, strict=False))
    if key == SPLIT:
        return {f"_{k}.msh": part for k, part in enumerate(data.split(NEXT), 1)}
    if key == DECOMPOSED:
        split, names = data.split(NEXT), (*FILES, "pointProcAddressing")
        split += [b""] * (-len(split) % len(names))
        where = [f"processor{k}/constant/polyMesh/{name}" for k in range(len(split) // len(names)) for name in names]
        return dict(zip(where, split, strict=True))
    if FORMATS[key].within:  # a file that names others
        split = data.split(NEXT)
        kind = ".vtp" if key == "pvtp" else ".vtu"
        return {suffixes[0]: split[0], **{f"{k}{kind}": part for k, part in enumerate(split[1:])}}
    return {suffixes[0]: data} if len(suffixes) == 1 else dict(zip(suffixes, (*data.split(PAIR, 1), b""), strict=False))


def examine(key: str, data: bytes, folder: Path) -> str:
    """Reads a file, moves its points, and reads it again. Returns what the file was refused with, or "".

    Files of an odd length are read with many seams, and as large ones. Raises Broken, or what the reader lets through.
    """
    with ExitStack() as stack:
        for module, limits in SEAMS.items() if len(data) % 2 else ():
            stack.enter_context(patch.multiple(module, **limits))
        return _examine(key, data, folder)


def _examine(key: str, data: bytes, folder: Path) -> str:
    before, peak = time.process_time(), _peak()
    files = parts(key, data)
    path = save(key, files, folder / "mesh")
    try:
        mesh = gmsnet.read(path, key)
    except InputError as error:
        said = _checked(str(error), key, folder / "mesh", files)
    else:
        said = ""
        _check_splice(mesh, files, folder, np.random.default_rng(len(data)))
    if time.process_time() - before > SECONDS:
        raise Broken(f"took {time.process_time() - before:.1f} s")
    if _peak() - peak > MEMORY + len(data):
        raise Broken(f"took {(_peak() - peak) / 1e6:.0f} MB")
    return said


def _peak() -> int:
    """The most memory that this process has had, in bytes."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024


def path_of(key: str, stem: Path) -> Path:
    """What is given to ``gmsnet.read`` of a mesh that ``save`` writes."""
    if FORMATS[key].folder:
        return stem / "polyMesh" / FORMATS[key].suffixes[0]
    return stem if key == DECOMPOSED else stem.with_suffix(".msh" if key == SPLIT else FORMATS[key].suffixes[0])


def save(key: str, files: Mapping[str, bytes], stem: Path) -> Path:
    """Writes the files of a mesh, with nothing of an earlier one among them. Returns ``path_of``."""
    shutil.rmtree(stem, ignore_errors=True)
    for old in (*stem.parent.glob("[0-9]*.vt[up]"), *stem.parent.glob(f"{stem.name}_*.msh")):  # pieces
        old.unlink()
    for name, part in files.items():
        place = _place(key, name, stem)
        place.parent.mkdir(parents=True, exist_ok=True)
        place.write_bytes(part)
    return path_of(key, stem)


def _place(key: str, name: str, stem: Path) -> Path:
    """Of the file of this suffix or name."""
    if FORMATS[key].folder:
        return stem / "polyMesh" / name
    if key == DECOMPOSED:
        return stem / name
    return stem.with_name(stem.name + name) if name.startswith((".", "_")) else stem.parent / name


def _checked(message: str, key: str, stem: Path, files: Mapping[str, bytes]) -> str:
    path = path_of(key, stem)
    beside = (_place(key, name, stem) for name in files)
    name = next((f"{one}: " for one in (path, *beside) if message.startswith(f"{one}: ")), "")
    if not name:
        raise Broken(f"the message does not begin with the file: {message[:200]!r}")
    message = message.removeprefix(name)
    if len(message) > LONGEST or not message.isprintable():
        raise Broken(f"the message is long or cannot be printed: {len(message)} {message[:200]!r}")
    if "not enough memory" in message or "of memory, but" in message:
        raise Broken(f"out of memory: {message}")
    return message


def _check_splice(mesh: Mesh, files: Mapping[str, bytes], folder: Path, random: np.random.Generator) -> None:
    source = mesh.source
    assert isinstance(source, FileSource)
    same = _spliced(source, mesh.points.copy())
    if same != {name: files[name] for name in same}:
        raise Broken("the same points do not give the same file")
    new = moved(mesh, random)
    if source.shares or FORMATS[source.format].parts:
        # Points of one piece at one place are held: apart, they would be other nodes.
        held = np.concatenate([[], *(b.nodes.ravel() for b in mesh.cells if b.kind == "vertex")]).astype(int)
        new[held] = mesh.points[held]
    again = gmsnet.read(save(source.format, _spliced(source, new), folder / "moved"), source.format)
    if again.points.tobytes() != new.tobytes():
        raise Broken("the moved points do not read back")
    if not _fits(source, again) or again.single != mesh.single:
        raise Broken("more than the points has changed")
    assert isinstance(again.source, FileSource)
    if source.format == "stl" and len(np.unique(mesh.points, axis=0)) < len(mesh.points):
        return  # nodes that only their decimals tell apart
    kept = mesh.points if again.rounding is None else again.rounding.kept(again.points, mesh.points)
    back = gmsnet.read(save(source.format, _spliced(again.source, kept), folder / "back"), source.format)
    if not np.array_equal(back.points, kept) or not _fits(source, back):
        raise Broken("points that are moved there and back are not the same")


def _fits(source: FileSource, mesh: Mesh) -> bool:
    """Whether all but the points is the same. A structured zone of CGNS that is turned inside out lists each of its
    cells the other way round."""
    if source.fits(mesh) or source.format != "cgns" or len(mesh.cells) != len(source.cells):
        return source.fits(mesh)
    same = [_turned_alike(a.nodes, b.nodes) for a, b in zip(mesh.cells, source.cells, strict=True)]
    return all(same) and source.fits(Mesh(mesh.points, source.cells, mesh.region_names, node_sets=mesh.node_sets))


def _turned_alike(cells: np.ndarray, others: np.ndarray) -> bool:
    """Whether the nodes of all cells (T, k) are those of the others, or are so in one and the same other order."""
    if cells.shape != others.shape:
        return False
    turned = (cells != others).any(axis=1)  # the zones that are
    cells, others = cells[turned], others[turned]
    if not len(cells):
        return True
    places = {node: place for place, node in enumerate(cells[0].tolist())}
    order = [places.get(node, -1) for node in others[0].tolist()]
    return -1 not in order and len(set(order)) == len(order) and np.array_equal(cells[:, order], others)


def _spliced(source: FileSource, points: np.ndarray) -> dict[str, bytes]:
    return {os.path.normpath(suffix): bytes(pieces) for suffix, pieces in source.splice(points).items()}


def moved(mesh: Mesh, random: np.random.Generator) -> np.ndarray:
    """Points of which some are elsewhere, a few at the ends of the range of numbers."""
    kind = np.float32 if mesh.single else np.float64
    new = mesh.points.copy()
    some = random.random(len(new)) < 0.5
    some[random.integers(len(new))] = True
    new[some] = random.normal(size=(int(some.sum()), new.shape[1])).astype(kind)
    extremes = np.array([np.finfo(kind).max, -np.finfo(kind).smallest_subnormal, kind(1) / kind(3)], dtype=kind)
    new[np.argmax(some), random.integers(new.shape[1])] = random.choice(extremes)
    return new if mesh.rounding is None else mesh.rounding.kept(mesh.points, new)
