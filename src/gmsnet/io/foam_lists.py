"""Lists in OpenFOAM's files, in text or binary: numbers of points, of faces and cells, and coordinates."""

from __future__ import annotations

import re
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gmsnet.errors import FormatError
from gmsnet.io.contents import Data
from gmsnet.io.places import Lattice, Places
from gmsnet.io.splice import BinarySlots, Slots, TextSlots
from gmsnet.io.text import Starts, Text, fail

Ints = NDArray[np.int64]
_HEADER = re.compile(rb"FoamFile\s*\{([^{}]*)\}")
_ENTRY = re.compile(rb"(\w+)\s+(\"[^\"]*\"|[^;]*);")
REMARK = re.compile(rb"//[^\r\n]*|/\*.*?\*/", re.DOTALL)
_REMARKS = re.compile(rb"(?:\s+|" + REMARK.pattern + rb")*", re.DOTALL)
_LIST = re.compile(rb"(\d{1,18})\s*([({])")
_END = re.compile(rb"\s*\)")
_SIZES = {b"32": 4, b"64": 8}


class Head(NamedTuple):
    """What the header of a file says. body: the byte behind it; label, scalar: bytes of a number; order: of them."""

    kind: str
    binary: bool
    label: int
    scalar: int
    order: str
    body: int


def head_of(data: Data, name: str) -> Head:
    """The header of a file. Raises FormatError where there is none, or one that says what is not known."""
    found = _HEADER.search(data, 0, 1 << 16)
    if not found:
        raise FormatError(f"{name}: 'FoamFile {{…}}' is missing: the file is cut off, or no file of OpenFOAM")
    entries = {key: value.strip().strip(b'"') for key, value in _ENTRY.findall(found[1])}
    arch = dict(part.partition(b"=")[::2] for part in entries.get(b"arch", b"LSB;label=32;scalar=64").split(b";"))
    label, scalar = _SIZES.get(arch.get(b"label", b"32")), _SIZES.get(arch.get(b"scalar", b"64"))
    form = entries.get(b"format", b"ascii")
    if label is None or scalar is None or form not in (b"ascii", b"binary"):
        raise FormatError(f"{name}: the header says {bytes(found[1][:60])!r}: only ascii and binary with numbers of 32 "
                          "and 64 bits are read")  # fmt: skip
    order = ">" if b"MSB" in arch else "<"
    kind = entries.get(b"class", b"").decode("ascii", "backslashreplace")
    return Head(kind, form == b"binary", label, scalar, order, found.end())


def list_at(data: Data, at: int, name: str) -> tuple[int, bool, int]:
    """How many entries the list behind a byte has, whether they are all one, and the byte behind its bracket."""
    at = _REMARKS.match(data, at).end()  # type: ignore[union-attr]
    found = _LIST.match(data, at)
    if not found:
        fail(data, at, f"{name}: a list such as 3(…) was expected: is the file cut off?")
    return int(found[1]), found[2] == b"{", found.end()


def lists_of(data: Data, head: Head) -> Data:
    """The file with blanks for the comments that stand in its lists; itself if it is binary, or has none there."""
    first = -1 if head.binary else data.find(b"/", head.body)
    if first < 0:
        return data
    rest = REMARK.sub(lambda found: b" " * len(found[0]), data[first:])
    return bytes(data[:first]) + rest if rest.strip() else data  # most files end with a comment


def _raw(data: Data, begin: int, count: int, size: int, name: str) -> int:
    """The end of so many binary numbers. Raises FormatError where the file, or the list, ends before."""
    end = begin + count * size
    if end >= len(data) or data[end : end + 1] != b")":
        told = f"{count} numbers of {size} bytes and a bracket were expected"
        fail(data, min(begin, len(data)), f"{name}: {told}: is the file cut off?")
    return end


def _tokens(data: Data, begin: int, count: int, name: str) -> tuple[Starts, int]:
    """So many tokens of a text, behind which the list must be closed, and the byte behind its bracket."""
    starts, end = Text(data, ends=b"()").tokens(begin, count)
    close = _END.match(data, end if count else begin)
    if not close:
        told = f") was expected behind the {count} numbers of the list"
        fail(data, min(end, len(data) - 1), f"{name}: {told}: is the file cut off?")
    return starts, close.end()


