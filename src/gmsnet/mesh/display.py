"""How counts, figures and small tables read: in messages, at a prompt, in a notebook, on a page."""

from __future__ import annotations

import html
import math
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

NAMES = 6  # at most of them are shown of a mesh
_CONTROLS = [*range(0x20), *range(0x7F, 0xA0)]  # ESC among them, with which colours, titles and answers begin
_DIRECTIONS = [*range(0x202A, 0x202F), *range(0x2066, 0x206A)]  # that show text in another order than it is in
_SHOWN = {code: f"\\x{code:02x}" for code in _CONTROLS} | {code: f"\\u{code:04x}" for code in _DIRECTIONS}
del _SHOWN[ord("\n")]


def miss_it(count: int) -> str:
    """What so many cells do that miss a target."""
    return "misses it" if count == 1 else "miss it"


def amount(count: int, what: str) -> str:
    """A count with its noun, in the plural where it needs one."""
    return f"{count:,} {what}" if count == 1 else f"{count:,} {what}s"


def plain(value: float, digits: int = 3) -> str:
    """A figure to so many digits, never with an exponent where whole numbers or a few decimals do: 1,260, 0.0123.

    Below 1e-4 and from 1e9 on it has an exponent.
    """
    rounded = float(f"{value:.{digits}g}")
    if rounded == 0.0 or not 1e-4 <= abs(rounded) < 1e9:
        return f"{rounded:g}"
    return f"{rounded:,.0f}" if abs(rounded) >= 10 ** (digits - 1) else f"{rounded:.{digits}g}"


def listed(names: Iterable[str]) -> str:
    """The first few of some names, and how many more there are."""
    every = list(names)
    more = f" and {len(every) - NAMES:,} more" if len(every) > NAMES else ""
    return ", ".join(map(repr, every[:NAMES])) + more


def text_table(rows: Sequence[Sequence[str]]) -> str:
    """Rows of texts under each other: the first column to the left, all others to the right."""
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    sides = [str.ljust, *[str.rjust] * (len(widths) - 1)]
    return "\n".join(
        "  ".join(side(cell, width) for cell, width, side in zip(row, widths, sides, strict=True)).rstrip()
        for row in rows
    )


def html_table(caption: str, rows: Sequence[Sequence[str]], below: Sequence[str] = ()) -> str:
    """The same for a notebook, with a title, and lines below it. All texts are escaped; the first row is a header."""
    first, *others = ([html.escape(cell) for cell in row] for row in rows)
    lines = "".join(f"<tr><th>{row[0]}</th>{''.join(f'<td>{cell}</td>' for cell in row[1:])}</tr>" for row in others)
    head = "".join(f"<th>{cell}</th>" for cell in first)
    notes = "".join(f"<div>{html.escape(line)}</div>" for line in below)
    return (
        f"<table><caption>{html.escape(caption)}</caption><thead><tr>{head}</tr></thead>"
        f"<tbody>{lines}</tbody></table>{notes}"
    )


def visible(text: str) -> str:
    """The same text with its control characters, all but line ends, as Python writes them.

    Text of files and names of files can hold commands to a terminal, and marks that turn the order of what is read.
    """
    return text.translate(_SHOWN)


def strict(value: Any) -> Any:
    """A document as JSON has it: what is not a finite number is null."""
    if isinstance(value, Mapping):
        return {str(key): strict(each) for key, each in value.items()}
    if isinstance(value, (list, tuple)):
        return [strict(each) for each in value]
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value
