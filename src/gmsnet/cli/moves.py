"""``--move``, ``--rotate`` and ``--displacement``: which nodes go where."""

from __future__ import annotations

import io
import math
import re
from array import array
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from gmsnet.errors import InputError

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from gmsnet.mesh.mesh import Mesh
    from gmsnet.motion.prescribed import Prescribed

FILE_BYTES, FILE_BYTES_PER_NODE = 1 << 20, 256  # that a file of displacements takes at most
APART = "\0"
# Of meshes in a plane and of volumes.
VALUES = {
    "--move": ("MARKER DX DY", "MARKER DX DY DZ"),
    "--rotate": ("MARKER DEGREES CX CY", "MARKER DEGREES CX CY CZ AX AY AZ"),
}
Moves = Mapping[str, Sequence[tuple[str, tuple[float, ...]]]]  # option → marker and numbers, each time it was given
FORMS = (
    "give lines 'node dx dy', or a table with one line 'x y' for each node of the mesh, its new place",
    "give lines 'node dx dy dz', or a table with one line 'x y z' for each node of the mesh, its new place",
)


def joined(arguments: Sequence[str]) -> list[str]:
    """The arguments of ``gmsnet deform`` with the values of each --move and --rotate as one.

    Typer has no options of several values that can be given more than once. A NUL, which no argument can hold, parts
    the values: the marker, and all numbers that follow, but for more than a volume takes.
    """
    out = list(arguments[:1])
    rest = list(arguments[1:])
    while rest:
        argument = rest.pop(0)
        out.append(argument)
        if argument == "--":
            return out + rest
        if argument in VALUES:
            fewest, most = (len(form.split()) for form in VALUES[argument])
            count = min(fewest, len(rest))
            while count < min(most, len(rest)) and _is_number(rest[count]):
                count += 1
            values, rest = rest[:count], rest[count:]
            out.append(APART.join(values))
    return out


def split(option: str, given: str) -> tuple[str, tuple[float, ...]]:
    """The marker and the numbers of one --move or --rotate. Raises InputError where they are none."""
    marker, *texts = given.split(APART)
    forms = VALUES[option]
    wanted = next((form for form in forms if len(form.split()) == 1 + len(texts)), "")
    if not wanted:
        raise InputError(f"{option} takes {' or '.join(forms)}, got {' '.join([marker, *texts])!r}")
    return marker, tuple(_number(text, f"{option} {wanted}") for text in texts)


def prescribed(mesh: Mesh, moves: Moves, displacement: str | None) -> Prescribed:
    """Where nodes are to go: rotations first, then what is moved, then the file of displacements.

    Raises InputError for markers that the mesh does not have, and files that are no displacements.
    """
    import numpy as np

    from gmsnet.mesh.selection import chosen_nodes
    from gmsnet.motion.prescribed import Prescribed, rotations_of

    made = Prescribed.still(mesh)
    for option in ("--rotate", "--move"):
        for marker, numbers in moves.get(option, ()):
            ids, wanted = np.unique(chosen_nodes(mesh, marker, option)), VALUES[option][made.dimension - 2]
            if len(numbers) != len(wanted.split()) - 1:
                what = "a volume" if made.dimension == 3 else "a mesh in a plane"
                raise InputError(f"{option} takes {wanted} for {what}, got {len(numbers)} numbers after {marker!r}")
            if option == "--move":
                made.displace(ids, np.array(numbers))
            else:
                [(_, degrees, centre, axis)] = rotations_of([turn_of(ids, numbers)], made.dimension)
                made.rotate(ids, degrees, centre, axis)
    if displacement is not None:
        read_displacements(displacement, mesh, made)
    return made.checked(mesh)


def turn_of(ids: NDArray[np.int64], numbers: tuple[float, ...]) -> tuple[object, ...]:
    """What ``gmsnet.deform`` takes as a rotation, of the numbers of one --rotate."""
    return (ids, numbers[0], numbers[1:]) if len(numbers) == 3 else (ids, numbers[0], numbers[1:4], numbers[4:])


def read_displacements(path: str, mesh: Mesh, made: Prescribed) -> None:
    """Adds what a file says, in the plane of the mesh or in space.

    Lines ``node dx dy``, nodes counted from 0, name the nodes that move. A file of as many lines ``x y`` as the mesh
    has nodes gives the new place of each; those that it changes move. Of volumes each line has one number more. Values
    are parted by blanks or commas; # begins a comment. Raises InputError, with the line, for anything else.
    """
    import numpy as np

    from gmsnet.io.contents import small
    from gmsnet.mesh.plane import in_plane

    count, values, lines, width = len(mesh.points), array("d"), array("q"), 0
    dimension = made.dimension
    forms = FORMS[dimension - 2]
    try:
        data = small(path, FILE_BYTES + FILE_BYTES_PER_NODE * count, f"displacements of {count:,} nodes")
    except OSError as error:
        raise InputError(f"{path}: the displacements cannot be read: {error.strerror}") from error
    try:
        for number, line in enumerate(io.TextIOWrapper(io.BytesIO(data), encoding="utf-8"), start=1):
            texts = line.partition("#")[0].replace(",", " ").split()
            if not texts:
                continue
            width = width or len(texts)
            if len(texts) != width or width not in (dimension, dimension + 1):
                raise InputError(f"{path}, line {number}: {len(texts)} values: {forms}")
            if width > dimension and not re.fullmatch(r"\d{1,18}", texts[0]):
                raise InputError(f"{path}, line {number}: {texts[0]!r} is not a node: {forms}")
            values.extend(_number(text, f"{path}, line {number}") for text in texts)
            lines.append(number)
    except UnicodeDecodeError as error:
        raise InputError(f"{path}: this is not a file of displacements: {forms}") from error
    if not lines:
        raise InputError(f"{path}: the file has no displacements: {forms}")
    table = np.array(values).reshape(-1, width)
    if width > dimension:
        made.displace(*_listed(path, table, np.array(lines), count))
        return
    if len(table) != count:
        raise InputError(f"{path}: {len(table):,} places for a mesh of {count:,} nodes: {forms}")
    start = mesh.points if mesh.plane is None else in_plane(mesh.points, mesh.plane)
    moved = np.flatnonzero((table != start).any(axis=1))
    if not len(moved):
        raise InputError(f"{path}: all places are those of the mesh, so there is nothing to move")
    if made.moved[moved].any():
        raise InputError(f"{path}: the place of node {moved[made.moved[moved]][0]} is told by another option, too")
    made.put(moved, table[moved])


def _listed(
    path: str, table: NDArray[np.float64], lines: NDArray[np.int64], count: int
) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    import numpy as np

    ids = table[:, 0].astype(np.int64)
    beyond = np.flatnonzero(ids >= count)
    if len(beyond):
        row = beyond[0]
        raise InputError(
            f"{path}, line {lines[row]}: there is no node {ids[row]}; the mesh has the nodes 0 to {count - 1}"
        )
    order = np.argsort(ids, kind="stable")
    again = np.flatnonzero(np.diff(ids[order]) == 0)
    if len(again):
        row = order[again[0] + 1]
        raise InputError(f"{path}, line {lines[row]}: node {ids[row]} is named for a second time")
    return ids, table[:, 1:]


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return "_" not in text


def _number(text: str, where: str) -> float:
    value = float(text) if _is_number(text) else math.nan
    if not math.isfinite(value):
        raise InputError(f"{where}: {text!r} is not a finite number")
    return value
