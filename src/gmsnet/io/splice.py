"""Writes new coordinates into the old file: every byte that is not a coordinate of a moved node stays as it was.

A reader tells where the coordinates stand (slots); this module alone replaces them. A node may stand in several
places (each triangle of an STL file repeats its corners), hence ``node``, the node of each row of slots.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Protocol

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
    points, cells: the coordinates and cells as read. companions: other files of the same mesh by suffix, which never
    change (Triangle's ``.ele``).
    """

    format: str
    main: str
    data: bytes
    points: NDArray[np.float64]
    slots: Slots
    cells: tuple[CellBlock, ...] = ()
    companions: Mapping[str, bytes] = field(default_factory=dict)

    def fits(self, mesh: Mesh) -> bool:
        """Whether a mesh has the cells of the file and as many points, so that its text can stand for them."""
        if mesh.points.shape != self.points.shape:
            return False
        return mesh.cells is self.cells or (
            len(mesh.cells) == len(self.cells)
            and all(
                a.kind == b.kind and np.array_equal(a.nodes, b.nodes) and np.array_equal(a.regions, b.regions)
                for a, b in zip(mesh.cells, self.cells, strict=True)
            )
        )

    def splice(self, points: NDArray[np.float64]) -> dict[str, bytes]:
        """Suffix → bytes of each file of the mesh, with the coordinates of ``points`` (N×dim) in their slots."""
        same = points.shape == self.points.shape and bool((points == self.points).all())
        data = self.data if same else self.slots.replace(self.data, self.points, points)
        return {self.main: data, **self.companions}
