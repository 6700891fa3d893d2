"""Markers of SU2 meshes, and those of them whose nodes SU2 copies: periodic boundaries, parts of a partitioned mesh.

A marker ``SEND_RECEIVE`` lists its nodes as vertices behind its ``SEND_TO``: they are copied to another part of the
mesh (``SEND_TO= 2``) or from there (``-2``), in periodic meshes to and from their own images. Its rows end with the
number of a transformation, which three rows behind a ``PERIODIC_INDEX`` define, and perhaps that of a zone.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from gmsnet.io.text import Rows, Starts, Text

COPIED = "SEND_RECEIVE"


@dataclass
class Marker:
    """A marker: how many elements it announces, and their rows; None before these are known.

    sent: where nodes are copied to (above zero) or from, if they are.
    """

    tag: str
    count: int | None = None
    rows: Rows | None = None
    sent: int | None = None


def send(text: Text, at: int, value: Starts, rows: Rows, markers: Sequence[Marker]) -> None:
    """The keyword SEND_TO at a byte, with its value and the rows behind it: it belongs to the last of the markers.

    Raises FormatError where it does not, or other rows than announced follow.
    """
    marker = markers[-1] if markers else None
    if marker is None or marker.tag != COPIED or marker.count is None or marker.sent is not None:
        text.fail(at, f"SEND_TO without MARKER_TAG= {COPIED} and MARKER_ELEMS before it")
    if len(value) != 1:
        text.fail(at, f"one number was expected after SEND_TO=, found {len(value)} words")
    (marker.sent,) = text.integers(value).tolist()
    if len(rows) != marker.count or (marker.rows is not None and marker.count):
        told = f"MARKER_ELEMS= {marker.count} and SEND_TO are followed by {len(rows)} rows"
        text.fail(at, f"{told} instead of {marker.count}: is the file cut off?")
    marker.rows = rows


def check_transformation(text: Text, at: int, rows: Rows) -> None:
    """Raises FormatError unless centre, angles and translation follow PERIODIC_INDEX, three numbers each."""
    if len(rows) != 3 or (rows.lengths != 3).any():
        text.fail(at, "PERIODIC_INDEX must be followed by 3 rows of 3 numbers: is the file cut off?")
    text.floats(rows.starts)
