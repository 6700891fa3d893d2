"""Patches of an OpenFOAM mesh, and what its zones name."""

from __future__ import annotations

import re
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gmsnet.errors import FormatError
from gmsnet.io.contents import Data
from gmsnet.io.foam_lists import REMARK, head_of, labels, list_at, lists_of

Ints = NDArray[np.int64]
_WORD = re.compile(rb"\"[^\"]*\"|[{};]|[^\s{};\"]+")
LABELS = re.compile(rb"(?:cell|face|point)Labels\s+List<label>\s*")
NAMED = re.compile(rb"([^\s{};\"()]+)\s*\{\s*type\s+(cellZone|faceZone|pointZone)\s*;")
MOST = 100_000  # patches, and zones
ZONES = ("cellZones", "faceZones", "pointZones")


class Patch(NamedTuple):
    """A patch: its name and type, and its faces: so many from ``start`` on."""

    name: str
    kind: str
    start: int
    faces: int

    @property
    def members(self) -> Ints:
        """(faces,) its faces."""
        return np.arange(self.start, self.start + self.faces)

    @property
    def is_periodic(self) -> bool:
        """Whether it has an image that its points must match."""
        return "cyclic" in self.kind.lower()


def patches(data: Data, faces: int, internal: int) -> list[Patch]:
    """The patches. Raises FormatError where they are not all faces behind the internal ones, one after another."""
    head = head_of(data, "boundary")
    count, uniform, begin = list_at(data, head.body, "boundary")
    words = [word.decode("utf-8", "backslashreplace") for word in
             _WORD.findall(REMARK.sub(b" ", bytes(data[begin:])))]  # fmt: skip
    found, at = list[Patch](), 0
    while at + 1 < len(words) and words[at] != ")" and len(found) < min(count, MOST):
        name, entries, depth, key = words[at].strip('"'), dict[str, str](), 0, ""
        while at + 1 < len(words):
            at += 1
            word = words[at]
            depth += (word == "{") - (word == "}")
            if depth == 0:
                break
            if depth == 1 and word not in "{};":
                key, entries = (word, entries) if not key else (key, {**entries, key: entries.get(key, word)})
            elif word == ";":
                key = ""
        at += 1
        found.append(
            Patch(name, entries.get("type", ""), *(_number(entries, name, key) for key in ("startFace", "nFaces")))
        )
    following = internal
    for patch in found:
        if patch.start != following:
            raise FormatError(f"boundary: the patch {patch.name[:24]!r} begins at face {patch.start}, not {following}")
        following += patch.faces
    closed = at < len(words) and words[at].startswith(")")
    if uniform or not closed or len(found) != count or following != faces:
        told = f"{len(found)} of {count} patches have {following - internal} of {faces - internal} faces"
        raise FormatError(f"boundary: {told}: is the file cut off?")
    return found


def _number(entries: dict[str, str], name: str, key: str) -> int:
    text = entries.get(key, "")
    if not re.fullmatch(r"\d{1,18}", text):
        raise FormatError(f"boundary: the patch {name[:24]!r} has no {key}: is the file cut off?")
    return int(text)


def zones(data: Data, name: str, most: int) -> list[tuple[str, Ints]]:
    """The name and the numbers of each zone. Raises FormatError for one that is not below ``most``."""
    head, found = head_of(data, name), list[tuple[str, Ints]]()
    data = lists_of(data, head)
    for named in NAMED.finditer(data, head.body):
        where = LABELS.search(data, named.end())
        numbers = np.empty(0, dtype=np.int64)
        if where:
            numbers, _ = labels(data, head, where.end(), name)
        if len(numbers) and not 0 <= numbers.min() <= numbers.max() < most:
            raise FormatError(f"{name}: a zone names {numbers.max()}, but there are {most} of these")
        found.append((named[1].decode("utf-8", "backslashreplace"), numbers))
        if len(found) > MOST:
            raise FormatError(f"{name}: there are more than {MOST} zones")
    return found
