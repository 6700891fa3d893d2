"""``--fix``: markers, node ids or a file of them."""

from __future__ import annotations

import io
import re
from array import array
from collections.abc import Collection, Sequence
from typing import TYPE_CHECKING

from gmsnet.errors import InputError

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from gmsnet.mesh.mesh import Mesh

LIST_BYTES, LIST_BYTES_PER_NODE = 1 << 20, 64  # that a list in a file takes at most: ids, and what is said of them


def fixed_nodes(mesh: Mesh, given: Sequence[str]) -> NDArray[np.bool_]:
    """(N,) bool: the nodes that the values of ``--fix`` name.

    Each is the name of a marker, region or node set; node ids such as ``3,7,12``, counted from 0; or ``@FILE`` with
    ids. A marker whose name is a number goes before a node of that number (``100,`` is always the node).
    Raises InputError for names and ids that the mesh does not have and for files that are no list of ids.
    """
    import numpy as np

    from gmsnet.mesh.selection import fixed_mask

    mask = np.zeros(len(mesh.points), dtype=bool)
    for each in chosen(given, len(mask), mesh.markers if names_markers(given) else ()):
        mask |= fixed_mask(mesh, each)
    return mask


def names_markers(given: Sequence[str]) -> bool:
    """Whether any of the values of ``--fix`` may be the name of a marker."""
    return not all(value.startswith("@") for value in given)


def chosen(given: Sequence[str], count: int, markers: Collection[str]) -> list[str | NDArray[np.int64]]:
    """What the values of ``--fix`` name in a mesh of so many nodes with such markers: of each the marker or node ids.

    Raises InputError as ``fixed_nodes``.
    """
    import numpy as np

    from gmsnet.mesh.selection import check_marker

    found: list[str | NDArray[np.int64]] = []
    for value in given:
        if value.startswith("@"):
            found.append(_from_file(value[1:], count))
        elif value not in markers and re.fullmatch(r"\s*\d+\s*(,\s*\d+\s*)*,?\s*", value):
            found.append(np.array([_node(text, count, "--fix") for text in value.split(",") if text.strip()]))
        else:
            check_marker(value, markers)
            found.append(value)
    return found


def _from_file(path: str, count: int) -> NDArray[np.int64]:
    import numpy as np

    from gmsnet.io.contents import small

    try:
        data = small(path, LIST_BYTES + LIST_BYTES_PER_NODE * count, f"a list of {count:,} nodes")
    except OSError as error:
        raise InputError(f"{path}: the list of nodes cannot be read: {error.strerror}") from error
    ids = array("q")
    try:
        for number, line in enumerate(io.TextIOWrapper(io.BytesIO(data), encoding="utf-8"), start=1):
            for text in line.partition("#")[0].replace(",", " ").split():
                ids.append(_node(text, count, f"{path}, line {number}"))
    except UnicodeDecodeError as error:
        raise InputError(f"{path}: this is not a list of nodes: give whole numbers, counted from 0") from error
    if not ids:
        raise InputError(f"{path}: the list names no node: leave out --fix, or put ids into it")
    return np.array(ids, dtype=np.int64)


def _node(text: str, count: int, where: str) -> int:
    if not re.fullmatch(r"\s*\d{1,18}\s*", text):
        raise InputError(f"{where}: {text!r} is not a node: give whole numbers, counted from 0")
    if int(text) >= count:
        raise InputError(f"{where}: there is no node {int(text)}; the mesh has the nodes 0 to {count - 1}")
    return int(text)
