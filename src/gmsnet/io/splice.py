"""Writes new coordinates into the old file: every byte that is not a coordinate of a moved node stays as it was.

A reader tells where the coordinates stand (slots); this module alone replaces them. A node may stand in several
places (each triangle of an STL file repeats its corners), hence ``node``, the node of each row of slots.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from gmsnet.io.text import replace_numbers
from gmsnet.mesh import CellBlock, Mesh


class Slots(Protocol):
    """Where the coordinates of a file stand."""

    def replace(self, data: bytes, old: NDArray[np.float64], new: NDArray[np.float64]) -> bytes:
        """The file with each coordinate of ``new`` (N×dim) that differs in value from ``old`` written in its slot."""
        ...


@dataclass(frozen=True)
class TextSlots:
    """Decimal numbers in a text. starts, ends: (rows × dim) byte span of each; node: (rows,) the node of each row."""

    starts: NDArray[np.int64]
    ends: NDArray[np.int64]
    node: NDArray[np.int64]

    def replace(self, data: bytes, old: NDArray[np.float64], new: NDArray[np.float64]) -> bytes:
        """See Slots. Numbers are written as the shortest decimal that reads back as the same float64."""
        dim = self.starts.shape[1]
        changed = (old != new)[self.node][:, :dim]
        spans = np.stack([self.starts[changed], self.ends[changed]], axis=1)
        return replace_numbers(data, spans, new[self.node][:, :dim][changed])


@dataclass(frozen=True)
class BinarySlots:
    """Binary floats. offsets: (rows × dim) first byte of each; dtype: '<f4', '>f8', …; node: (rows,) see TextSlots."""

    offsets: NDArray[np.int64]
    dtype: str
    node: NDArray[np.int64]

    def replace(self, data: bytes, old: NDArray[np.float64], new: NDArray[np.float64]) -> bytes:
        """See Slots."""
        dim = self.offsets.shape[1]
        changed = (old != new)[self.node][:, :dim]
        values = new[self.node][:, :dim][changed].astype(self.dtype)
        width = values.dtype.itemsize
        array = np.frombuffer(data, dtype=np.uint8).copy()
        array[self.offsets[changed][:, None] + np.arange(width)] = values.view(np.uint8).reshape(-1, width)
        return array.tobytes()


@dataclass(frozen=True)
class EncodedSlots:
    """Coordinates inside an encoded block (base64, compressed), which a function of the format writes again."""

    rewrite: Callable[[bytes, NDArray[np.float64], NDArray[np.float64]], bytes]

    def replace(self, data: bytes, old: NDArray[np.float64], new: NDArray[np.float64]) -> bytes:
        """See Slots."""
        return self.rewrite(data, old, new)


@dataclass(frozen=True, eq=False)
class FileSource:
    """The bytes that a mesh was read from (the Source of a Mesh).

    format: its name in the table of formats. data: the file that holds the coordinates, under the suffix ``main``.
    points, cells, region_names, point_data, cell_data: as read (see Mesh). companions: other files of the same mesh by
    suffix, which never change (Triangle's ``.ele``).
    """

    format: str
    main: str
    data: bytes
    points: NDArray[np.float64]
    slots: Slots
    cells: tuple[CellBlock, ...] = ()
    companions: Mapping[str, bytes] = field(default_factory=dict)
    region_names: Mapping[tuple[int, int], str] = field(default_factory=dict)
    point_data: Mapping[str, NDArray[Any]] = field(default_factory=dict)
    cell_data: Mapping[str, tuple[NDArray[Any], ...]] = field(default_factory=dict)

    def fits(self, mesh: Mesh) -> bool:
        """Whether the file can stand for a mesh once its coordinates are replaced: everything else is as it was read.

        No file has node sets of its own, so a mesh with some does not fit.
        """
        return (
            mesh.points.shape == self.points.shape
            and not mesh.node_sets
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

    def splice(self, points: NDArray[np.float64]) -> dict[str, bytes]:
        """Suffix → bytes of each file of the mesh, with the coordinates of ``points`` (N×dim) in their slots."""
        same = points.shape == self.points.shape and bool((points == self.points).all())
        data = self.data if same else self.slots.replace(self.data, self.points, points)
        return {self.main: data, **self.companions}


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
