"""A file in pieces that are made one after another, so that it never is in memory as a whole."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator

# What a stream takes. A piece may live in memory that the next one takes again: use it before asking for that.
Piece = bytes | memoryview


class Pieces:
    """A file that is made each time when it is asked for: piece by piece, or by ``bytes()`` as a whole."""

    def __init__(self, make: Callable[[], Iterable[Piece]]) -> None:
        self._make = make

    def __iter__(self) -> Iterator[Piece]:
        return iter(self._make())

    def __bytes__(self) -> bytes:
        return b"".join(map(bytes, self))
