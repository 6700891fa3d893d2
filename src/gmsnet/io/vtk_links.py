"""The files that VTK's ``.pvtu``, ``.pvtp`` and ``.vtm`` name: pieces and blocks, and other names in their place."""

from __future__ import annotations

import os
import re
from collections.abc import Iterator, Mapping
from typing import NamedTuple
from xml.sax.saxutils import escape

from gmsnet.errors import FormatError
from gmsnet.io.contents import Data
from gmsnet.io.packed import split_name
from gmsnet.io.xml_tree import Element, blame, parse, span_of

NAMED = {"PUnstructuredGrid": ("Piece", "Source"), "PPolyData": ("Piece", "Source"),
         "vtkMultiBlockDataSet": ("DataSet", "file")}  # fmt: skip
BLOCKS = "vtkMultiBlockDataSet"
READ, INDEXES = (".vtu", ".vtp"), (".pvtu", ".pvtp", ".vtm")  # with cells; that name others, as a block may
LONGEST = 250  # characters of a path
Numbered = tuple[Element, tuple[int, ...], str]


class Link(NamedTuple):
    """A file that is named. group: where its block stands among those of each level; name: of the block, or ""."""

    element: Element
    path: str
    group: tuple[int, ...]
    name: str


def kind_of(data: Data) -> tuple[str, list[Link]]:
    """The type of a file, and the files that it names, in its order.

    Raises FormatError where it names one twice, one of another format, or one that is not in its folder or below.
    """
    root = parse(data, "VTKFile")
    kind = root.get("type")
    if kind not in NAMED:
        blame(data, root, f"a VTKFile of type {kind[:24]!r} is not supported here")
    tag, attribute = NAMED[kind]
    found = [
        Link(element, element.attributes[attribute], group, name)
        for element, group, name in _numbered(root, tag)
        if attribute in element.attributes
    ]
    seen = set[str]()
    for link in found:
        path = link.path
        if len(path) > LONGEST or not path.isprintable():
            blame(data, link.element, f"its name of a file is longer than {LONGEST} characters, or cannot be printed")
        inside = path and not re.search(r"^[/~]|[\\:\0]", path) and ".." not in path.split("/")
        if not inside or os.path.normpath(path) in seen:
            how = "is named twice" if inside else "must lie in the folder of this file or below"
            blame(data, link.element, f"{path[:80]!r} {how}")
        if split_name(path)[1].lower() not in (READ if kind != BLOCKS else READ + INDEXES):
            blame(data, link.element, f"{path[:80]!r} is neither .vtu nor .vtp: only such pieces are smoothed")
        seen.add(os.path.normpath(path))
    if not found:
        raise FormatError("no file with cells is named in it")
    return kind, found


def _numbered(element: Element, tag: str, group: tuple[int, ...] = (), name: str = "") -> Iterator[Numbered]:
    """The elements of this tag below, with the place and the name of their block. Pieces of a block are one block."""
    for number, child in enumerate(element.children):
        own, called = group, child.get("name") or name
        if element.tag in (BLOCKS, "Block") and child.tag != "Piece":
            own = (*group, number)
        if child.tag == tag:
            yield child, own, called
        elif child.tag in (*NAMED, "Block", "Piece"):
            yield from _numbered(child, tag, own, called)


def leaves(files: Mapping[str, Data], found: list[Link], folder: str = "") -> Iterator[Link]:
    """The files with cells that are named, by files that are named, too; paths from the folder of the first file.

    Pieces of a file of pieces are one block.
    """
    for link in found:
        path = os.path.join(folder, link.path)
        if split_name(path)[1].lower() in READ:
            yield link._replace(path=path)
            continue
        try:
            kind, below = kind_of(files[path])
        except FormatError as error:
            raise FormatError(f"{path}: {error}") from None
        for each in leaves(files, below, os.path.dirname(path)):
            group = (*link.group, *each.group) if kind == BLOCKS else link.group
            yield each._replace(group=group, name=each.name or link.name)


def links(data: Data) -> dict[str, str]:
    """The files that are named, each under its name, which is a path below the folder of the file."""
    return {link.path: link.path for link in kind_of(data)[1]}


def placed(name: str, links: Mapping[str, str], in_place: bool) -> dict[str, str]:
    """The path that each gets below the folder of a file of this name: its own, but in a folder called as the file is.

    So no two files share their pieces. ``a/a_0.vtu`` of a.pvtu becomes ``b/a_0.vtu`` of b.pvtu.
    """
    if in_place:
        return dict(links)
    own = os.path.basename(split_name(name)[0])
    paths = {key: os.path.normpath(path).split(os.sep) for key, path in links.items()}
    first = {path[0] for path in paths.values()}
    drop = len(first) == 1 and all(len(path) > 1 for path in paths.values())
    return {key: "/".join([own, *path[drop:]]) for key, path in paths.items()}


def relinked(data: bytes, names: Mapping[str, str]) -> bytes:
    """The file with other paths for the files that it names; all else stays."""
    parts, at = [], 0
    kind, found = kind_of(data)
    for link in found:
        if names[link.path] != link.path:
            first, end = span_of(data, link.element, NAMED[kind][1])
            parts += [data[at:first], escape(names[link.path], {'"': "&quot;", "'": "&apos;"}).encode()]
            at = end
    return b"".join([*parts, data[at:]])
