"""Encoded arrays of VTU files: base64 or raw, compressed or not, read and written again with other numbers.

An array that is not compressed has its number of bytes in front. A compressed one has a header, (blocks, bytes of a
block, bytes of the last block if it is shorter, compressed bytes of each block), and then its blocks. In base64
the header of a compressed array is encoded on its own; that of another one together with the numbers or on its own.
"""

from __future__ import annotations

import base64
import binascii
from dataclasses import dataclass

import numpy as np

from gmsnet.errors import FormatError
from gmsnet.io.vtu_compressors import Compressor


@dataclass(frozen=True)
class Encoding:
    """How a file encodes its arrays. header: the type of the numbers in headers, with the byte order. compressor: None
    where they are not compressed."""

    header: str
    compressor: Compressor | None
    base64: bool

    @property
    def width(self) -> int:
        """Bytes of a number in a header."""
        return np.dtype(self.header).itemsize


@dataclass(frozen=True)
class Encoded:
    """How an array stands in the file.

    length: the bytes that it takes there. apart: whether the header was encoded in base64 on its own. blocks: of a
    compressed array, the compressed bytes of each block. head: the first three numbers of its header (blocks, bytes of
    a block, bytes of the last one).
    """

    encoding: Encoding
    length: int
    apart: bool
    blocks: tuple[bytes, ...] = ()
    head: tuple[int, int, int] = (0, 0, 0)

    def written(self, old: bytes | memoryview, new: bytes) -> bytes:
        """The array with other numbers (as many bytes) in the same encoding; blocks without a change stay."""
        kind = self.encoding.header
        compressor = self.encoding.compressor
        if compressor is None:
            return self._text(np.array([len(new)], dtype=kind).tobytes(), new)
        size = self.head[1]
        blocks = []
        for k, block in enumerate(self.blocks):
            part = new[k * size : (k + 1) * size]
            same = part == old[k * size : (k + 1) * size]
            blocks.append(block if same else compressor.pack(part, block))
        return self._text(np.array([*self.head, *map(len, blocks)], dtype=kind).tobytes(), b"".join(blocks))

    def _text(self, header: bytes, body: bytes) -> bytes:
        if not self.encoding.base64:
            return header + body
        if self.apart:
            return base64.b64encode(header) + base64.b64encode(body)
        return base64.b64encode(header + body)


def decode(data: memoryview, encoding: Encoding, expected: int) -> tuple[Encoded, memoryview]:
    """The array at the beginning of ``data``, and the bytes of its numbers, which must be ``expected``.

    Raises FormatError where it ends early, has another size or cannot be unpacked; no more memory is taken than the
    length of the data allows.
    """
    if encoding.compressor is None:
        return _plain(data, encoding, expected)
    return _compressed(data, encoding, encoding.compressor, expected)


def _plain(data: memoryview, encoding: Encoding, expected: int) -> tuple[Encoded, memoryview]:
    width = encoding.width
    head, at = taken(data, 0, width, encoding.base64)
    size = int(np.frombuffer(head, dtype=encoding.header, count=1)[0])
    if size != expected:
        raise FormatError(f"it has {size} bytes instead of {expected}")
    apart = len(head) == width  # else the first group of characters holds bytes of the numbers too
    start, skip = (at, 0) if apart else (0, width)
    both, end = taken(data, start, skip + size, encoding.base64)
    return Encoded(encoding, end, apart), both[skip : skip + size]


def _compressed(
    data: memoryview, encoding: Encoding, compressor: Compressor, expected: int
) -> tuple[Encoded, memoryview]:
    width = encoding.width
    start, _ = taken(data, 0, 3 * width, encoding.base64)
    count, block_size, last = np.frombuffer(start, dtype=encoding.header, count=3).tolist()
    total = count * block_size - (block_size - last if last else 0)
    if total != expected or last > block_size:
        raise FormatError(f"it has {total} bytes instead of {expected}")
    head, at = taken(data, 0, (3 + count) * width, encoding.base64)
    lengths = np.frombuffer(head, dtype=encoding.header, count=3 + count)[3:].tolist()
    stored = sum(lengths)
    if stored > len(data) or expected > compressor.most * stored:
        raise FormatError(f"{expected} bytes cannot come from {stored} compressed bytes")
    body, end = taken(data, at, stored, encoding.base64)
    payload, filled, blocks, at = np.empty(expected, dtype=np.uint8).data, 0, [], 0
    for k, length in enumerate(lengths):
        block = bytes(body[at : at + length])
        at += length
        size = last if last and k == count - 1 else block_size
        part = compressor.unpacked(block, k, size)
        payload[filled : filled + size] = part
        filled += size
        blocks.append(block)
    return Encoded(encoding, end, True, tuple(blocks), (count, block_size, last)), payload


def taken(data: memoryview, at: int, size: int, in_base64: bool) -> tuple[memoryview, int]:
    """At least ``size`` bytes that begin at byte ``at`` of the file (in base64 up to two more), and where they end."""
    length = (size + 2) // 3 * 4 if in_base64 else size
    found = data[at : at + length]
    if len(found) < length:
        raise FormatError(f"it ends after {len(found)} of {length} bytes: the file is cut off")
    if in_base64:
        try:
            found = memoryview(base64.b64decode(found, validate=True))
        except binascii.Error as error:
            raise FormatError(f"it is not in base64: {error}") from None
        if len(found) < size:
            raise FormatError("it is not in base64: there is padding inside")
    return found, at + length
