"""Is the Jacobian determinant of a volume cell positive everywhere? Proofs in floating point.

It lies between the smallest and the largest of its coefficients (kernels.simplex.jacobian3). Those at corners are its
values there. Where the corners are positive and some coefficient is not, the cell is cut in half, and so on. Each
coefficient on a part is a mean of those on the whole, so that one error bound serves all parts.
"""

from __future__ import annotations

import numpy as np

from gmsnet.kernels.jit.compile import inlined, kernel, part
from gmsnet.kernels.simplex.jacobian3 import (
    COEFFICIENTS,
    DEPTH,
    FRAMES,
    LEVELS,
    PLACE,
    ROOM,
    STACK,
    VERTICES,
    WHOLE,
    expand_solid,
    gather_solid,
    solid_workspace,
)

BUDGET = 3000  # parts of a cell that are looked at
TOLERANCE = 2.0**-8  # of a lower bound, in units of the largest coefficient
VALID, UNDECIDED, INVALID = 1, 0, -1


@inlined
def smallest_solid(form, begin, work):
    """The smallest of the coefficients that begin there in the workspace."""
    least = work[begin]
    for k in range(begin + 1, begin + form.terms):
        least = min(least, work[k])
    return least


@inlined
def smallest_corner(form, begin, work):
    """The smallest coefficient that is a value of det J at a corner, and which corner that is."""
    least, which = work[begin + form.ints[form.corner]], 0
    for c in range(1, form.corners):
        value = work[begin + form.ints[form.corner + c]]
        if value < least:
            least, which = value, c
    return least, which


@part
def start_halves(form, work):
    """Puts the whole cell on the stack."""
    work[LEVELS] = 0.0
    for k in range(form.terms):
        work[STACK + k] = work[COEFFICIENTS + k]
    for k in range(3 * form.vertices):
        work[FRAMES + k] = form.floats[form.frame + k]


@part
def replace_by_halves(form, top, work):
    """The part below ``top`` on the stack gives way to its halves; returns the new top."""
    count, ints, low, level = form.terms, form.ints, STACK + (top - 1) * ROOM, work[LEVELS + top - 1]
    g = int(level) % form.cuts
    for k in range(count):
        work[WHOLE + k] = work[low + k]
    for half in range(2):
        for k in range(count):
            row, value = form.half_start + count * (2 * g + half) + k, 0.0
            for e in range(ints[row], ints[row + 1]):
                value += form.floats[form.half_weight + e] * work[WHOLE + ints[form.half_from + e]]
            work[low + half * ROOM + k] = value
        work[LEVELS + top - 1 + half] = level + 1.0
    first = FRAMES + (top - 1) * 3 * VERTICES
    second = first + 3 * VERTICES
    i, j = 3 * ints[form.cut + 2 * g], 3 * ints[form.cut + 2 * g + 1]
    for k in range(3 * form.vertices):
        work[second + k] = work[first + k]
    for axis in range(3):
        middle = 0.5 * (work[first + i + axis] + work[first + j + axis])
        work[first + j + axis] = middle
        work[second + i + axis] = middle
    return top + 1


@part
def keep_place(form, row, corner, work):
    """Reference coordinates of a corner of the part in a row of the stack, into PLACE of the workspace."""
    for axis in range(3):
        total = 0.0
        for f in range(3):
            v = form.ints[form.at + 3 * corner + f]
            if v >= 0:
                total += work[FRAMES + 3 * (row * VERTICES + v) + axis]
        work[PLACE + axis] = total


@inlined
def sign_of_solid(form, bound, depth, work):
    """VALID: det J is certainly positive everywhere in the cell. INVALID: it certainly is not. Else UNDECIDED.

    The cell's coefficients stand in the workspace, with their error bound. Where the cell is not valid, PLACE says
    where det J is negative, or cannot be told from zero after ``depth`` halvings, DEPTH at most.
    """
    if smallest_solid(form, COEFFICIENTS, work) > bound:  # as in most cells
        return VALID
    return sign_of_halves(form, bound, depth, work)


