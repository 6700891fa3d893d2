"""Text of files and names of files as a terminal may show it: it can hold commands to the terminal."""

from __future__ import annotations

_CONTROLS = [*range(0x20), *range(0x7F, 0xA0)]  # ESC among them, with which colours, titles and answers begin
_DIRECTIONS = [*range(0x202A, 0x202F), *range(0x2066, 0x206A)]  # that show text in another order than it is in
_SHOWN = {code: f"\\x{code:02x}" for code in _CONTROLS} | {code: f"\\u{code:04x}" for code in _DIRECTIONS}
del _SHOWN[ord("\n")]


def visible(text: str) -> str:
    """The same text with its control characters, all but line ends, as Python writes them."""
    return text.translate(_SHOWN)
