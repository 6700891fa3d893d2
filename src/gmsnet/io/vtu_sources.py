"""Encoded arrays of a VTU file that is not in memory: some of their numbers, and the array with other numbers."""

from __future__ import annotations

import base64
import itertools
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gmsnet.errors import FormatError
from gmsnet.io.ranges import Moves, put
from gmsnet.io.rows import AT_ONCE, EncodedRows, Listed, Ranges, Rows
from gmsnet.io.temporary import Temporary
from gmsnet.io.vtu_arrays import Encoding, taken
from gmsnet.io.vtu_compressors import Compressor


@dataclass(frozen=True)
class Stretch:
    """Bytes that follow each other in a file, as they are or in base64.

    begin: where they stand. size: how many. skip: of them that are no numbers, at the beginning.
    """

    begin: int
    size: int
    base64: bool
    skip: int = 0

    @property
    def end(self) -> int:
        """The byte of the file behind them."""
        return self.begin + (_letters(self.size) if self.base64 else self.size)

    def read(self, file: Ranges, first: int, last: int) -> memoryview:
        """Some of them, counted behind ``skip``. Raises FormatError where they are not in base64."""
        first, last = first + self.skip, last + self.skip
        if not self.base64:
            return memoryview(file.read(self.begin + first, last - first))
        group = first // 3
        at = self.begin + 4 * group
        size = min(3 * (-(-last // 3) - group), self.size - 3 * group)
        try:
            found, _ = taken(memoryview(file.read(at, _letters(size))), 0, size, True)
        except FormatError as error:
            raise FormatError(f"byte {at}: {error}") from None
        return found[first - 3 * group : last - 3 * group]

    def pieces(self, parts: Iterable[bytes]) -> Iterator[bytes]:
        """As the file has them, of all their bytes in parts."""
        rest = b""
        for part in parts:
            if not self.base64:
                yield part
                continue
            rest += part
            whole = len(rest) // 3 * 3
            yield base64.b64encode(rest[:whole])
            rest = rest[whole:]
        yield base64.b64encode(rest)


@dataclass(frozen=True)
class Plain:
    """An array that is not compressed. begin: of its header in the file."""

    dtype: str
    begin: int
    stretch: Stretch

    @property
    def end(self) -> int:
        """The byte of the file behind it."""
        return self.stretch.end

    @property
    def size(self) -> int:
        """Bytes of its numbers."""
        return self.stretch.size - self.stretch.skip

    def numbers(self, file: Ranges, first: int, last: int) -> NDArray[np.generic]:
        """See Source."""
        size = np.dtype(self.dtype).itemsize
        return np.frombuffer(self.stretch.read(file, first * size, last * size), dtype=self.dtype)

    def where(self, number: int) -> str:
        """See Source."""
        return _where(self.begin, number)

    def written(self, file: Ranges, moves: Moves) -> Iterator[bytes]:
        """The array of points with other numbers: as many bytes."""
        yield from file.copied(self.begin, self.stretch.begin)
        yield from self.stretch.pieces(self._parts(file, moves))

    def _parts(self, file: Ranges, moves: Moves) -> Iterator[bytes]:
        yield bytes(self.stretch.read(file, -self.stretch.skip, 0))
        row = 3 * np.dtype(self.dtype).itemsize
        rows = self.size // row
        step = AT_ONCE // row
        for first in range(0, rows, step):
            last = min(first + step, rows)
            yield _moved(self.numbers(file, 3 * first, 3 * last), moves, first)


@dataclass(frozen=True, eq=False)
class Blocks:
    """A compressed array. begin: of its header in the file. encoding, compressor: of the file. head: the first three
    numbers of the header (blocks, bytes of a block, bytes of the last one, 0 where it is a whole one). starts:
    (blocks + 1,) where each begins in the stretch."""

    dtype: str
    begin: int
    encoding: Encoding
    compressor: Compressor
    head: tuple[int, int, int]
    starts: NDArray[np.int64]
    stretch: Stretch

    @property
    def end(self) -> int:
        """The byte of the file behind it."""
        return self.stretch.end

    @property
    def size(self) -> int:
        """Bytes of its numbers."""
        count, block, last = self.head
        return count * block - (block - last if last else 0)

    def numbers(self, file: Ranges, first: int, last: int) -> NDArray[np.generic]:
        """See Source."""
        size = np.dtype(self.dtype).itemsize
        return np.frombuffer(self._bytes(file, first * size, last * size), dtype=self.dtype)

    def where(self, number: int) -> str:
        """See Source."""
        return _where(self.begin, number)

    def _bytes(self, file: Ranges, first: int, last: int) -> bytes:
        """Some of the bytes of its numbers."""
        if last <= first:
            return b""
        begin, end = first // self.head[1], -(-last // self.head[1])
        parts = self._unpacked(begin, self._packed(file, begin, end))
        return b"".join(parts)[first - begin * self.head[1] : last - begin * self.head[1]]

    def _packed(self, file: Ranges, first: int, last: int) -> list[bytes]:
        """Some blocks as they are."""
        at = self.starts[first : last + 1].tolist()
        whole = self.stretch.read(file, at[0], at[-1])
        return [bytes(whole[one - at[0] : other - at[0]]) for one, other in itertools.pairwise(at)]

    def _unpacked(self, first: int, blocks: list[bytes]) -> list[bytes]:
        """The bytes of numbers in some blocks."""
        count, size, last = self.head
        try:
            return [self.compressor.unpacked(block, number, last if last and number == count - 1 else size)
                    for number, block in enumerate(blocks, first)]  # fmt: skip
        except FormatError as error:
            raise FormatError(f"the array at byte {self.begin}: {error}") from None

    def length(self, lengths: NDArray[np.int64]) -> int:
        """Bytes in the file of the array with blocks of these lengths."""
        header, body = (3 + len(lengths)) * self.encoding.width, int(lengths.sum())
        return _letters(header) + _letters(body) if self.encoding.base64 else header + body

    def written(self, lengths: NDArray[np.int64], blocks: Iterable[bytes]) -> Iterator[bytes]:
        """The array with these blocks, in parts."""
        header = np.array([*self.head, *lengths.tolist()], dtype=self.encoding.header).tobytes()
        yield from self.stretch.pieces([header])
        yield from self.stretch.pieces(blocks)

    def changed(self, file: Ranges, moves: Moves) -> Iterator[list[bytes]]:
        """The blocks of points with other numbers, some at a time; those without a change stay."""
        count, size, _ = self.head
        row, step = 3 * np.dtype(self.dtype).itemsize, max(1, AT_ONCE // size)
        for first in range(0, count, step):
            blocks = self._packed(file, first, min(first + step, count))
            parts = self._unpacked(first, blocks)
            old = b"".join(parts)
            begin, end = first * size, first * size + len(old)
            rows = begin // row, -(-end // row)  # those that reach into other blocks are put together
            whole = self._bytes(file, rows[0] * row, begin) + old + self._bytes(file, end, rows[1] * row)
            moved = _moved(np.frombuffer(whole, dtype=self.dtype), moves, rows[0])[begin - rows[0] * row :]
            new = (moved[at : at + len(part)] for at, part in zip(range(0, len(old), size), parts, strict=True))
            yield [block if part == other else self.compressor.pack(other, block)
                   for block, part, other in zip(blocks, parts, new, strict=True)]  # fmt: skip


def _moved(numbers: NDArray[np.generic], moves: Moves, first: int) -> bytes:
    """The bytes of the points from one on, moved."""
    values = numbers.copy().reshape(-1, 3)
    put(values, moves, first, 0)
    return values.tobytes()


def _where(begin: int, number: int) -> str:
    return f"the array at byte {begin}, number {number}"


def _letters(size: int) -> int:
    """Of so many bytes in base64."""
    return (size + 2) // 3 * 4


@dataclass(frozen=True)
class VtuPoints:
    """Points in an encoded array. offsets: of arrays that stand behind them, and the bytes where they are written."""

    source: Plain | Blocks
    offsets: tuple[tuple[int, int, int], ...] = ()

    def contents(self, file: Ranges, moves: Moves, folder: str) -> Iterator[bytes]:
        """See Encoded. Compressed blocks are kept in the folder until the length of all is known."""
        if isinstance(self.source, Plain):
            yield from file.copied(0, self.source.begin)
            yield from self.source.written(file, moves)
            yield from file.copied(self.source.end, file.size)
            return
        with Temporary(folder) as temporary, open(temporary.create(), "r+b") as stream:
            lengths = list[int]()
            for blocks in self.source.changed(file, moves):
                lengths += map(len, blocks)
                stream.writelines(blocks)
            stream.seek(0)
            parts = self.source.written(np.array(lengths), iter(lambda: stream.read(AT_ONCE), b""))
            yield from self._around(file, parts, self.source.length(np.array(lengths)))

    def _around(self, file: Ranges, array: Iterable[bytes], length: int) -> Iterator[bytes]:
        """The file with another array of points."""
        longer = length - (self.source.end - self.source.begin)
        changes: list[tuple[int, int, Iterable[bytes]]] = [(self.source.begin, self.source.end, array)]
        changes += [(first, end, [b"%d" % (offset + longer)]) for offset, first, end in self.offsets if longer]
        at = 0
        for first, end, what in sorted(changes, key=lambda change: change[0]):
            yield from file.copied(at, first)
            yield from what
            at = end
        yield from file.copied(at, file.size)


def rows_at(file: Ranges, begin: int, stop: int, encoding: Encoding, dtype: str) -> tuple[Listed, int] | None:
    """The numbers of an array that begins at a byte, one in a row, and the byte behind it.

    None where its header is damaged, and where it goes beyond another byte.
    """
    found: Plain | Blocks | None
    try:
        if encoding.compressor is None:
            found = _plain(file, begin, encoding, dtype)
        else:
            found = _compressed(file, begin, stop, encoding, encoding.compressor, dtype)
    except FormatError:
        return None
    size = np.dtype(dtype).itemsize
    if found is None or found.end > stop or found.size % size:
        return None
    if isinstance(found, Plain) and not encoding.base64:
        return Rows(found.stretch.begin, found.size // size, size, dtype), found.end
    return EncodedRows(found, 0, found.size // size, 1), found.end


def _plain(file: Ranges, begin: int, encoding: Encoding, dtype: str) -> Plain:
    width = encoding.width
    letters = _letters(width) if encoding.base64 else width
    head, at = taken(memoryview(file.read(begin, letters)), 0, width, encoding.base64)
    size = int(np.frombuffer(head, dtype=encoding.header, count=1)[0])
    apart = len(head) == width
    skip = 0 if apart else width
    return Plain(dtype, begin, Stretch(begin + at if apart else begin, skip + size, encoding.base64, skip))


def _compressed(
    file: Ranges, begin: int, stop: int, encoding: Encoding, compressor: Compressor, dtype: str
) -> Blocks | None:
    width = encoding.width
    start = Stretch(begin, 3 * width, encoding.base64).read(file, 0, 3 * width)
    count, block, last = np.frombuffer(start, dtype=encoding.header, count=3).tolist()
    header = Stretch(begin, (3 + count) * width, encoding.base64)
    if not count or not block or last > block or header.end > stop:
        return None
    lengths = np.frombuffer(header.read(file, 3 * width, (3 + count) * width), dtype=encoding.header)
    starts = np.append(0, np.cumsum(lengths.astype(np.float64)))
    if starts[-1] > stop - header.end or count * block > compressor.most * starts[-1] + block:
        return None
    stretch = Stretch(header.end, int(starts[-1]), encoding.base64)
    return Blocks(dtype, begin, encoding, compressor, (count, block, last), starts.astype(np.int64), stretch)
