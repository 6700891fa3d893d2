"""The compressors of VTU files: zlib, LZMA, and LZ4, which needs the library of that name. The one place of it."""

from __future__ import annotations

import zlib
from collections.abc import Callable
from typing import Any, NamedTuple

from gmsnet.errors import FormatError, MissingExtraError

NEEDED = "pip install 'gmsnet[lz4]'"
_LEVELS = (1, 5, 6, 9)  # of zlib, by the two bits in which it notes how hard it tried
_PRESET, _MEMORY = 5, 1 << 27  # of LZMA: as VTK and ParaView write it; bytes that may be taken to unpack a block


class Compressor(NamedTuple):
    """unpack: from a block to its bytes, of which there are so many; it may return one more, or fewer. pack: from other
    bytes to a block in the place of one. most: times its length, more than a block can hold.
    """

    unpack: Callable[[bytes, int], bytes]
    pack: Callable[[bytes, bytes], bytes]
    most: int

    def unpacked(self, block: bytes, number: int, size: int) -> bytes:
        """The bytes of a block, which must be so many. Raises FormatError, naming its number, where it is damaged."""
        try:
            found = self.unpack(block, size)
        except _Damage as damage:
            raise FormatError(f"block {number} cannot be decompressed: {damage}") from None
        if len(found) != size:
            raise FormatError(f"block {number} does not decompress to the {size} bytes that its header announces")
        return found


class _Damage(Exception):
    """What a library says of a block."""


def _inflated(block: bytes, size: int) -> bytes:
    unpacker = zlib.decompressobj()
    try:
        found = unpacker.decompress(block, size + 1)
    except zlib.error as error:
        raise _Damage(error) from None
    return found if unpacker.eof and not unpacker.unused_data else b""


def _deflated(part: bytes, block: bytes) -> bytes:
    return zlib.compress(part, _LEVELS[block[1] >> 6])


def _from_xz(block: bytes, size: int) -> bytes:
    import lzma  # some builds of Python lack it

    unpacker = lzma.LZMADecompressor(lzma.FORMAT_XZ, _MEMORY)
    try:
        found = unpacker.decompress(block, size + 1)
    except (lzma.LZMAError, MemoryError) as error:
        raise _Damage(error) from None
    return found if unpacker.eof and not unpacker.unused_data else b""


def _to_xz(part: bytes, block: bytes) -> bytes:
    import lzma

    return lzma.compress(part, lzma.FORMAT_XZ, lzma.CHECK_CRC32, _PRESET)


def _from_lz4(block: bytes, size: int) -> bytes:
    library = _lz4()
    try:
        found: bytes = library.decompress(block, uncompressed_size=size)
    except (library.LZ4BlockError, ValueError) as error:
        raise _Damage(error) from None
    return found


def _to_lz4(part: bytes, block: bytes) -> bytes:
    packed: bytes = _lz4().compress(part, store_size=False)
    return packed


def _lz4() -> Any:
    try:
        import lz4.block
    except ModuleNotFoundError as error:
        if error.name not in ("lz4", "lz4.block"):
            raise  # it is there, but something that it needs is not
        raise MissingExtraError(f"VTU files with LZ4 need lz4, which is not installed: {NEEDED}") from error
    return lz4.block


LZ4 = "vtkLZ4DataCompressor"
COMPRESSORS = {
    "vtkZLibDataCompressor": Compressor(_inflated, _deflated, 1100),  # 1032 at most
    "vtkLZMADataCompressor": Compressor(_from_xz, _to_xz, 10_000),  # about 7,000
    LZ4: Compressor(_from_lz4, _to_lz4, 256),  # 255
}


def compressor_of(name: str) -> Compressor | None:
    """The compressor that the root of a file names, None for "". Raises FormatError for others, and MissingExtraError
    for one whose library is not installed.
    """
    if not name:
        return None
    if name not in COMPRESSORS:
        known = ", ".join(COMPRESSORS)
        raise FormatError(f"the compressor {name[:40]!r} is not supported: write the file with one of {known}, or none")
    if name == LZ4:  # before ranks share the file
        _lz4()
    return COMPRESSORS[name]