def labels(data: Data, head: Head, at: int, name: str) -> tuple[Ints, int]:
    """A list of whole numbers behind a byte, and the byte behind it. data: as ``lists_of`` gives it."""
    count, uniform, begin = list_at(data, at, name)
    if uniform:
        text = Text(data, ends=b"{}")
        starts, end = text.tokens(begin, 1)
        if count > MOST_ALIKE + len(data):
            fail(data, begin, f"{name}: {count} entries are more than the other lists have")
        return np.full(count, text.integers(starts)[0]), data.find(b"}", end) + 1 or len(data)
    if head.binary:
        end = _raw(data, begin, count, head.label, name)
        found = np.frombuffer(data, f"{head.order}i{head.label}", count, begin)
        return found.astype(np.int64), end + 1
    starts, end = _tokens(data, begin, count, name)
    return Text(data, ends=b"()").integers(starts), end


MOST_ALIKE = 1000  # entries that a list of one value has in a file of no length


def coordinates(data: Data, head: Head, name: str) -> tuple[NDArray[np.float64], Slots, bool]:
    """The points (n × 3), where they stand, and whether they are in single precision."""
    data = lists_of(data, head)
    count, uniform, begin = list_at(data, head.body, name)
    if uniform:
        fail(data, begin, f"{name}: all points are the same")
    if head.binary:
        _raw(data, begin, 3 * count, head.scalar, name)
        dtype = f"{head.order}f{head.scalar}"
        points = np.frombuffer(data, dtype, 3 * count, begin).astype(np.float64).reshape(-1, 3)
        if not np.isfinite(points).all():
            raise FormatError(f"{name}: the coordinates of point {int(np.argmin(np.isfinite(points).all(axis=1)))} are "
                              "not finite")  # fmt: skip
        size = head.scalar
        return points, BinarySlots(Places(Lattice(begin, count, 3 * size, range(0, 3 * size, size))), dtype), size == 4
    starts, _ = _tokens(data, begin, 3 * count, name)
    points, ends = Text(data, ends=b"()").spans(starts.reshape(-1, 3))
    tail = re.compile(rb"\s*\)\s*\)")
    if count and not tail.match(data, int(ends[-1, -1])):
        fail(data, int(ends[-1, -1]) - 1, f"{name}: )) was expected behind the last point: is the file cut off?")
    return points, TextSlots(starts.reshape(-1, 3), ends), False


def faces(data: Data, head: Head, name: str) -> tuple[Ints, Ints]:
    """How many points each face has, and those of all faces one after another."""
    data = lists_of(data, head)
    if head.kind == "faceCompactList":
        offsets, end = labels(data, head, head.body, name)
        points, _ = labels(data, head, end, name)
        if len(offsets) == 0 or offsets[0] != 0 or offsets[-1] != len(points) or (np.diff(offsets) < 0).any():
            raise FormatError(f"{name}: the offsets of the faces do not fit the list of their points")
        return np.diff(offsets), points
    if head.binary:
        raise FormatError(f"{name}: binary faces are read as a faceCompactList, found {head.kind[:24]!r}")
    count, uniform, begin = list_at(data, head.body, name)
    if uniform:
        fail(data, begin, f"{name}: all faces are the same")
    text = Text(data, ends=b"()")
    close = _closing(data, begin, name)
    starts, _ = text.until(close).tokens(begin)
    raw = text.raw[begin:close]
    first = np.searchsorted(starts, begin + np.flatnonzero(raw == ord("(")))  # the first point of each face
    if len(first) != count or not count:
        fail(data, begin, f"{name}: the list announces {count} faces, but has {len(first)}")
    values = text.integers(starts)
    sizes = values[first - 1]
    if first[0] != 1 or (first[1:] != (first + sizes)[:-1] + 1).any() or first[-1] + sizes[-1] != len(values):
        bad = np.flatnonzero((first + sizes + 1) != np.append(first[1:], len(values) + 1))
        where = int(starts[max(first[bad[0]] - 1, 0)]) if len(bad) else begin
        fail(data, where, f"{name}: a face does not have as many points as it says")
    return sizes, np.delete(values, first - 1)


def _closing(data: Data, begin: int, name: str) -> int:
    """The bracket that closes a list of faces: the last of the file, comments aside."""
    end = data.rfind(b")", begin)
    while end >= 0 and b"//" in bytes(data[data.rfind(b"\n", 0, end) + 1 : end]):
        end = data.rfind(b")", begin, end)
    if end < 0 or (not re.compile(rb"[\s)]").match(data, end - 1) and data[end - 1 : end] != b"("):
        fail(data, begin, f"{name}: ) was expected at the end of the list: is the file cut off?")
    return end
