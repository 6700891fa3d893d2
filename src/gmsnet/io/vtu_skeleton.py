"""The XML of a VTU file that is not in memory: its text without the letters of encoded arrays."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from gmsnet.io.rows import AT_ONCE, Ranges

MOST = 1 << 20  # bytes that are left; files with more have thousands of arrays
SHORT = 256  # bytes between two tags that are left
APPENDED = b"<AppendedData"


@dataclass
class Skeleton:
    """text: what is left. runs: place in it → first byte in the file of the one word that stood there and the byte
    behind it; None where it was several words. cut: places in it, each with how many bytes are left out there."""

    text: bytes
    runs: dict[int, tuple[int, int] | None] = field(default_factory=dict)
    cut: list[tuple[int, int]] = field(default_factory=list)

    def place(self, at: int) -> int:
        """Where a byte of the text stands in the file."""
        return at + sum(size for place, size in self.cut if place <= at)


def skeleton(file: Ranges) -> Skeleton | None:
    """None where much would be left, and where appended data follow."""
    left, found = bytearray(), Skeleton(b"")
    begin = 0  # of what stands between two tags, or of a tag
    text = _Text()
    for at in range(0, file.size, AT_ONCE):
        data = np.frombuffer(file.read(at, min(AT_ONCE, file.size - at)), dtype=np.uint8)
        start = 0
        for mark in np.flatnonzero((data == ord("<")) | (data == ord(">"))).tolist():
            closes = bool(data[mark] == ord(">"))
            end = at + mark + closes
            text.add(data[start:mark], at + start)
            start = mark + closes
            if not closes and end - begin > SHORT:
                found.runs[len(left)] = text.word
                found.cut.append((len(left), end - begin))
            else:
                left += file.read(begin, end - begin)
            begin, text = end, _Text()
            if len(left) > MOST or APPENDED in left[-SHORT:]:
                return None
        text.add(data[start:], at + start)
    left += file.read(begin, min(file.size - begin, MOST))
    found.text = bytes(left)
    return found


class _Text:
    """What is seen of a text that may have many bytes. first, end: of its visible ones; count: how many there are."""

    def __init__(self) -> None:
        self.first, self.end, self.count = -1, -1, 0

    def add(self, some: np.ndarray[tuple[int], np.dtype[np.uint8]], at: int) -> None:
        """Goes on. at: where it stands in the file."""
        visible = some > ord(" ")
        count = int(np.count_nonzero(visible))
        if count:
            self.first = self.first if self.count else at + int(np.argmax(visible))
            self.end = at + len(some) - int(np.argmax(visible[::-1]))
            self.count += count

    @property
    def word(self) -> tuple[int, int] | None:
        """Where its one word begins and ends; None where there are several, or none."""
        return (self.first, self.end) if self.count and self.count == self.end - self.first else None