@part
def sign_of_halves(form, bound, depth, work):
    """``sign_of_solid`` by cutting the cell in half."""
    start_halves(form, work)
    top, looked = 1, 0
    while top > 0:
        looked += 1
        begin = STACK + (top - 1) * ROOM
        at_corner, corner = smallest_corner(form, begin, work)
        if at_corner < -bound:
            keep_place(form, top - 1, corner, work)
            return INVALID
        if smallest_solid(form, begin, work) > bound:
            top -= 1
        elif not at_corner > bound or work[LEVELS + top - 1] >= depth or looked == BUDGET:
            keep_place(form, top - 1, corner, work)
            return UNDECIDED
        else:
            top = replace_by_halves(form, top, work)
    return VALID


@part
def minimum_of_solid(form, bound, work):
    """What det J is certainly not below anywhere in the cell, sharp to TOLERANCE or as DEPTH and BUDGET allow.

    It is positive where ``sign_of_solid`` is VALID.
    """
    start_halves(form, work)
    largest, looked = 0.0, 0
    for k in range(form.terms):
        largest = max(largest, abs(work[COEFFICIENTS + k]))
    top, lower, upper = 1, np.inf, np.inf
    while top > 0:
        looked += 1
        begin = STACK + (top - 1) * ROOM
        least = smallest_solid(form, begin, work)
        at_corner, _ = smallest_corner(form, begin, work)
        upper = min(upper, at_corner)
        sharp = least >= upper - TOLERANCE * largest and (least > bound or not upper > bound)
        if sharp or work[LEVELS + top - 1] >= DEPTH or looked >= BUDGET:
            lower = min(lower, least)
            top -= 1
        else:
            top = replace_by_halves(form, top, work)
    return lower - bound


@inlined
def certified_solid(points, cell, form, orientation, unit, grain, moved, x, y, z, work):
    """Is det J certainly positive everywhere in a cell, with one node at another place? For guards.

    points: (N, 3 or more). cell: the ids of its nodes, in the order of VTK. orientation: ±1, −1 for a cell that is to
    be read inside out. moved: the id of the node that is to be at x, y, z; −1 for none. unit, grain: see
    kernels.star.guard.Precision. work: ``solid_workspace()``. True is a proof. False is none of the contrary.
    """
    delta = unit * gather_solid(points, cell, form, moved, x, y, z, work) + grain
    bound = expand_solid(form, orientation, delta, work)
    return sign_of_solid(form, bound, DEPTH, work) == VALID


@kernel
def judge_solids(points, cells, form, orientation, unit, grain, depth, first, last, sign, place):
    """The sign of the cells first…last of one kind (C, n), into ``sign`` (C,) int8 and ``place`` (C, 3).

    Arguments: see ``certified_solid``, ``sign_of_solid``. place stays as it is where a cell is VALID.
    """
    work = solid_workspace()
    for c in range(first, last):
        delta = unit * gather_solid(points, cells[c], form, -1, 0.0, 0.0, 0.0, work) + grain
        sign[c] = sign_of_solid(form, expand_solid(form, orientation[c], delta, work), depth, work)
        if sign[c] != VALID:
            for axis in range(3):
                place[c, axis] = work[PLACE + axis]


@kernel
def lower_bounds(points, cells, form, orientation, unit, grain, first, last, lower):
    """What det J is certainly not below in the cells first…last of one kind, into ``lower`` (C,)."""
    work = solid_workspace()
    for c in range(first, last):
        delta = unit * gather_solid(points, cells[c], form, -1, 0.0, 0.0, 0.0, work) + grain
        lower[c] = minimum_of_solid(form, expand_solid(form, orientation[c], delta, work), work)


@kernel
def volumes_of_solids(points, cells, form, volume):
    """The signed volume of each cell of one kind (C, n), into ``volume`` (C,): the mean of det J's coefficients."""
    work = solid_workspace()
    for c in range(len(cells)):
        gather_solid(points, cells[c], form, -1, 0.0, 0.0, 0.0, work)
        expand_solid(form, 1.0, 0.0, work)
        total = 0.0
        for k in range(form.terms):
            total += work[COEFFICIENTS + k]
        volume[c] = form.volume * total / form.terms


@kernel
def corners_of_solids(points, cells, form, orientation, values):
    """det J at the corners of each cell of one kind (C, n), into ``values`` (C, corners)."""
    work = solid_workspace()
    for c in range(len(cells)):
        gather_solid(points, cells[c], form, -1, 0.0, 0.0, 0.0, work)
        expand_solid(form, orientation[c], 0.0, work)
        for k in range(form.corners):
            values[c, k] = work[COEFFICIENTS + form.ints[form.corner + k]]
