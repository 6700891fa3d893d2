"""Arrays as part of a page: bytes of equal weight side by side, deflated, in base64. ``data.js`` reads them."""

from __future__ import annotations

import base64
import zlib
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

LEVEL = 6  # of zlib: higher ones take twice the time for a hundredth of the bytes
KINDS = {"u1", "u2", "u4", "i2", "f4"}


def packed(arrays: Mapping[str, NDArray[Any]]) -> tuple[dict[str, dict[str, Any]], Iterator[str]]:
    """How to read arrays, by name, and the elements that hold them, made one by one.

    Whole numbers of four bytes are kept as differences from their neighbours.
    """
    known = {name: {"type": _kind(array), "count": array.size} for name, array in arrays.items()}
    return known, (_element(name, array) for name, array in arrays.items())


def _kind(array: NDArray[Any]) -> str:
    kind = array.dtype.str[1:]
    assert kind in KINDS, kind
    return kind


def _element(name: str, array: NDArray[Any]) -> str:
    flat = array.ravel()
    if flat.dtype == np.uint32:
        flat = _differences(flat)
    planes = flat.astype(flat.dtype.newbyteorder("<"), copy=False).view(np.uint8).reshape(len(flat), flat.itemsize).T
    data = base64.b64encode(zlib.compress(planes.tobytes(), LEVEL)).decode()
    return f'<script type="text/plain" id="array-{name}">{data}</script>\n'


def _differences(values: NDArray[np.uint32]) -> NDArray[np.uint32]:
    """Each less the one before it, modulo 2³², the small ones of both signs as small numbers: 0, −1, 1, −2, …"""
    steps = np.diff(values, prepend=np.uint32(0)).view(np.int32)
    folded: NDArray[np.uint32] = ((steps << 1) ^ (steps >> 31)).view(np.uint32)
    return folded
