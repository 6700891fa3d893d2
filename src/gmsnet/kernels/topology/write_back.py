"""Coordinates from memory order back to the order of the ids."""

from __future__ import annotations

from gmsnet.kernels.jit.compile import kernel


@kernel
def put_back(near, start, memory, plane, first, second, points, moved):
    """Writes the nodes of ``near`` that are elsewhere than in ``start``, times first and second, and marks them.

    near, start: (N, 2) in memory order. memory: (N,) ids. plane: the two axes of points (N, dim) to be written. moved:
    (N,) bool by id, all False. Returns how many there are, and whether the factors have left all their digits.
    """
    count, exact = 0, True
    inverse_first, inverse_second = 1.0 / first, 1.0 / second
    for k in range(len(near)):
        if near[k, 0] != start[k, 0] or near[k, 1] != start[k, 1]:
            i = memory[k]
            moved[i] = True
            count += 1
            for axis in range(2):
                value = near[k, axis] * first * second
                points[i, plane[axis]] = value
                exact &= value * inverse_second * inverse_first == near[k, axis]
    return count, exact
