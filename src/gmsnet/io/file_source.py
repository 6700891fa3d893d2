"""The file that a mesh was read from, which can stand for the mesh again once its nodes have moved."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gmsnet.errors import FormatError
from gmsnet.io.contents import Data
from gmsnet.io.normals import Find, Normals, all_rewritten
from gmsnet.io.pieces import Piece, Pieces
from gmsnet.io.splice import Points, Share, Slots
from gmsnet.io.stamps import Stamps
from gmsnet.mesh.cell_block import CellBlock
from gmsnet.mesh.mesh import Mesh
from gmsnet.mesh.normals import CellData, PointData, fields_in


@dataclass(frozen=True, eq=False)
class FileSource:
    """The bytes that a mesh was read from (the Source of a Mesh).

    format: its name in the table of formats. data: the file that holds the coordinates, under the suffix ``main``.
    points, cells, region_names, point_data, cell_data, node_sets: as read (see Mesh). companions: other files of the
    same mesh by suffix, which never change (Triangle's ``.ele``). unread: what else there is in the file (see Parsed).
    stamps: of the files, so that what others write into them meanwhile is not overwritten. images, form, shares: see
    Parsed. find: what finds normals in the file. renews: they are computed anew where nodes have moved. stale: those
    that are to be, but cannot be found in the file, in words.
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
    find: Find | None = field(default=None, repr=False)
    renews: bool = False
    stale: tuple[str, ...] = ()

    def __reduce__(self) -> tuple[Any, ...]:
        """For pickle: the bytes of the files themselves."""
        files = {suffix: data[:] for suffix, data in self.companions.items()}
        names, fields, cell_fields = (dict(each) for each in (self.region_names, self.point_data, self.cell_data))
        return FileSource, (
            self.format, self.main, self.data[:], self.points, self.slots, self.cells, files,
            names, fields, cell_fields, self.unread, self.stamps, self.images, dict(self.node_sets),
            self.form, dict(self.shares), self.find, self.renews, self.stale,
        )  # fmt: skip

    @property
    def normals(self) -> str:
        """See Source."""
        return "of facets" if self.format == "stl" else next((each for each in self.unread if "normals" in each), "")

    @cached_property
    def _normals(self) -> dict[str, bool]:
        """What normals are found in it → whether any is other than 0."""
        return {each.what: bool((each.values != 0.0).any()) for each in self._found({self.main: self.data})}

    @property
    def renewable(self) -> tuple[str, ...]:
        """See Source."""
        return tuple(what for what, there in self._normals.items() if there)

    def renewing(self, point_data: PointData, cell_data: CellData) -> FileSource:
        """See Source."""
        found = {*self._normals}
        stale = tuple(sorted({*fields_in(self.point_data, self.cell_data)} - found))
        if self.normals and not found:
            stale = stale or (self.normals,)
        return replace(self, point_data=point_data, cell_data=cell_data, renews=bool(found), stale=stale)

    def _found(self, files: Mapping[str, Data]) -> list[Normals]:
        if self.find is None or self.shares:
            return []
        try:
            return self.find(files, self.cells)
        except FormatError as error:
            raise FormatError(f"{next(iter(self.stamps.known), 'the file')}: its normals: {error}") from None

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
            whole[self.main] = Pieces(lambda: self._replaced(points))
            for key, share in self.shares.items():
                whole[key] = Pieces(partial(share.replace, self.companions[key], self.points, points))
        return whole

    def _replaced(self, points: Points) -> Iterable[Piece]:
        """The file with the coordinates of other points, and with its normals computed anew where that is asked."""
        pieces = self.slots.replace(self.data, self.points, points)
        if self.find is None or not self.renews:
            return pieces
        return all_rewritten(pieces, self.main, self.find, self.cells, self.points, points)


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
