"""Which nodes are to go where: a displacement, rotations, or both, as users give them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gmsnet.errors import InputError
from gmsnet.kernels.topology.sorted_unique import sorted_unique
from gmsnet.mesh.arrays import plain_array
from gmsnet.mesh.mesh import Mesh
from gmsnet.mesh.plane import in_plane
from gmsnet.mesh.selection import chosen_nodes
from gmsnet.motion.rotations import Rotations, rotations_in

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]

ROTATION = "a rotation must be (nodes, degrees, (x, y)) or several of these"
ROTATION_IN_SPACE = "a rotation of a volume must be (nodes, degrees, (x, y, z), (axis)) or several of these"


@dataclass(frozen=True, eq=False)
class Prescribed:
    """Where nodes are to go. moved: (N,) bool by id, which have a place prescribed, if only their own.

    places: (N, 2) in the plane of the mesh, (N, 3) of a volume, in its units; of others where they are. turn: (N, k),
    by how much the surroundings of a node are to turn, as far as rotations say so (motion/rotations.py).
    """

    moved: Flags
    places: Floats
    turn: Floats

    @classmethod
    def of(
        cls, mesh: Mesh, displacement: Any = None, nodes: Any = None, rotate: Any = None, places: Any = None
    ) -> Prescribed:
        """From what ``gmsnet.deform`` takes; see there.

        Raises InputError for nodes and markers that the mesh does not have, for displacements and places of the wrong
        shape or that are not finite, and for rotations that are none.
        """
        if displacement is not None and places is not None:
            raise InputError("displacement and places both say where nodes are to go: give one of them")
        if displacement is None and places is None and nodes is not None:
            raise InputError("nodes are named, but neither a displacement nor places are given for them")
        if places is not None and rotate is not None:
            raise InputError("places says where nodes are to go: leave rotate out")
        made = cls.still(mesh)
        for chosen, degrees, centre, axis in rotations_of(rotate, made.dimension):
            made.rotate(chosen_nodes(mesh, chosen, "rotate"), degrees, centre, axis)
        given, what = (displacement, "displacement") if places is None else (places, "places")
        if given is not None:
            ids = np.arange(len(mesh.points)) if nodes is None else chosen_nodes(mesh, nodes, "nodes")
            rows = rows_of(mesh, given, len(ids), what, every=nodes is None)
            once, first, times = np.unique(ids, return_index=True, return_counts=True)
            if (times > 1).any() and len(ids) == len(rows) > 1:
                raise InputError(f"nodes names the node {once[times > 1][0]} more than once")
            rows = rows[first]
            elsewhere = (rows != (made.places[once] if places is not None else 0.0)).any(axis=1) | (nodes is not None)
            (made.put if places is not None else made.displace)(once[elsewhere], rows[elsewhere])
        return made.checked(mesh)

    @classmethod
    def still(cls, mesh: Mesh) -> Prescribed:
        """No node is moved."""
        start = mesh.points if mesh.plane is None else in_plane(mesh.points, mesh.plane)
        made = cls(np.zeros(len(start), dtype=bool), start.copy(), np.empty(0))
        return replace(made, turn=np.zeros((len(start), made.rotations.k)))

    @property
    def dimension(self) -> int:
        """2, or 3 of a volume."""
        return int(self.places.shape[1])

    @property
    def rotations(self) -> Rotations:
        """Those of the dimension."""
        return rotations_in(self.dimension)

    def checked(self, mesh: Mesh) -> Prescribed:
        """The same, as the mesh can hold it; InputError where nothing is moved, or to no finite place."""
        if not self.moved.any():
            raise InputError("there is nothing to move: give nodes and by how much, or rotations")
        if mesh.single:
            with np.errstate(over="ignore"):
                self.places[self.moved] = self.places[self.moved].astype(np.float32)
        wrong = np.flatnonzero(~np.isfinite(self.places).all(axis=1))
        if len(wrong):
            raise InputError(f"node {wrong[0]} would be moved to a place that is no finite number")
        return self

    def rotate(self, ids: NDArray[np.int64], degrees: float, centre: Sequence[float], axis: Sequence[float]) -> None:
        """Turns some nodes about a centre, counter-clockwise; in space about an axis (3,) that points at the viewer."""
        ids = sorted_unique(ids)
        with np.errstate(over="ignore", invalid="ignore"):
            self.places[ids] = (self.places[ids] - centre) @ _matrix(degrees, axis).T + centre
        turn = math.radians(degrees) * np.array(axis)
        self.turn[ids] = self.rotations.joined(self.turn[ids], np.broadcast_to(turn, (len(ids), len(turn))))
        self.moved[ids] = True

    def displace(self, ids: NDArray[np.int64], shifts: Floats) -> None:
        """Adds shifts (n, D) to the places of some nodes."""
        with np.errstate(over="ignore"):
            self.places[ids] += shifts
        self.moved[ids] = True

    def put(self, ids: NDArray[np.int64], places: Floats) -> None:
        """Some nodes go to places (n, D)."""
        self.places[ids] = places
        self.moved[ids] = True


def _matrix(degrees: float, axis: Sequence[float]) -> Floats:
    """(D, D) of a rotation; axis: of unit length, of one number in the plane."""
    angle = math.radians(degrees)
    cosine, sine = math.cos(angle), math.sin(angle)
    if degrees % 90.0 == 0.0:  # so that quarter turns are exact
        cosine, sine = ((1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0))[int(degrees / 90.0 % 4.0)]
    if len(axis) == 1:
        return np.array([[cosine, -sine], [sine, cosine]])
    x, y, z = axis
    across = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    found: Floats = cosine * np.eye(3) + sine * across + (1.0 - cosine) * np.outer(axis, axis)
    return found


def rows_of(mesh: Mesh, given: Any, count: int, what: str, *, every: bool) -> Floats:
    """(count, D) shifts or places in the plane of the mesh, or in space, of one vector for all or of one for each node.

    every: one row for each node of the mesh is asked for. Raises InputError for anything else, and where a number is
    not finite or leads out of the plane.
    """
    values = plain_array(given, what)
    if values.dtype.kind not in "iuf":
        raise InputError(f"{what} must be numbers, got {values.dtype} values")
    values = values.astype(np.float64)
    widths = (3,) if mesh.plane is None else (2,) if mesh.points.shape[1] == 2 else (2, 3)
    one = values.ndim == 1 and len(values) in widths and not every
    if not (one or (values.ndim == 2 and len(values) == count and values.shape[1] in widths)):
        width = " or ".join(map(str, widths))
        single = "" if every else f"one vector of {width} numbers, or "
        raise InputError(
            f"{what} must be {single}one row of {width} numbers for each of the {count:,} "
            f"{'nodes of the mesh' if every else 'nodes named'}, got the shape {values.shape}"
        )
    rows = np.broadcast_to(values, (count, values.shape[-1])) if one else values
    wrong = np.flatnonzero(~np.isfinite(rows).all(axis=1))
    if len(wrong):
        raise InputError(f"{what} must be finite numbers; row {wrong[0]} (counted from 0) is {rows[wrong[0]].tolist()}")
    if rows.shape[1] == 3 and mesh.plane is not None:
        across = ({0, 1, 2} - set(mesh.plane)).pop()
        level = 0.0 if what == "displacement" else mesh.points[0, across]
        if (rows[:, across] != level).any():
            raise InputError(
                f"{what} leads out of the plane of the mesh, in which {'xyz'[across]} does not vary: "
                f"give {level:g} as its {'xyz'[across]}"
            )
        return rows[:, list(mesh.plane)]
    return rows if mesh.plane is None else rows[:, :2]


def rotations_of(rotate: Any, dimension: int) -> list[tuple[Any, float, tuple[float, ...], tuple[float, ...]]]:
    """The rotations, each with nodes, degrees, centre and axis, of one number in the plane, and of unit length.

    Raises InputError for what is none.
    """
    if rotate is None:
        return []
    what = ROTATION if dimension == 2 else ROTATION_IN_SPACE
    if not isinstance(rotate, Sequence) or isinstance(rotate, str):
        raise InputError(f"{what}, got {rotate!r}")
    several = rotate if all(_is_rotation(each, dimension) for each in rotate) else [rotate]
    found = []
    for each in several:
        if not _is_rotation(each, dimension):
            raise InputError(f"{what}, got {each!r}")
        nodes, degrees, centre, *axis = each
        numbers = (degrees, *centre, *(axis[0] if axis else ()))
        if not all(_is_number(value) and math.isfinite(value) for value in numbers):
            raise InputError(f"degrees, centre and axis of a rotation must be finite numbers, got {numbers!r}")
        direction = np.array(axis[0], dtype=np.float64) if axis else np.ones(1)
        if not direction.any():
            raise InputError(f"the axis of a rotation must have a length, got {tuple(axis[0])!r}")
        direction /= np.abs(direction).max()  # whose square then neither under- nor overflows
        unit = direction / np.linalg.norm(direction)
        found.append((nodes, float(degrees), tuple(map(float, centre)), tuple(unit.tolist())))
    return found


def _is_rotation(thing: Any, dimension: int) -> bool:
    if not (isinstance(thing, (tuple, list)) and len(thing) == dimension + 1 and np.ndim(thing[1]) == 0):
        return False
    return all(isinstance(each, (tuple, list, np.ndarray)) and len(each) == dimension for each in thing[2:])


def _is_number(value: Any) -> bool:
    return isinstance(value, (int, float, np.integer, np.floating)) and not isinstance(value, bool)
