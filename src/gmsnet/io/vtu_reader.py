"""The numbers in the arrays of a VTU file, wherever they stand and however they are encoded."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Any, NoReturn

import numpy as np
from numpy.typing import NDArray

from gmsnet.errors import FormatError
from gmsnet.io.contents import Data
from gmsnet.io.text import Text, fail
from gmsnet.io.vtu_arrays import Encoded, Encoding, decode
from gmsnet.io.vtu_compressors import Compressor, compressor_of
from gmsnet.io.vtu_xml import DataArray, Document, parse
from gmsnet.io.words import TextWords, typed

TYPES = {f"{word}{8 * size}": f"{code}{size}" for word, code in (("Int", "i"), ("UInt", "u")) for size in (1, 2, 4, 8)}
TYPES |= {"Float32": "f4", "Float64": "f8"}

# Encoded numbers that a file may hold, whatever its length, and for each of its bytes: a hundred bytes of zeros can be
# unpacked from one. A regular grid with dozens of fields that are zero has about ten.
ANYWAY, PER_BYTE = 1 << 22, 32


@dataclass(frozen=True)
class Numbers:
    """The values of an array, and where they stand: as words of a text or encoded."""

    values: NDArray[Any]
    words: TextWords | None
    encoded: Encoded | None
    start: int


class Reader:
    """Decodes the arrays of one file.

    budget: how many numbers may still be unpacked. stored: the bytes that encoded arrays have taken so far. spans:
    those of each appended array, by where its offset is written.
    """

    data: Data
    document: Document
    budget: int
    stored: int
    order: str
    header: str
    compressor: Compressor | None

    def __init__(self, data: Data, kind: str = "UnstructuredGrid") -> None:
        self.data, self.document = data, parse(data, kind)
        self.budget, self.stored = ANYWAY + PER_BYTE * len(data), 0
        self.spans: dict[int, tuple[int, int]] = {}
        root = self.document.root
        orders = {"LittleEndian": "<", "BigEndian": ">"}
        headers = {"UInt32": "u4", "UInt64": "u8"}
        self.compressor = compressor_of(root.get("compressor", ""))
        order, header = root.get("byte_order", "LittleEndian"), root.get("header_type", "UInt32")
        if order not in orders or header not in headers:
            raise FormatError(f"unknown byte_order {order[:24]!r} or header_type {header[:24]!r}")
        self.order, self.header = orders[order], orders[order] + headers[header]

    def count(self, attribute: str) -> int:
        """A number of the one piece."""
        if len(self.document.pieces) != 1:
            raise FormatError(f"the file has no Piece of {self.document.kind}")
        text = self.document.pieces[0].get(attribute, "").strip()
        if not re.fullmatch(r"\d{1,18}", text, re.ASCII):
            raise FormatError(f"the Piece has no {attribute}, or one that is no count: {text[:24]!r}")
        return int(text)

    def section(self, section: str) -> list[DataArray]:
        """The arrays of numbers in a section."""
        return [a for a in self.document.arrays if a.section == section and a.element == "DataArray"]

    def fail(self, array: DataArray, message: str) -> NoReturn:
        """Raises FormatError with the line and the name of an array."""
        fail(self.data, array.tag[0], f"the array {array.attributes.get('Name', array.section)[:40]!r}: {message}")

    def width(self, array: DataArray, default: int = 1) -> int:
        """The number of components."""
        text = array.attributes.get("NumberOfComponents", str(default)).strip()
        if not re.fullmatch(r"\d{1,9}", text, re.ASCII):
            self.fail(array, f"NumberOfComponents is {text[:24]!r}")
        return max(1, int(text))

    def numbers(self, array: DataArray, count: int) -> Numbers:
        """The ``count`` numbers of an array. Raises FormatError where there are fewer or more."""
        kind = TYPES.get(array.attributes.get("type", ""))
        if kind is None:
            self.fail(array, f"numbers of type {array.attributes.get('type', '')[:24]!r} are not supported")
        how = array.attributes.get("format", "ascii")
        if how == "ascii":
            words = self.words(array, count)
            return Numbers(typed(words.values(words.take(count, kind), kind, finite=False), kind), words, None, 0)
        start, stored, in_base64 = self._stored(array, how)
        self.budget -= count
        if self.budget < 0:
            most = ANYWAY + PER_BYTE * len(self.data)
            self.fail(array, f"{count} numbers are too many: at most {most} are unpacked of a file of {len(self.data)} "
                             "bytes: write the file without compression")  # fmt: skip
        if not count:
            return Numbers(np.empty(0, dtype=kind), None, None, start)
        try:
            found, payload = decode(stored, Encoding(self.header, self.compressor, in_base64), count * int(kind[1]))
        except FormatError as error:
            self.fail(array, str(error))
        if how == "binary" and found.length != len(stored):
            self.fail(array, "more follows behind its last number")
        if array.offset is not None:
            self.spans[array.offset[1]] = start, start + found.length
        self.stored += found.length
        if self.stored > len(self.data):
            self.fail(array, "it shares its bytes with other arrays: write the file anew, each array with its own")
        return Numbers(np.frombuffer(payload, dtype=self.order + kind).astype(kind), None, found, start)

    def words(self, array: DataArray, count: int) -> TextWords:
        """The numbers of an array that is text. Raises FormatError where there are not ``count``."""
        text = Text(self.data, stop=array.body[1], ends=b"<")
        parts = self.document.visible(*array.body)
        found = [text.until(stop).tokens(start)[0] for start, stop in parts]
        starts = found[0] if len(found) == 1 else np.concatenate(found)
        if len(starts) < count:
            text.fail(array.body[1], f"expected {count - len(starts)} more numbers, the section ends")
        if len(starts) > count:
            text.fail(int(starts[count]), f"more than the expected {count} numbers")
        return TextWords(text, starts)

    def _stored(self, array: DataArray, how: str) -> tuple[int, memoryview, bool]:
        """Where an encoded array begins, the bytes from there on, and whether they are base64."""
        if how == "binary":
            parts = [memoryview(self.data)[slice(*span)] for span in self.document.visible(*array.body)]
            words = [part[slice(*span)] for part in parts if (span := one_word(part))]
            if len(words) < len(parts):
                words = [memoryview(word) for part in parts for word in bytes(part).split()]
            return array.body[0], words[0] if len(words) == 1 else memoryview(b"".join(words)), True
        if self.document.appended is None or array.offset is None:
            written = array.attributes.get("offset", "")[:24]
            self.fail(array, f"its format is {how[:24]!r} with the offset {written!r}, which cannot be found")
        encoding, start, stop = self.document.appended
        offset = array.offset[0]
        if start + offset > stop:
            self.fail(array, f"its offset {offset} lies behind the end of the file")
        return start + offset, memoryview(self.data)[start + offset : stop], encoding == "base64"

    def check_apart(self, place: DataArray) -> None:
        """Appended points, or normals, must share no bytes with another array, which would change along with them."""
        if place.offset is None or place.offset[1] not in self.spans:
            return
        assert self.document.appended is not None
        first, end = self.spans[place.offset[1]]
        for array in self.document.arrays:
            if array is not place and array.offset is not None and array.attributes.get("NumberOfTuples") != "0":
                start = self.document.appended[1] + array.offset[0]
                start, stop = self.spans.get(array.offset[1], (start, start + 1))
                if start < end and first < stop:
                    self.fail(
                        array, "it shares bytes with points or normals: write the file anew, each array with its own"
                    )


def one_word(text: memoryview) -> tuple[int, int] | None:
    """Where the one word of a text begins and ends; None if it has more, or none."""
    visible = np.frombuffer(text, dtype=np.uint8) > ord(" ")
    if not visible.any():
        return None
    first, end = int(np.argmax(visible)), len(text) - int(np.argmax(visible[::-1]))
    return (first, end) if np.count_nonzero(visible) == end - first else None
