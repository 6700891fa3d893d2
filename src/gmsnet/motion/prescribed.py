"""Which nodes are to go where: a displacement, rotations, or both, as users give them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gmsnet.errors import InputError
from gmsnet.mesh.arrays import plain_array
from gmsnet.mesh.mesh import Mesh
from gmsnet.mesh.plane import in_plane
from gmsnet.mesh.selection import chosen_nodes

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]

ROTATION = "a rotation must be (nodes, degrees, (x, y)) or several of these"


@dataclass(frozen=True, eq=False)
class Prescribed:
    """Where nodes are to go. moved: (N,) bool by id, which have a place prescribed, if only their own.

    places: (N, 2) in the plane of the mesh, in its units; of others where they are. turn: (N,) radians, by how much the
    surroundings of a node are to turn, as far as rotations say so.
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
        for chosen, degrees, centre in rotations_of(rotate):
            made.rotate(chosen_nodes(mesh, chosen, "rotate"), degrees, centre)
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
        start = in_plane(mesh.points, mesh.plane)
        return cls(np.zeros(len(start), dtype=bool), start.copy(), np.zeros(len(start)))

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

    def rotate(self, ids: NDArray[np.int64], degrees: float, centre: tuple[float, float]) -> None:
        """Turns some nodes about a centre, counter-clockwise."""
        angle = math.radians(degrees)
        cosine, sine = math.cos(angle), math.sin(angle)
        if degrees % 90.0 == 0.0:  # so that quarter turns are exact
            cosine, sine = ((1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0))[int(degrees / 90.0 % 4.0)]
        ids = np.unique(ids)
        with np.errstate(over="ignore", invalid="ignore"):
            x, y = (self.places[ids] - centre).T
            self.places[ids] = np.column_stack([cosine * x - sine * y, sine * x + cosine * y]) + centre
        self.turn[ids] += angle
        self.moved[ids] = True

    def displace(self, ids: NDArray[np.int64], shifts: Floats) -> None:
        """Adds shifts (n, 2) to the places of some nodes."""
        with np.errstate(over="ignore"):
            self.places[ids] += shifts
        self.moved[ids] = True

    def put(self, ids: NDArray[np.int64], places: Floats) -> None:
        """Some nodes go to places (n, 2)."""
        self.places[ids] = places
        self.moved[ids] = True


def rows_of(mesh: Mesh, given: Any, count: int, what: str, *, every: bool) -> Floats:
    """(count, 2) shifts or places in the plane of the mesh, of one vector for all or of one for each node.

    every: one row for each node of the mesh is asked for. Raises InputError for anything else, and where a number is
    not finite or leads out of the plane.
    """
    values = plain_array(given, what)
    if values.dtype.kind not in "iuf":
        raise InputError(f"{what} must be numbers, got {values.dtype} values")
    values = values.astype(np.float64)
    widths = (2,) if mesh.points.shape[1] == 2 else (2, 3)
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
    return rows[:, :2]


def rotations_of(rotate: Any) -> list[tuple[Any, float, tuple[float, float]]]:
    """The rotations, each (nodes, degrees, (x, y)). Raises InputError for what is none."""
    if rotate is None:
        return []
    if not isinstance(rotate, Sequence) or isinstance(rotate, str):
        raise InputError(f"{ROTATION}, got {rotate!r}")
    several = rotate if all(_is_rotation(each) for each in rotate) else [rotate]
    found = []
    for each in several:
        if not _is_rotation(each):
            raise InputError(f"{ROTATION}, got {each!r}")
        nodes, degrees, centre = each
        numbers = (degrees, *centre)
        if not all(_is_number(value) and math.isfinite(value) for value in numbers):
            raise InputError(f"degrees and centre of a rotation must be finite numbers, got {numbers!r}")
        found.append((nodes, float(degrees), (float(centre[0]), float(centre[1]))))
    return found


def _is_rotation(thing: Any) -> bool:
    if not (isinstance(thing, (tuple, list)) and len(thing) == 3):
        return False
    centre = thing[2]
    return isinstance(centre, (tuple, list, np.ndarray)) and len(centre) == 2 and np.ndim(thing[1]) == 0


def _is_number(value: Any) -> bool:
    return isinstance(value, (int, float, np.integer, np.floating)) and not isinstance(value, bool)
