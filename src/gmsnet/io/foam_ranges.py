"""Binary meshes of OpenFOAM of which a process reads and writes some faces and points only."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gmsnet.errors import FormatError, GmsnetError
from gmsnet.io.face_ranges import SomeFaces
from gmsnet.io.foam_cells import Faces, Ints, Sides, volumes
from gmsnet.io.foam_lists import Head, head_of, list_at
from gmsnet.io.foam_patches import LABELS, NAMED, ZONES, Patch, patches
from gmsnet.io.packed import is_packed
from gmsnet.io.ranges import Column, Plan
from gmsnet.io.rows import HEAD, Ranges, Rows, share
from gmsnet.mesh.cell_block import CellBlock

FILES = ("faces", "owner", "neighbour", "boundary")
MOST_TEXT = 1 << 24  # bytes of patches
_OVERLAP = 1 << 10  # bytes in which the head of a zone fits


class Stored(NamedTuple):
    """Whole numbers, or coordinates, of a file."""

    file: Ranges
    rows: Rows

    def of(self, first: int, last: int) -> NDArray[np.int64]:
        """(last − first, width) some rows."""
        return self.rows.of(self.file, first, last).astype(np.int64)

    def share(self, rank: int, ranks: int) -> Ints:
        """What one of so many reads."""
        return self.of(*share(self.rows.rows, rank, ranks))[:, 0]


@dataclass(frozen=True)
class FoamFaces:
    """See FaceLists. offsets: one more than faces. zones: of each file the name and the members of each zone."""

    offsets: Stored
    points: Stored
    owner: Stored
    neighbour: Stored
    patches: Sequence[Patch]
    zones: Mapping[str, Sequence[tuple[str, Stored]]]

    @property
    def count(self) -> int:
        """See FaceLists."""
        return self.owner.rows.rows

    @property
    def periodic(self) -> Sequence[int]:
        """See FaceLists."""
        return [number for number, patch in enumerate(self.patches, 1) if patch.is_periodic]

    def some(self, file: Ranges, first: int, last: int) -> SomeFaces:
        """See FaceLists."""
        offsets = self.offsets.of(first, last + 1)[:, 0] if last > first else np.zeros(1, dtype=np.int64)
        sizes = np.diff(offsets)
        if (sizes < 3).any():
            face = int(np.argmin(sizes))
            raise FormatError(f"faces: face {first + face} (counted from 0) has {sizes[face]} points")
        if not 0 <= offsets[0] <= offsets[-1] <= self.points.rows.rows:
            raise FormatError("faces: the offsets of the faces do not fit the list of their points")
        other = np.full(last - first, -1, dtype=np.int64)
        inner = self.neighbour.rows.rows
        end = max(first, min(last, inner))
        other[: end - first] = self.neighbour.of(first, end)[:, 0]
        if (other[: end - first] < 0).any():
            raise FormatError(f"neighbour: a face names the cell {other[: end - first].min()}")
        starts = [patch.start for patch in self.patches]
        markers = np.searchsorted(starts, np.arange(first, last), side="right") if starts else np.zeros_like(other)
        nodes = self.points.of(int(offsets[0]), int(offsets[-1]))[:, 0]
        inward = np.zeros(last - first, dtype=bool)
        return SomeFaces(sizes, nodes, self.owner.of(first, last)[:, 0], other, inward, markers.astype(np.int64))

    def cells(self, faces: Faces, sides: Sides, regions: Ints, before: int) -> list[CellBlock]:
        """See FaceLists."""
        return volumes(faces, sides, regions)

    def regions(self, rank: int, ranks: int, count: int) -> Sequence[tuple[int, Ints]]:
        """See FaceLists."""
        return [(number, members.share(rank, ranks)) for number, (_, members) in enumerate(self._of("cellZones"), 1)]

    def held(self, rank: int, ranks: int) -> tuple[Ints, Ints]:
        """See FaceLists."""
        faces, points = (
            np.concatenate([np.empty(0, np.int64), *(each.share(rank, ranks) for _, each in self._of(key))])
            for key in ("faceZones", "pointZones")
        )
        return faces, points

    def _of(self, key: str) -> Sequence[tuple[str, Stored]]:
        return self.zones.get(key, ())


def plan(file: Ranges) -> Plan | None:
    """How the numbers of the mesh lie that has its points in ``file``.

    None where it is no binary mesh of volumes: texts, meshes of one plane, files that are compressed or damaged.
    """
    folder = os.path.dirname(file.path)
    names = [*FILES, *(key for key in ZONES if os.path.exists(os.path.join(folder, key)))]
    if is_packed(file.path) or not all(os.path.isfile(os.path.join(folder, key)) for key in names):
        return None
    if any(os.path.exists(os.path.join(folder, f"{key}.gz")) for key in ZONES):
        return None
    files = {key: Ranges(os.path.join(folder, key)) for key in names}
    try:
        return _planned(file, files)
    except GmsnetError:  # told by the reader of the whole
        return None


def _planned(file: Ranges, files: Mapping[str, Ranges]) -> Plan | None:
    points = _list_in(file, "points", 3)
    owner, neighbour = (_list_in(files[key], key, 1) for key in ("owner", "neighbour"))
    faces = _face_lists(files["faces"])
    if points is None or owner is None or neighbour is None or faces is None or files["boundary"].size > MOST_TEXT:
        return None
    count, inner = owner.rows.rows, neighbour.rows.rows
    if not 0 < inner < count or faces[0].rows.rows != count + 1:
        return None
    known = patches(bytes(files["boundary"].read(0, files["boundary"].size)), count, inner)
    zones = {key: _zones(files[key], key) for key in ZONES if key in files}
    if any(patch.kind == "empty" and patch.faces for patch in known) or None in zones.values():
        return None
    told = {key: list(found) for key, found in zones.items() if found is not None}
    lists = FoamFaces(*faces, owner, neighbour, known, told)
    names = {(3, number): text for number, (text, _) in enumerate(told.get("cellZones", ()), 1)}
    names |= {(2, number): patch.name for number, patch in enumerate(known, 1)}
    return Plan([Column(points.rows)], [], points.rows.dtype.endswith("4"), names=names, faces=lists,
                companions=files)  # fmt: skip


def _list_in(file: Ranges, key: str, width: int) -> Stored | None:
    """The list of a binary file: whole numbers, or coordinates where several follow each other."""
    head = _head(file, key)
    return None if head is None else _list(file, head, head.body, key, width)


def _head(file: Ranges, key: str) -> Head | None:
    head = head_of(bytes(file.read(0, min(file.size, HEAD))), key)
    return head if head.binary else None


def _list(file: Ranges, head: Head, at: int, key: str, width: int = 1) -> Stored | None:
    """A list behind a byte; None where all its numbers are one, or where it does not end as it should."""
    count, uniform, begin = list_at(bytes(file.read(at, min(HEAD, file.size - at))), 0, key)
    kind = f"{head.order}f{head.scalar}" if width > 1 else f"{head.order}i{head.label}"
    rows = Rows(at + begin, count, width * int(kind[2:]), kind, width)
    if uniform or rows.end >= file.size or file.read(rows.end, 1) != b")":
        return None
    return Stored(file, rows)


def _face_lists(file: Ranges) -> tuple[Stored, Stored] | None:
    """The offsets and the points of faces."""
    head = _head(file, "faces")
    if head is None or head.kind != "faceCompactList":
        return None
    offsets = _list(file, head, head.body, "faces")
    points = None if offsets is None else _list(file, head, offsets.rows.end + 1, "faces")
    if offsets is None or points is None:
        return None
    ends = [int(offsets.of(row, row + 1)[0, 0]) for row in (0, offsets.rows.rows - 1)]
    return (offsets, points) if ends == [0, points.rows.rows] else None


def _zones(file: Ranges, key: str) -> list[tuple[str, Stored]] | None:
    """The name and the members of each zone; None where they cannot be told one after another."""
    head = head_of(bytes(file.read(0, min(file.size, HEAD))), key)
    found, at = list[tuple[str, Stored]](), head.body
    while at < file.size:
        text = bytes(file.read(at, min(HEAD, file.size - at)))
        named = NAMED.search(text)
        if named is None:
            at += max(len(text) - _OVERLAP, 1) if len(text) == HEAD else len(text)
            continue
        if len(text) == HEAD and named.end() > len(text) - _OVERLAP:  # what follows is to be seen, too
            at += named.start()
            continue
        labels, following = LABELS.search(text, named.end()), NAMED.search(text, named.end())
        if labels is None or (following and following.start() < labels.start()) or not head.binary:
            return None
        members = _list(file, head, at + labels.end(), key)
        if members is None:
            return None
        found.append((named[1].decode("utf-8", "backslashreplace"), members))
        at = members.rows.end + 1
    return found
