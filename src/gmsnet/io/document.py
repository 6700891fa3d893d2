"""What a reader finds in a file and what a writer makes of a mesh."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, NoReturn, Protocol

import numpy as np
from numpy.typing import NDArray

from gmsnet.errors import FormatError
from gmsnet.io.contents import Data
from gmsnet.io.pieces import Pieces
from gmsnet.io.splice import Share, Slots
from gmsnet.mesh.cell_block import CellBlock
from gmsnet.mesh.mesh import Mesh
from gmsnet.mesh.rounding import Rounding


@dataclass(frozen=True)
class Parsed:
    """The facts of a file: the fields of a Mesh, and where its coordinates stand.

    unread: what else the file holds, in words; it stays in the file, but no conversion can keep it. images: (n,) nodes
    of periodic boundaries, that are images of others or have some: they are held, or they would no longer match.
    node_sets, rounding: see Mesh. form: which of its format's forms the file has (see Entry). main: which of several
    files has the coordinates, where that is not the first. shares: of a mesh whose coordinates stand in several files,
    the part of each of these.
    """

    points: NDArray[np.float64]
    cells: Sequence[CellBlock]
    slots: Slots
    region_names: Mapping[tuple[int, int], str] = field(default_factory=dict)
    point_data: Mapping[str, NDArray[Any]] = field(default_factory=dict)
    cell_data: Mapping[str, tuple[NDArray[Any], ...]] = field(default_factory=dict)
    single: bool = False
    unread: Sequence[str] = ()
    images: NDArray[np.int64] = field(default_factory=lambda: np.empty(0, dtype=np.int64))
    node_sets: Mapping[str, NDArray[np.int64]] = field(default_factory=dict)
    rounding: Rounding | None = None
    form: str = ""
    main: str = ""
    shares: Mapping[str, Share] = field(default_factory=dict)


@dataclass(frozen=True)
class Written:
    """The files of a converted mesh by suffix, and what the format could not hold, in words.

    The files are made when they are asked for, so that a mesh can be checked for what a format can hold at no cost.
    """

    files: Mapping[str, Pieces]
    lost: list[str] = field(default_factory=list)


def own_files_only(title: str) -> NoReturn:
    """Raises the FormatError of a format that meshes of other formats are not converted to."""
    raise FormatError(
        f"{title} files are only written again, with other coordinates: write another format, such as .vtu or .msh"
    )


class Format(Protocol):
    """A file format: one module of this folder.

    suffixes: the endings that it goes by, lower case; the first holds the coordinates. name: what messages call it.
    """

    name: str
    suffixes: tuple[str, ...]

    def read(self, files: Mapping[str, Data]) -> Parsed:
        """The facts of the file(s), suffix → bytes. Raises FormatError naming the line (or byte) and the mend."""
        ...

    def write(self, mesh: Mesh) -> Written:
        """The mesh in this format. Raises FormatError if it cannot hold the cells at all."""
        ...
