"""Elements of a list that each have the code of their type in front of their nodes."""

from __future__ import annotations

from gmsnet.kernels.jit.compile import kernel


@kernel
def typed_starts(values, sizes, at, starts):
    """Where elements begin, from ``at`` on: as many as ``starts`` has room for and as begin within ``values``.

    sizes: of each code the number of nodes, 0 where it is not known. Returns how many were found before the first code
    that is not known, and where the next one begins, which may be behind the end.
    """
    for k in range(len(starts)):
        if at >= len(values) or not 0 <= values[at] < len(sizes) or sizes[values[at]] == 0:
            return k, at
        starts[k] = at
        at += 1 + sizes[values[at]]
    return len(starts), at
