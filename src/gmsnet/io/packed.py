"""Files compressed with gzip: those whose name ends with ``.gz``, behind the suffix of their format.

What is inside is spliced as any other file. The frame around it is made anew, with no name and no time in it, so the
same contents give the same bytes wherever and whenever they are written.
"""

from __future__ import annotations

import os
import zlib
from collections.abc import Iterable, Iterator

from gmsnet.errors import FormatError
from gmsnet.io.contents import Data
from gmsnet.io.pieces import Piece
from gmsnet.parallel.memory import refuse_unless_free

SUFFIX = ".gz"
LEVEL = 6  # of 9, as the program gzip has it
MAGIC = b"\x1f\x8b"
_GZIP = 16 + zlib.MAX_WBITS  # zlib's sign for the frame of gzip, with its checksum
_AT_ONCE = 1 << 20  # bytes that are unpacked together


def split_name(path: str) -> tuple[str, str, str]:
    """A path as stem, suffix of the format and ``.gz`` (as it is written, or nothing)."""
    stem, last = os.path.splitext(path)
    if last.lower() != SUFFIX:
        return stem, last, ""
    return *os.path.splitext(stem), last


def is_packed(path: str) -> bool:
    """Whether a file is compressed, as its name says."""
    return path.lower().endswith(SUFFIX)


def unpacked(data: Data, shown: str) -> bytes:
    """What a compressed file holds; several members that follow each other count as one file.

    Raises FormatError where it is not compressed, damaged or cut off, and InputError before it takes all the memory
    there is. ``shown`` names the file in the latter.
    """
    parts: list[bytes] = []
    size, at, view = 0, 0, memoryview(data)
    while at < len(data):
        if at and not bytes(view[at:]).strip(b"\0"):  # a device that writes whole blocks fills the last one
            break
        if bytes(view[at : at + len(MAGIC)]) != MAGIC:
            raise FormatError(f"byte {at}: no gzip data begin here: leave out .gz in the name, or repair the file")
        member, used = zlib.decompressobj(_GZIP), at
        try:
            while not member.eof and (rest := member.unconsumed_tail or view[used : used + _AT_ONCE]):
                if not member.unconsumed_tail:
                    used += len(rest)
                parts.append(member.decompress(rest, _AT_ONCE))
                size += len(parts[-1])
                refuse_unless_free(size, f"{shown}: its {size:,} bytes so far, unpacked,")  # copied once more below
            parts.append(b"" if member.eof else member.flush())
        except zlib.error:
            raise FormatError(f"the compressed data that begin at byte {at} are damaged: unpack it to see") from None
        if not member.eof:
            raise FormatError("the compressed data end too early: the file is cut off")
        at = used - len(member.unused_data)
    return b"".join(parts)


def packed(pieces: Iterable[Piece]) -> Iterator[bytes]:
    """The compressed form of a file, piece by piece."""
    stream = zlib.compressobj(LEVEL, zlib.DEFLATED, _GZIP)  # zlib writes neither a name nor a time
    for piece in pieces:
        if part := stream.compress(piece):
            yield part
    yield stream.flush()
