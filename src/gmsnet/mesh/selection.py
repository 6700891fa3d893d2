"""Which nodes a user wants held: ids, a mask, names of markers, or a file's own ``fixed`` point data."""

from __future__ import annotations

import difflib
from collections.abc import Collection, Set
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gmsnet.errors import InputError
from gmsnet.kernels.topology.sorted_unique import sorted_unique
from gmsnet.mesh.arrays import plain_array
from gmsnet.mesh.checks import in_words
from gmsnet.mesh.mesh import Mesh

FORMS = "must be node ids, a mask of bools or names of markers"


def fixed_mask(mesh: Mesh, fixed: Any = None) -> NDArray[np.bool_]:
    """(N,) bool: the nodes named by ``fixed``, and those that the mesh itself wants held.

    The latter are nodes whose point data ``fixed`` is not zero, and nodes of boundaries that its file calls periodic.

    fixed: None, a mask (bool, one per node), node ids (integers, counted from 0), a marker's name, or several names.
    Several may be an array, a list, a tuple, a set or a range. Point data ``fixed`` may have several columns, of which
    one that is not zero will do; a nan is not zero.

    Raises InputError for ids out of range, masks of another length, masks of numbers (of which zeros and ones might be
    ids), names that the mesh does not have, anything else than these forms, and point data ``fixed`` that are no
    numbers: what they mean cannot be told, and to move nodes that are meant to stay would be worse than to stop.
    """
    mask = _own(mesh)
    if fixed is not None:
        mask[chosen_nodes(mesh, fixed, "fixed")] = True
    return mask


def chosen_nodes(mesh: Mesh, chosen: Any, what: str) -> NDArray[np.int64]:
    """The ids of some nodes, named in any of the forms of ``fixed_mask`` but None; ids as they were given, else
    ascending.

    what: what messages call them. Raises InputError as ``fixed_mask`` does.
    """
    values, forms, count = _values(chosen, what), f"{what} {FORMS}", len(mesh.points)
    if values.dtype.kind == "U":
        named = [_nodes_of(mesh, name) for name in values.ravel().tolist()]
        return named[0] if len(named) == 1 else sorted_unique(np.concatenate(named))
    if values.dtype == bool:
        if values.shape != (count,):
            raise InputError(f"a mask of {what} nodes needs one value per node, {(count,)}, got shape {values.shape}")
        return np.flatnonzero(values)
    if _is_mask_of_numbers(values, count):
        raise InputError(
            f"{what} has a 0 or a 1 for each of the {count:,} nodes: give a mask as bools, such as .astype(bool), "
            "or ids without repetition"
        )
    if values.dtype.kind in "iu":
        wrong = values[(values < 0) | (values >= count)]
        if wrong.size:
            raise InputError(f"{what} names the node {wrong[0]}, but the mesh has {in_words(count)}")
        return values.ravel().astype(np.int64)
    if values.size or values.dtype.kind != "f":  # an empty list is an array of no floats
        mend = ": give integers, as by .astype(int)" if values.dtype.kind == "f" else ""
        raise InputError(f"{forms}, got {values.dtype} values{mend}")
    return np.empty(0, dtype=np.int64)


def _is_mask_of_numbers(values: NDArray[Any], count: int) -> bool:
    """Zeros and ones, one per node: more than the two nodes 0 and 1 could be meant by."""
    return (
        values.dtype.kind in "iuf"
        and values.shape == (count,)
        and count > 2
        and bool(((values == 0) | (values == 1)).all())
    )


def _own(mesh: Mesh) -> NDArray[np.bool_]:
    """The nodes that the mesh itself wants held."""
    mask = images(mesh)
    if "fixed" not in mesh.point_data:
        return mask
    return mask | held_by_data(mesh.point_data["fixed"])


def held_by_data(own: NDArray[Any]) -> NDArray[np.bool_]:
    """(N,) bool: which nodes the point data ``fixed`` (N, …) hold. Raises InputError where these are no numbers."""
    if own.dtype.kind not in "biuf":
        raise InputError(
            f"the point data 'fixed' of the mesh must be numbers (0: free, all else: held), got {own.dtype} values: "
            "make them numbers or give the data another name"
        )
    held: NDArray[np.bool_] = (own != 0).any(axis=tuple(range(1, own.ndim)))
    return held


def images(mesh: Mesh) -> NDArray[np.bool_]:
    """(N,) bool: nodes of periodic boundaries, each of which has an image that it must go on to match."""
    mask = np.zeros(len(mesh.points), dtype=bool)
    if mesh.source is not None:
        mask[mesh.source.images_in(mesh)] = True
    return mask


def _values(fixed: Any, what: str) -> NDArray[Any]:
    """What the user gave as an array: names, bools or numbers, never a mixture."""
    forms = f"{what} {FORMS}"
    if isinstance(fixed, Set):
        fixed = list(fixed)
    if isinstance(fixed, np.ndarray) and fixed.dtype.kind == "O":
        fixed = fixed.ravel().tolist()
    if isinstance(fixed, (list, tuple)):
        strings = sum(isinstance(value, str) for value in fixed)
        if 0 < strings < len(fixed):
            raise InputError(f"{forms}, got names mixed with other values: give the node ids of all as one list")
        if len({len(value) if isinstance(value, (list, tuple)) else -1 for value in fixed}) > 1:
            raise InputError(f"{forms}, got lists of different lengths within a list: give one flat list")
        huge = [value for value in fixed if isinstance(value, int) and abs(value) >= 2**63]
        if huge:
            raise InputError(f"{what} names the node {huge[0]}, which no mesh can have")
    elif not (isinstance(fixed, (str, range)) or hasattr(fixed, "__array__") or np.isscalar(fixed)):
        raise InputError(f"{forms}, got one {type(fixed).__name__}: give a list")
    return plain_array(fixed, what)


def _nodes_of(mesh: Mesh, name: str) -> NDArray[np.int64]:
    markers = mesh.markers
    check_marker(name, markers)
    return markers[name]


def check_marker(name: str, markers: Collection[str]) -> None:
    """Raises InputError where a name is not one of the markers of a mesh."""
    if name in markers:
        return
    if not markers:
        raise InputError(f"there is no marker {name!r}: the mesh has no markers")
    near = difflib.get_close_matches(name, markers, n=3)
    hint = f"did you mean {' or '.join(map(repr, near))}?" if near else f"it has {', '.join(map(repr, markers))}"
    raise InputError(f"the mesh has no marker {name!r}; {hint}")
