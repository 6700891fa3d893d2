"""Writes new coordinates into the old file: every byte that is not a coordinate of a moved node stays as it was.

A reader tells where the coordinates stand (slots); this module alone replaces them, piece by piece. A node may stand in
several places (each triangle of an STL file repeats its corners), hence ``node``, the node of each row of slots; where
it is None, row k is node k.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import partial
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from gmsnet.io.contents import Data
from gmsnet.io.pieces import Piece, Pieces
from gmsnet.io.places import Lattice, Places
from gmsnet.io.stamps import Stamps
from gmsnet.io.text import Starts, Text
from gmsnet.kernels.text import text as kernels
from gmsnet.mesh.cell_block import CellBlock
from gmsnet.mesh.mesh import Mesh
from gmsnet.mesh.rounding import Rounding

_PIECE = 1 << 20  # bytes that are written at once
ROWS = 1 << 15  # of slots that are looked at together

Points = NDArray[np.float64]


class Slots(Protocol):
    """Where the coordinates of a file stand."""

    def replace(self, data: Data, old: Points, new: Points) -> Iterable[Piece]:
        """The file with each coordinate of ``new`` (N×dim) that differs in value from ``old`` written in its slot."""
        ...


@dataclass(frozen=True)
class TextSlots:
    """Decimal numbers in a text. starts, ends: (rows × dim) byte span of each; node: (rows,) the node of each row.
    keep: what the text may hold of points (n × dim) and their nodes, where that is not all (see Rounding).
    """

    starts: Starts
    ends: Starts
    node: NDArray[np.int64] | None = None
    keep: Callable[[Points, NDArray[np.int64]], Points] | None = None

    def replace(self, data: Data, old: Points, new: Points) -> Iterator[Piece]:
        """See Slots. Numbers are written as the shortest decimal that reads back as the same float64."""
        raw, out, at = Text(data).raw, np.empty(_PIECE, dtype=np.uint8), 0
        for starts, ends, values in self._moved(old, new):
            done = 0
            while done < len(starts):
                if starts[done] - at > _PIECE // 2:
                    yield memoryview(data)[at : starts[done]]
                    at = int(starts[done])
                count, at, length = kernels.replace_floats(raw, at, starts[done:], ends[done:], values[done:], out)
                yield out.data[:length]
                done += count
        yield memoryview(data)[at:]

    def _moved(self, old: Points, new: Points) -> Iterator[tuple[Starts, Starts, Points]]:
        """Starts, ends and new values of the slots that change, in the order of the file."""
        flat = self.starts.reshape(-1)
        ascending = bool((flat[1:] > flat[:-1]).all())
        rows, dim = self.starts.shape
        step = ROWS if ascending else max(1, rows)
        differ = old != new
        for k in range(0, rows, step):
            some = slice(k, k + step)
            node = some if self.node is None else self.node[some]
            moved = differ[node, :dim]
            points = new[node, :dim]
            if self.keep is not None:
                points = self.keep(points, np.arange(len(new))[node])
            starts, ends, values = self.starts[some][moved], self.ends[some][moved], points[moved]
            order = slice(None) if ascending else np.argsort(starts)
            yield starts[order], ends[order], values[order]


def most_rounded(rounding: Rounding, old: Points, new: Points) -> float:
    """By how much the file that has the old points (N×dim) keeps one of the new ones differently, at most."""
    most = 0.0
    for k in range(0, len(new), ROWS):
        some = slice(k, k + ROWS)
        rounded = rounding.keep(new[some], np.arange(k, min(k + ROWS, len(new))))
        most = max(most, float(np.abs(rounded - new[some])[old[some] != new[some]].max(initial=0.0)))
    return most


@dataclass(frozen=True)
class BinarySlots:
    """Binary floats. places: of all coordinates, as many a row as points have; dtype: '<f4', '>f8', …; node: (rows,)
    see TextSlots.
    """

    places: Places
    dtype: str
    node: NDArray[np.int64] | None = None

    def replace(self, data: Data, old: Points, new: Points) -> Iterator[Piece]:
        """See Slots."""
        at, row, size, differ = 0, 0, np.dtype(self.dtype).itemsize, old != new
        for lattice in self.places.lattices:
            width = len(lattice.columns) // new.shape[1]  # rows of slots in one of the lattice
            for k in range(0, lattice.rows, ROWS):
                count = min(ROWS, lattice.rows - k)
                some = slice(row, row + count * width)
                row += count * width
                node = some if self.node is None else self.node[some]
                values = new[node].reshape(count, -1)
                moved = differ[node].reshape(count, -1)
                start = lattice.start + k * lattice.stride + min(lattice.columns)
                end = start + (count - 1) * lattice.stride + max(lattice.columns) - min(lattice.columns) + size
                yield memoryview(data)[at:start]
                block = bytearray(memoryview(data)[start:end])
                here = Lattice(-min(lattice.columns), count, lattice.stride)
                for j, column in enumerate(lattice.columns):
                    here.column(block, column, self.dtype)[moved[:, j]] = values[moved[:, j], j]
                yield memoryview(block)
                at = end
        yield memoryview(data)[at:]


@dataclass(frozen=True)
class Untouched:
    """No coordinates: they stand in the other files of the mesh."""

    def replace(self, data: Data, old: Points, new: Points) -> Iterable[Piece]:
        """See Slots: the file as it is."""
        return [memoryview(data)]


@dataclass(frozen=True)
class Share:
    """The part of a mesh that one of several files holds. slots: in that file; node: the node of each of its points."""

    slots: Slots
    node: NDArray[np.int64]

    def replace(self, data: Data, old: Points, new: Points) -> Iterable[Piece]:
        """See Slots. old, new: of all nodes of the mesh."""
        return self.slots.replace(data, old[self.node], new[self.node])


@dataclass(frozen=True)
class EncodedSlots:
    """Coordinates inside an encoded block (base64, compressed), which a function of the format writes again."""

    rewrite: Callable[[Data, Points, Points], Iterable[Piece]]

    def replace(self, data: Data, old: Points, new: Points) -> Iterable[Piece]:
        """See Slots."""
        return self.rewrite(data, old, new)


@dataclass(frozen=True, eq=False)
class FileSource:
    """The bytes that a mesh was read from (the Source of a Mesh).

    format: its name in the table of formats. data: the file that holds the coordinates, under the suffix ``main``.
    points, cells, region_names, point_data, cell_data, node_sets: as read (see Mesh). companions: other files of the
    same mesh by suffix, which never change (Triangle's ``.ele``). unread: what else there is in the file (see Parsed).
    stamps: of the files, so that what others write into them meanwhile is not overwritten. images, form, shares: see
    Parsed.
    """

    format: str
    main: str
    data: Data = field(repr=False)
    points: Points = field(repr=False)
    slots: Slots = field(repr=False)
    cells: tuple[CellBlock, ...] = ()
    companions: Mapping[str, Data] = field(default_factory=dict, repr=False)
    region_names: Mapping[tuple[int, int], str] = field(default_factory=dict)
    point_data: Mapping[str, NDArray[Any]] = field(default_factory=dict)
    cell_data: Mapping[str, tuple[NDArray[Any], ...]] = field(default_factory=dict)
    unread: tuple[str, ...] = ()
    stamps: Stamps = field(default_factory=Stamps, repr=False)
    images: NDArray[np.int64] = field(default_factory=lambda: np.empty(0, dtype=np.int64), repr=False)
    node_sets: Mapping[str, NDArray[np.int64]] = field(default_factory=dict, repr=False)
    form: str = ""
    shares: Mapping[str, Share] = field(default_factory=dict, repr=False)

    def __reduce__(self) -> tuple[Any, ...]:
        """For pickle: the bytes of the files themselves."""
        files = {suffix: data[:] for suffix, data in self.companions.items()}
        names, fields, cell_fields = (dict(each) for each in (self.region_names, self.point_data, self.cell_data))
        return FileSource, (
            self.format, self.main, self.data[:], self.points, self.slots, self.cells, files,
            names, fields, cell_fields, self.unread, self.stamps, self.images, dict(self.node_sets),
            self.form, dict(self.shares),
        )  # fmt: skip

    @property
    def normals(self) -> str:
        """See Source."""
        return "of facets" if self.format == "stl" else next((each for each in self.unread if "normals" in each), "")

    def fits(self, mesh: Mesh) -> bool:
        """Whether the file can stand for a mesh once its coordinates are replaced: all else is as it was read."""
        return (
            mesh.points.shape == self.points.shape
            and mesh.node_sets.keys() == self.node_sets.keys()
            and all(_same(nodes, self.node_sets[name]) for name, nodes in mesh.node_sets.items())
            and dict(mesh.region_names) == dict(self.region_names)
            and _same_cells(mesh.cells, self.cells)
            and mesh.point_data.keys() == self.point_data.keys()
            and all(_same(array, self.point_data[name]) for name, array in mesh.point_data.items())
            and mesh.cell_data.keys() == self.cell_data.keys()
            and all(
                _same(array, old)
                for name, arrays in mesh.cell_data.items()
                for array, old in zip(
                    arrays, self.cell_data[name], strict=True
                )  # one a block, and the blocks are equal
            )
        )

    def images_in(self, mesh: Mesh) -> NDArray[np.int64]:
        """(n,) the nodes of periodic boundaries, if the mesh has the cells of the file."""
        same = len(mesh.points) == len(self.points) and _same_cells(mesh.cells, self.cells)
        return self.images if same else self.images[:0]

    def splice(self, points: Points) -> dict[str, Pieces]:
        """Suffix → each file of the mesh, with the coordinates of ``points`` (N×dim) in their slots."""
        same = points.shape == self.points.shape and bool((points == self.points).all())
        whole = {suffix: _whole(data) for suffix, data in ((self.main, self.data), *self.companions.items())}
        if not same:
            whole[self.main] = Pieces(lambda: self.slots.replace(self.data, self.points, points))
            for key, share in self.shares.items():
                whole[key] = Pieces(partial(share.replace, self.companions[key], self.points, points))
        return whole


def _whole(data: Data) -> Pieces:
    return Pieces(lambda: [memoryview(data)])


def _same_cells(new: tuple[CellBlock, ...], old: tuple[CellBlock, ...]) -> bool:
    return new is old or (
        len(new) == len(old)
        and all(
            a is b or (a.kind == b.kind and _same(a.nodes, b.nodes) and _same(a.regions, b.regions))
            for a, b in zip(new, old, strict=True)
        )
    )


def _same(new: NDArray[Any], old: NDArray[Any]) -> bool:
    """Whether two arrays have the same type and values, a nan being the same as itself."""
    if new is old:
        return True
    if new.dtype != old.dtype or new.shape != old.shape:
        return False
    return new.tolist() == old.tolist() if new.dtype.hasobject else new.tobytes() == old.tobytes()
