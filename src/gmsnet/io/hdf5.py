"""HDF5 files in memory: the one place that imports h5py.

Nothing outside the file is ever opened: links into other files and data kept in other files are refused. What the
library says of a damaged file is said as a FormatError.
"""

from __future__ import annotations

import io
import os
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gmsnet.errors import FormatError, InputError, MissingExtraError
from gmsnet.io.contents import Data

MAGIC = b"\x89HDF\r\n\x1a\n"
ADF = b"@(#)ADF"
NEEDED = "pip install 'gmsnet[hdf5]'"
# Numbers that a file may hold, whatever its length, and for each of its bytes: data may be compressed, or empty.
ANYWAY, PER_BYTE = 1 << 22, 32
MOST_MEMBERS = 100_000  # of one group

_ERRORS = (OSError, KeyError, RuntimeError, ValueError, TypeError, UnicodeError, OverflowError, SystemError)


def library() -> Any:
    """The module h5py. Raises MissingExtraError where it is not installed."""
    try:
        import h5py
    except ModuleNotFoundError as error:
        if error.name != "h5py":
            raise  # it is there, but something that it needs is not
        raise MissingExtraError(f"files in HDF5 need h5py, which is not installed: {NEEDED}") from error
    return h5py


@contextmanager
def said_of(path: str) -> Iterator[None]:
    """Errors of the library as FormatError. Nothing but calls of the library may stand in the block."""
    try:
        yield
    except InputError:
        raise
    except _ERRORS as error:
        said = "".join(c for c in str(error).splitlines()[0][:120] if c.isprintable()) if str(error) else ""
        where = f"{shown(path)}: " if path else ""
        raise FormatError(f"{where}the HDF5 file is damaged or cut off ({said or type(error).__name__})") from None


def shown(path: str) -> str:
    """A path within a file for a message: short and printable."""
    return "".join(c if c.isprintable() else "?" for c in path[:80])


class File:
    """A file that is read. budget: how many numbers may still be taken from it."""

    h5py: Any
    data: Data
    budget: int
    root: Node

    def __init__(self, data: Data) -> None:
        self.h5py, self.data = library(), data
        if bytes(data[: len(MAGIC)]) != MAGIC:
            adf = bytes(data[: len(ADF)]) == ADF
            more = ": it is of ADF, the older form of CGNS; adf2hdf makes it HDF5" if adf else ""
            raise FormatError(f"byte 0: this is no HDF5 file{more}")
        self.budget = ANYWAY + PER_BYTE * len(data)
        with said_of(""):
            self.root = Node(self, "", self.h5py.File(io.BytesIO(data[:]), "r"))

    @classmethod
    @contextmanager
    def opened(cls, path: str) -> Iterator[File]:
        """A file that is not in memory, of which some numbers are read. Raises FormatError for a damaged one."""
        file = cls.__new__(cls)
        file.h5py, file.data = library(), b""
        file.budget = ANYWAY + PER_BYTE * os.path.getsize(path)
        with said_of(""):
            handle = file.h5py.File(path, "r")
        try:
            file.root = Node(file, "", handle)
            yield file
        finally:
            handle.close()

    def take(self, path: str, count: int) -> None:
        """Counts numbers that are about to be read. Raises FormatError where they are too many."""
        self.budget -= count
        if self.budget < 0:
            raise FormatError(
                f"{shown(path)}: {count} numbers are too many for a file of {len(self.data)} bytes: is it damaged?"
            )


