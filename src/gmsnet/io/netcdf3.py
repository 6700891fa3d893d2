"""The classic form of netCDF (versions 1, 2 and 5): where each variable stands, as its header tells.

Source: the format specification of netCDF (Unidata), section "File Format Specifications".
"""

from __future__ import annotations

import struct
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NoReturn

import numpy as np
from numpy.typing import NDArray

from gmsnet.errors import FormatError
from gmsnet.io.contents import Data

MAGIC = b"CDF"
TYPES = {1: "i1", 2: "S1", 3: ">i2", 4: ">i4", 5: ">f4", 6: ">f8", 7: "u1", 8: ">u2", 9: ">u4", 10: ">i8", 11: ">u8"}
_DIMENSIONS, _VARIABLES, _ATTRIBUTES = 10, 11, 12
MOST = 1_000_000  # dimensions, variables or attributes of one list


@dataclass(frozen=True)
class Variable:
    """shape: without the records; begin: its first byte; dtype: NumPy's; record: whether there is one for each time."""

    shape: tuple[int, ...]
    dtype: str
    begin: int
    attributes: dict[str, str]
    record: bool

    @property
    def size(self) -> int:
        """Bytes, those of one record if there are any."""
        return int(np.prod(self.shape, dtype=object)) * np.dtype(self.dtype).itemsize


class Header:
    """The variables of a file by name. Raises FormatError where the header is damaged or the file is cut off."""

    data: Data
    at: int
    dimensions: dict[str, int]
    end: int

    def __init__(self, data: Data) -> None:
        self.data, self.at = data, 4
        version = data[3] if len(data) > 3 else 0
        if bytes(data[:3]) != MAGIC or version not in (1, 2, 5):
            raise FormatError("byte 0: this is no netCDF file of version 1, 2 or 5")
        self.count, self.place = (">q" if version == 5 else ">i"), (">i" if version == 1 else ">q")
        self._number(self.count)  # of records
        dimensions = [(self._text(), self._number(self.count)) for _ in range(self._list(_DIMENSIONS))]
        self._attributes()
        self.variables: dict[str, Variable] = {}
        for _ in range(self._list(_VARIABLES)):
            name, variable = self._variable([length for _, length in dimensions])
            self.variables[name] = variable
        self.dimensions, self.end = dict(dimensions), self.at

    def _variable(self, lengths: list[int]) -> tuple[str, Variable]:
        name = self._text()
        ids = [self._number(self.count) for _ in range(self._length(1024))]
        attributes, code = self._attributes(), self._number(">i")
        self._number(self.count)  # its bytes, which the shape tells as well
        begin = self._number(self.place)
        if any(not 0 <= k < len(lengths) for k in ids) or code not in TYPES:
            self._fail("a variable has a dimension or a type that is unknown")
        shape = [lengths[k] for k in ids]
        record = bool(shape) and shape[0] == 0
        return name, Variable(tuple(shape[record:]), TYPES[code], begin, attributes, record)

    def _attributes(self) -> dict[str, str]:
        """The attributes that are texts."""
        found = {}
        for _ in range(self._list(_ATTRIBUTES)):
            name, code = self._text(), self._number(">i")
            if code not in TYPES:
                self._fail("an attribute has an unknown type")
            count = self._length(len(self.data))
            raw = self._bytes(count * np.dtype(TYPES[code]).itemsize)
            if TYPES[code] == "S1":
                found[name] = raw.decode("utf-8", "replace").strip("\0 ")
        return found

    def _list(self, expected: int) -> int:
        """How many members a list of this kind has."""
        tag, count = self._number(">i"), self._length(MOST)
        if tag != expected and (tag or count):
            self._fail("the header is damaged")
        return count

    def _length(self, most: int) -> int:
        count = self._number(self.count)
        if not 0 <= count <= most:
            self._fail(f"a count is out of range: {count}")
        return count

    def _number(self, form: str) -> int:
        size = struct.calcsize(form)
        if self.at + size > len(self.data):
            self._fail("the header ends: is the file cut off?")
        found: int = struct.unpack(form, self.data[self.at : self.at + size])[0]
        self.at += size
        return found

    def _text(self) -> str:
        return self._bytes(self._length(4096)).decode("utf-8", "replace")

    def _bytes(self, count: int) -> bytes:
        found = bytes(self.data[self.at : self.at + count])
        if len(found) < count:
            self._fail("the header ends: is the file cut off?")
        self.at += count + -count % 4
        return found

    def _fail(self, message: str) -> NoReturn:
        raise FormatError(f"byte {self.at}: {message}")

    def array(self, name: str) -> NDArray[Any]:
        """The values of a variable without records, in its shape. Raises FormatError where the file ends before."""
        variable = self.placed(name)
        size = variable.size
        found: NDArray[Any] = np.ndarray(variable.shape, variable.dtype, bytes(
            self.data[variable.begin : variable.begin + size]))  # fmt: skip
        return found

    def placed(self, name: str) -> Variable:
        """A variable without records. Raises as ``array``."""
        found = self.variables[name]
        if found.record or not 0 <= found.begin <= len(self.data) - found.size or min(found.shape, default=0) < 0:
            raise FormatError(f"the variable {name[:40]!r} is not wholly in the file: is it cut off?")
        return found

    def check_apart(self, names: Sequence[str]) -> None:
        """Raises FormatError where bytes of these variables are of the header or of another variable, too."""
        own = [(each.begin, each.begin + each.size) for each in (self.variables[name] for name in names)]
        others = [(0, self.end)] + [(each.begin, each.begin + each.size) for name, each in self.variables.items()
                                    if name not in names]  # fmt: skip
        if any(a < d and c < b for a, b in own for c, d in others):
            raise FormatError(f"bytes of {', '.join(names)} are of something else, too: the header is damaged")
