"""The quadratic forms that measure the corner simplices of planar cells."""

from __future__ import annotations

from functools import cache

import numpy as np
from numpy.typing import NDArray

from gmsnet.cells.kind import CellKind


@cache
def quadratic_form(kind: CellKind) -> NDArray[np.float64]:
    """(S, 3) the coefficients α, β, γ of N = α|a|² + β|b|² + γ a·b for the spokes a, b of each corner simplex.

    a runs from the corner to its first neighbour, b to its second. The mean ratio is 1/q = D/N with D = det(a, b).
    So N = ‖A W⁻¹‖²_F · det W / 2, of the spokes A = (a b) and the ideal W (Knupp, SIAM J. Sci. Comput. 23, 2001).

    Raises ValueError for a kind without corner simplices in the plane.
    """
    if kind.dimension != 2 or not kind.simplices:
        raise ValueError(f"{kind.name!r} has no corner simplices in the plane")
    inverse = np.array(kind.ideal)
    one, two = inverse[:, 0], inverse[:, 1]  # rows, whose products are the Gram matrix; by hand, for the same bits
    form = [one[:, 0] ** 2 + one[:, 1] ** 2, two[:, 0] ** 2 + two[:, 1] ** 2]
    form += [2.0 * (one[:, 0] * two[:, 0] + one[:, 1] * two[:, 1])]
    twice = 2.0 * (one[:, 0] * two[:, 1] - one[:, 1] * two[:, 0])
    return _read_only(np.stack(form, axis=1) / twice[:, None])


@cache
def rerooted(kind: CellKind) -> NDArray[np.float64]:
    """(S, 3, 3) the same forms with the spokes taken from each of the three vertices of the simplex.

    [s, v] has the coefficients for the spokes p and q from vertex v of simplex s to the next vertex and to the one
    after it, in the order of the simplex. N and D = det(p, q) are the same numbers for each v. [s, 0] is the form of
    ``quadratic_form``.

    Raises ValueError as ``quadratic_form``.
    """
    first, second, mixed = quadratic_form(kind).T
    whole = first + second + mixed
    forms = (
        (first, second, mixed),
        (second, whole, -2.0 * second - mixed),  # from the end of a: a = −q, b = p − q
        (whole, first, -2.0 * first - mixed),  # from the end of b: b = −p, a = q − p
    )
    return _read_only(np.ascontiguousarray(np.array(forms).transpose(2, 0, 1)))


def _read_only(array: NDArray[np.float64]) -> NDArray[np.float64]:
    array.flags.writeable = False
    return array
