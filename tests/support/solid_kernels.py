"""Proofs of kernels.simplex.validity3 for one cell at a time, as tests ask for them."""

from gmsnet.kernels.jit.compile import kernel, part
from gmsnet.kernels.simplex.jacobian3 import COEFFICIENTS, NODES, PLACE, expand_solid, put, solid_workspace
from gmsnet.kernels.simplex.validity3 import certified_solid, minimum_of_solid, sign_of_solid


@part
def take_solid(nodes, form, work):
    """As ``gather_solid``, from the nodes themselves."""
    for k in range(form.nodes):
        put(work, NODES + 3 * k, nodes[k, 0] - nodes[0, 0], nodes[k, 1] - nodes[0, 1], nodes[k, 2] - nodes[0, 2])


@kernel
def judge_solid(nodes, form, orientation, delta, depth):
    """The sign of one cell from its nodes (n, 3), and where it is not VALID the place (3,). See ``sign_of_solid``."""
    work = solid_workspace()
    take_solid(nodes, form, work)
    sign = sign_of_solid(form, expand_solid(form, orientation, delta, work), depth, work)
    return sign, work[PLACE : PLACE + 3].copy()


@kernel
def coefficients_of_solid(nodes, form, orientation, delta):
    """The coefficients (K,) of one cell, their error bound, and the lower bound of det J, see ``minimum_of_solid``."""
    work = solid_workspace()
    take_solid(nodes, form, work)
    bound = expand_solid(form, orientation, delta, work)
    found = work[COEFFICIENTS : COEFFICIENTS + form.terms].copy()
    return found, bound, minimum_of_solid(form, bound, work)


@kernel
def certified_cells(points, cells, form, orientation, unit, grain, moved, places, out):
    """``certified_solid`` of each cell (C, n) of one kind, with its node moved[c] at places[c], into out (C,) bool."""
    work = solid_workspace()
    for c in range(len(cells)):
        x, y, z = places[c, 0], places[c, 1], places[c, 2]
        out[c] = certified_solid(points, cells[c], form, orientation[c], unit, grain, moved[c], x, y, z, work)
