"""Meshes in several files that no file lists (``split_files.py``), read as one mesh and written back file by file."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

from gmsnet.errors import FormatError, InputError
from gmsnet.io import gmsh, openfoam
from gmsnet.io.contents import Data
from gmsnet.io.document import Parsed, Written, own_files_only
from gmsnet.io.foam_lists import head_of, labels, lists_of
from gmsnet.io.merge import Part, one_mesh
from gmsnet.io.splice import Untouched
from gmsnet.io.split_files import DECOMPOSED, SPLIT
from gmsnet.mesh.mesh import Mesh

IDS = "pointProcAddressing"


class Told(NamedTuple):
    """What all parts of a mesh must agree on. key: the part that says so."""

    key: str
    dimension: int
    partitions: int = -1
    names: tuple[str, ...] = ()


@dataclass(frozen=True)
class SplitFormat:
    """A format of meshes in several files that no file lists (see Format)."""

    key: str
    name: str
    suffixes: tuple[str, ...]

    def read(self, files: Mapping[str, Data]) -> Parsed:
        """See Format; the files are there under their keys, part by part (see ``Group``)."""
        groups = self.parts_of(files)
        found = [(keys[0], *there) for keys in groups if (there := self.part_in(keys, files)) is not None]
        self.check([told for _, _, told in found], len(groups))
        parsed = one_mesh({key: part for key, part, _ in found}, len(groups))
        shares = dict(parsed.shares)
        return replace(parsed, slots=shares.pop(self.suffixes[0], Untouched()), shares=shares)

    def write(self, mesh: Mesh) -> Written:
        """Raises FormatError: only files of this format are written again."""
        return own_files_only(self.name)

    def parts_of(self, files: Mapping[str, Data]) -> list[list[str]]:
        """The keys of the files of each part, that with the coordinates first."""
        groups: dict[str, list[str]] = {}
        for key in files:
            groups.setdefault(key if self.key == SPLIT else key.partition("/")[0], []).append(key)
        return list(groups.values())

    def part_in(self, keys: Sequence[str], files: Mapping[str, Data]) -> tuple[Part, Told] | None:
        """What the files of a part hold; None where it has no cells. Raises FormatError naming the part."""
        try:
            if self.key == SPLIT:
                return _of_gmsh(keys[0], files[keys[0]])
            return _of_processor(keys[0], {key.rpartition("/")[2]: files[key] for key in keys})
        except InputError as error:
            raise FormatError(f"{_shown(keys[0])}: {error}") from None

    def check(self, told: Sequence[Told], parts: int) -> None:
        """Raises FormatError where the parts that have cells are none of one mesh of so many parts."""
        for each in told:
            if not each.partitions:
                raise FormatError(f"there is no such file, and its {_shown(each.key)} is of no partitioned mesh")
            if each.partitions not in (-1, parts):
                raise FormatError(
                    f"{_shown(each.key)} is of a mesh of {each.partitions} partitions, and there are {parts} files"
                )
            if each.dimension != told[0].dimension or each.names != told[0].names:
                what = "dimensions" if each.dimension != told[0].dimension else "patches or zones"
                raise FormatError(f"{_shown(each.key)} has other {what} than {_shown(told[0].key)}")


def _shown(key: str) -> str:
    return f"part {key[1:].partition('.')[0]}" if key.startswith("_") else key.partition("/")[0]


def _of_gmsh(key: str, data: Data) -> tuple[Part, Told]:
    found = gmsh.facts(data)
    dimension = max((block.dimension or 0 for block in found.parsed.cells), default=0)
    return Part(found.parsed, found.tags), Told(key, dimension, found.partitions)


def _of_processor(key: str, files: Mapping[str, Data]) -> tuple[Part, Told] | None:
    if openfoam.is_empty(files):
        return None
    found, ids = openfoam.facts(files, whole=False), None
    if IDS in files:
        head = head_of(files[IDS], IDS)
        numbers, _ = labels(lists_of(files[IDS], head), head, head.body, IDS)
        ids = numbers[found.rows] if len(numbers) > found.rows.max(initial=-1) else None  # else of another mesh
    return Part(found.parsed, ids), Told(key, found.parsed.points.shape[1], -1, found.names)


split: SplitFormat = SplitFormat(SPLIT, "Gmsh (split)", ("_1.msh",))
decomposed: SplitFormat = SplitFormat(DECOMPOSED, "OpenFOAM (decomposed)", ("processor0/constant/polyMesh/points",))
__all__ = ["SplitFormat", "decomposed", "split"]
