"""New coordinates into a live model, exactly, with parameters on curves and surfaces."""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gmsnet.errors import GmsnetError
from gmsnet.gmsh.curve import CadCurve
from gmsnet.gmsh.live import Live, Part

Floats = NDArray[np.float64]
SET_NODE = "gmshModelMeshSetNode"  # of Gmsh's C interface
NUMBER = 8  # bytes of a coordinate


def set_points(gmsh: Any, live: Live, points: Floats, moved: NDArray[np.bool_]) -> None:
    """Gives the nodes ``moved`` (N,) of the current model the coordinates points (N, 3), bit for bit."""
    for part in live.parts:
        rows = part.first + np.flatnonzero(moved[part.first : part.last])
        if len(rows):
            places = np.ascontiguousarray(points[rows])
            _set(gmsh, live.tags[rows], places, _parameters(gmsh, part, places))


def _parameters(gmsh: Any, part: Part, places: Floats) -> Floats:
    """(n, 1) on a curve, (n, 2) on a surface, (n, 0) where there are none.

    A node keeps its old ones else, and Gmsh puts it back by them as soon as it relocates nodes or raises their order.
    """
    if part.discrete or part.dimension not in (1, 2):
        return np.zeros((len(places), 0))
    if part.dimension == 1:
        return CadCurve(gmsh, part.tag).project(places)[1].reshape(-1, 1)
    parameters = gmsh.model.getParametrization(2, part.tag, places.ravel())
    return np.ascontiguousarray(parameters, dtype=np.float64).reshape(-1, 2)


def _set(gmsh: Any, tags: NDArray[np.int64], places: Floats, parameters: Floats) -> None:
    """Through the C function itself where the module shows it: in an eighth of the time of its Python function."""
    function = getattr(getattr(gmsh, "lib", None), SET_NODE, None)
    if function is None:
        for tag, place, own in zip(tags.tolist(), places, parameters, strict=True):
            gmsh.model.mesh.setNode(tag, place, own)
        return
    error = ctypes.c_int(0)
    call, count = _prototype(function), parameters.shape[1]
    at, beside, told = places.ctypes.data, parameters.ctypes.data, ctypes.addressof(error)
    for row, tag in enumerate(tags.tolist()):
        call(tag, at + 3 * NUMBER * row, 3, beside + count * NUMBER * row, count, told)
        if error.value:
            raise GmsnetError(f"Gmsh does not take the node {tag}: {gmsh.logger.getLastError()}")


def _prototype(function: Any) -> Callable[..., None]:
    """The same function with the types of its arguments, which the module's own object leaves open."""
    size, pointer = ctypes.c_size_t, ctypes.c_void_p
    kind = ctypes.CFUNCTYPE(None, size, pointer, size, pointer, size, pointer)
    address = ctypes.cast(function, pointer).value
    assert address is not None
    return kind(address)