class Node:
    """A group or a data set. path: within the file, for messages."""

    file: File
    path: str
    thing: Any

    def __init__(self, file: File, path: str, thing: Any) -> None:
        self.file, self.path, self.thing = file, path, thing

    @property
    def is_data(self) -> bool:
        """Whether this is a data set and no group."""
        return isinstance(self.thing, self.file.h5py.Dataset)

    def names(self) -> list[str]:
        """The members of a group in the order of their creation, where the file keeps it; none of a data set."""
        if self.is_data:
            return []
        with said_of(self.path):
            if len(self.thing) > MOST_MEMBERS:
                raise FormatError(f"{shown(self.path)}: a group of more than {MOST_MEMBERS} members")
            return list(self.thing)

    def get(self, name: str) -> Node | None:
        """A member of a group by its path; None where there is none.

        Raises FormatError for links into other files.
        """
        at: Node = self
        for part in filter(None, name.split("/")):
            if at.is_data:
                return None
            path = f"{at.path}/{part}"
            with said_of(path):
                link = at.thing.get(part, getlink=True)
                if link is None:
                    return None
                if isinstance(link, self.file.h5py.ExternalLink):
                    raise FormatError(f"{shown(path)}: a link into another file: put the mesh into one file")
                found = at.thing.get(part)
            if found is None or not isinstance(found, (self.file.h5py.Dataset, self.file.h5py.Group)):
                return None
            at = Node(self.file, path, found)
        return at

    def need(self, name: str) -> Node:
        """A member that must be there. Raises FormatError."""
        found = self.get(name)
        if found is None:
            raise FormatError(f"{shown(f'{self.path}/{name}')}: missing: the file is damaged, or of another kind")
        return found

    def members(self) -> Iterator[Node]:
        """All members of a group."""
        for name in self.names():
            if (found := self.get(name)) is not None:
                yield found

    @property
    def name(self) -> str:
        """The last part of the path."""
        return self.path.rpartition("/")[2]

    def attribute(self, name: str) -> Any:
        """An attribute as text, number or array; None where there is none."""
        with said_of(f"{self.path}/{name}"):
            value = self.thing.attrs.get(name)
        if isinstance(value, bytes):
            value = value.decode("utf-8", "replace")
        return value.strip("\0 ") if isinstance(value, str) else value

    def shape(self) -> tuple[int, ...]:
        """Of a data set. Raises FormatError for a group and for a data set of no numbers."""
        if not self.is_data:
            raise FormatError(f"{shown(self.path)}: a data set was expected, found a group")
        with said_of(self.path):
            found = self.thing.shape
        if found is None:
            raise FormatError(f"{shown(self.path)}: the data set is empty")
        return tuple(int(size) for size in found)

    def array(self, kinds: str) -> NDArray[Any]:
        """The values of a data set, whose type must be one of NumPy's kinds (``iu``, ``f``, ``S``).

        Raises FormatError where they are not, and where they are kept in another file.
        """
        shape = self.shape()
        with said_of(self.path):
            kind = self.thing.dtype.base  # a value may be an array, as names of groups in MED are
            if kind.kind not in kinds or (kind.kind == "f" and kind.itemsize not in (4, 8)):
                raise FormatError(f"{shown(self.path)}: values of type {kind} are not understood here")
            if self.thing.external or self.thing.is_virtual:
                raise FormatError(f"{shown(self.path)}: the values are kept in another file: put them into one")
            self.file.take(self.path, int(np.prod(shape, dtype=object)) if shape else 1)
            found: NDArray[Any] = np.asarray(self.thing[()])
        return found

    def some(self, first: int, last: int) -> NDArray[np.int64]:
        """Some of the whole numbers of a data set with one number in a row. Raises FormatError for another one."""
        with said_of(self.path):
            if self.thing.dtype.kind not in "iu" or self.thing.ndim != 1:
                raise FormatError(f"{shown(self.path)}: a list of whole numbers was expected")
            return np.asarray(self.thing[first:last]).astype(np.int64)

    def numeric(self) -> bool:
        """Whether a data set is of whole numbers or of floats of four or eight bytes."""
        with said_of(self.path):
            kind = self.thing.dtype
        return kind.kind in "iu" or (kind.kind == "f" and kind.itemsize in (4, 8))

    def integers(self) -> NDArray[np.int64]:
        """The whole numbers of a data set, in its shape."""
        return self.array("iu").astype(np.int64)

    def text(self) -> str:
        """The letters of a data set, of one byte each or a string."""
        values = self.array("iuS")
        letters = values.tobytes() if values.dtype.itemsize == 1 or values.dtype.kind == "S" else b""
        return letters.decode("utf-8", "replace").strip("\0 ")

    def offset(self) -> int | None:
        """The byte at which the values stand as they are; None where they are compressed or in parts."""
        with said_of(self.path):
            found = self.thing.id.get_offset()
        return None if found is None else int(found)
