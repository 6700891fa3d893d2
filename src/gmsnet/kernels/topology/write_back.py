"""Coordinates from memory order back to the order of the ids."""

from __future__ import annotations

from gmsnet.kernels.jit.compile import kernel


@kernel
def put_back(near, start, memory, plane, first, second, points, moved):
    """Writes the nodes of ``near`` that are elsewhere than in ``start``, times first and second, and marks them.

    near, start: (N, 2) in memory order, in space (N, 4). memory: (N,) ids. plane: the axes of points (N, dim) to be
    written, a tuple. moved:
    (N,) bool by id, all False. Returns how many there are, and whether the factors have left all their digits.
    """
    count, exact = 0, True
    inverse_first, inverse_second = 1.0 / first, 1.0 / second
    for k in range(len(near)):
        elsewhere = False
        for axis in range(len(plane)):
            elsewhere |= near[k, axis] != start[k, axis]
        if elsewhere:
            i = memory[k]
            moved[i] = True
            count += 1
            for axis in range(len(plane)):
                value = near[k, axis] * first * second
                points[i, plane[axis]] = value
                exact &= value * inverse_second * inverse_first == near[k, axis]
    return count, exact
