"""HTML of texts that may hold anything."""

from __future__ import annotations

import html
import json
from collections.abc import Mapping, Sequence
from typing import Any

from gmsnet.mesh.display import strict, visible


def text(value: str) -> str:
    """A text as part of a page, in an element or an attribute in quotes: with no markup and no control characters."""
    return html.escape(visible(value))


def json_block(name: str, value: Any) -> str:
    """Plain values as a block of data: nothing of it is markup, whatever the texts hold."""
    made = json.dumps(strict(value), allow_nan=False, separators=(",", ":"))
    for sign in "<>&":
        made = made.replace(sign, f"\\u{ord(sign):04x}")
    return f'<script type="application/json" id="{name}">{made}</script>'


def section(name: str, title: str, body: str) -> str:
    """A part of the page with its heading; nothing where it would be empty."""
    if not body:
        return ""
    return (
        f'<section id="{name}" aria-labelledby="{name}-title"><h2 id="{name}-title">{text(title)}</h2>{body}</section>'
    )


def listed(entries: Sequence[str]) -> str:
    """A list of texts."""
    return f"<ul>{''.join(f'<li>{text(entry)}</li>' for entry in entries)}</ul>" if entries else ""


def grid(caption: str, rows: Sequence[Sequence[str]]) -> str:
    """A table of texts; the first row is its head, the first column names the rows."""
    return table(caption, rows[0], "".join(row(f'<th scope="row">{text(each[0])}</th>', each[1:]) for each in rows[1:]))


def table(caption: str, head: Sequence[str], body: str) -> str:
    """A table whose rows are made already."""
    heads = "".join(f'<th scope="col">{text(each)}</th>' for each in head)
    return (
        f'<div class="wide"><table><caption>{text(caption)}</caption><thead><tr>{heads}</tr></thead>'
        f"<tbody>{body}</tbody></table></div>"
    )


def row(first: str, texts: Sequence[str], attributes: Mapping[str, str] | None = None) -> str:
    """A row: its first cell, which is made already, and texts."""
    given = "".join(f' {name}="{text(value)}"' for name, value in (attributes or {}).items())
    return f"<tr{given}>{first}{''.join(f'<td>{text(each)}</td>' for each in texts)}</tr>"
