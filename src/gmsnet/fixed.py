"""Which nodes a user wants held: ids, a mask, names of markers, or a file's own ``fixed`` point data."""

from __future__ import annotations

import difflib
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gmsnet.errors import InputError
from gmsnet.mesh import Mesh


def fixed_mask(mesh: Mesh, fixed: Any = None) -> NDArray[np.bool_]:
    """(N,) bool: the nodes named by ``fixed`` and those whose point data ``fixed`` in the mesh is not zero.

    fixed: None, a mask (bool, one per node), node ids (integers, counted from 0), a marker's name, or a list of names.
    Raises InputError for ids out of range, masks of another length and names that the mesh does not have.
    """
    mask = np.zeros(len(mesh.points), dtype=bool)
    if "fixed" in mesh.point_data:
        own = np.asarray(mesh.point_data["fixed"])
        mask |= (own.reshape(len(mask), -1) != 0).any(axis=1)
    if fixed is None:
        return mask
    if isinstance(fixed, str):
        fixed = [fixed]
    values = np.asarray(fixed)
    if values.dtype.kind in "US":
        for name in values.ravel().tolist():
            mask[_nodes_of(mesh, name)] = True
    elif values.dtype == bool:
        if values.shape != mask.shape:
            raise InputError(f"a mask of fixed nodes needs one value per node, {mask.shape}, got shape {values.shape}")
        mask |= values
    elif values.dtype.kind in "iu" or values.size == 0:
        ids = values.astype(np.int64).ravel()
        wrong = ids[(ids < 0) | (ids >= len(mask))]
        if wrong.size:
            raise InputError(f"fixed names the node {wrong[0]}, but the mesh has the nodes 0 to {len(mask) - 1}")
        mask[ids] = True
    else:
        raise InputError(f"fixed must be node ids, a mask of bools or names of markers, got {values.dtype} values")
    return mask


def _nodes_of(mesh: Mesh, name: str) -> NDArray[np.int64]:
    markers = mesh.markers
    if name in markers:
        return markers[name]
    if not markers:
        raise InputError(f"there is no marker {name!r} to hold: the mesh has no markers")
    near = difflib.get_close_matches(name, markers, n=3)
    hint = f"did you mean {' or '.join(map(repr, near))}?" if near else f"it has {', '.join(map(repr, markers))}"
    raise InputError(f"the mesh has no marker {name!r}; {hint}")
