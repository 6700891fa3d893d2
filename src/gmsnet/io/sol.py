"""Medit's files of values at vertices, ``.sol`` and their binary twin ``.solb``: one field of numbers or tensors.

Source: L. Maréchal, "Handling unstructured meshes in LM7/8 (libMeshb)", INRIA.
"""

from __future__ import annotations

import os
import struct
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gmsnet.errors import FormatError, InputError
from gmsnet.io.atomic import reason
from gmsnet.io.contents import Data, load
from gmsnet.io.text import Text

Floats = NDArray[np.float64]

SCALAR, VECTOR, TENSOR = 1, 2, 3
NAMES = {SCALAR: "a number", VECTOR: "a vector", TENSOR: "a symmetric tensor"}
DIMENSION, AT_VERTICES, END = 3, 62, 54  # of binary files
BIG, LITTLE = b"\x00\x00\x00\x01", b"\x01\x00\x00\x00"


class Values(NamedTuple):
    """What stands in a file. kind: of each value; values: (N, k), a tensor in two dimensions as m11, m12, m22."""

    kind: int
    values: Floats


def read_metric(path: str | os.PathLike[str]) -> Floats:
    """(N, 3) of a file with a symmetric tensor m11, m12, m22 in two dimensions at each vertex.

    Raises InputError where the file cannot be opened; FormatError where it is damaged or holds something else.
    """
    return _read(path, TENSOR, "a metric is a symmetric tensor of 3 numbers (type 3 in two dimensions)")


def read_sizes(path: str | os.PathLike[str]) -> Floats:
    """(N,) of a file with one number at each vertex. Raises as ``read_metric``."""
    return _read(path, SCALAR, "a size is one number (type 1)")[:, 0]


def _read(path: str | os.PathLike[str], kind: int, wanted: str) -> Floats:
    name = os.fsdecode(path)
    try:
        data, _ = load(name)
    except FileNotFoundError:
        raise InputError(f"{name}: there is no such file") from None
    except OSError as error:
        raise InputError(f"{name}: cannot be read: {reason(error)}") from None
    try:
        found = _binary(data) if data[:4] in (BIG, LITTLE) else _text(data)
        if found.kind != kind:
            raise FormatError(f"at each vertex it holds {NAMES[found.kind]}, but {wanted}")
    except InputError as error:
        raise FormatError(f"{name}: {error}") from None
    return found.values


def _text(data: Data) -> Values:
    text, at, dimension = Text(data, b"#"), 0, 0
    while (found := text.next(at)) is not None:
        start, at = found
        key = text.token(start)
        if key == b"End":
            break
        if key in (b"MeshVersionFormatted", b"Dimension"):
            one, at = text.tokens(at, 1)
            number = text.count(one[0], "the version" if key[:1] == b"M" else "dimensions")
            dimension = number if key == b"Dimension" else dimension
        elif key == b"SolAtVertices":
            head, at = text.tokens(at, 2)
            count, fields = text.count(head[0], "vertices"), text.count(head[1], "fields")
            kinds, at = text.tokens(at, fields)
            kind = _kind([text.count(each, "a type") for each in kinds], dimension)
            width = _width(kind)
            rows, _ = text.tokens(at, count * width)
            return Values(kind, text.floats(rows).reshape(count, width))
        else:
            text.fail(start, f"unknown keyword {text.word(start)}")
    raise FormatError("SolAtVertices is missing: the file is cut off or holds no values at vertices")


def _binary(data: Data) -> Values:
    order = "<" if data[:4] == LITTLE else ">"
    at, dimension = 8, 0
    version = _unpacked(data, order + "i", 4)
    if version not in (1, 2, 3, 4):
        raise FormatError(f"version {version}: known are 1 to 4")
    place, number = ("i" if version < 3 else "q"), ("i" if version < 4 else "q")
    while True:
        key, following = _unpacked(data, order + "i", at), _unpacked(data, order + place, at + 4)
        start = at + 4 + struct.calcsize(place)
        if key == DIMENSION:
            dimension = _unpacked(data, order + "i", start)
        elif key == AT_VERTICES:
            count, start = _unpacked(data, order + number, start), start + struct.calcsize(number)
            fields, start = _unpacked(data, order + "i", start), start + 4
            if not 0 < fields <= 20:
                raise FormatError(f"byte {start}: {fields} fields: one is expected")
            kind = _kind([_unpacked(data, order + "i", start + 4 * k) for k in range(fields)], dimension)
            width, real = _width(kind), np.dtype(order + ("f4" if version == 1 else "f8"))
            start += 4 * fields
            if not 0 <= count * width * real.itemsize <= len(data) - start:
                raise FormatError(f"byte {start}: the file ends before its {count:,} values: it is cut off")
            found = np.frombuffer(data, dtype=real, count=count * width, offset=start).astype(np.float64)
            return Values(kind, found.reshape(count, width))
        if key == END or following <= at:
            raise FormatError("SolAtVertices is missing: the file is cut off or holds no values at vertices")
        at = following


def _unpacked(data: Data, form: str, at: int) -> int:
    if at + struct.calcsize(form) > len(data):
        raise FormatError(f"byte {at}: the file is cut off")
    value: int = struct.unpack_from(form, data, at)[0]
    return value


def _kind(kinds: list[int], dimension: int) -> int:
    """The type of the one field. Raises FormatError where there are others, or not in two dimensions."""
    if len(kinds) != 1 or kinds[0] not in NAMES:
        raise FormatError(
            f"the types of its fields are {kinds}: one field of type 1 (number) or 3 (tensor) is expected"
        )
    if kinds[0] != SCALAR and dimension != 2:
        raise FormatError(
            f"Dimension {dimension}: vectors and tensors are read in two dimensions alone; write Dimension 2 and the "
            "three numbers m11, m12, m22 of each tensor"
        )
    return kinds[0]


def _width(kind: int) -> int:
    return {SCALAR: 1, VECTOR: 2, TENSOR: 3}[kind]
