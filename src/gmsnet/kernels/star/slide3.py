"""Stars in space whose node slides: steps along its patch or curve, to the place where it will really lie.

Sums and steps are those of a block (kernels.star.space, stars3). What is None where no node slides is left out when a
kernel is compiled.
"""

from __future__ import annotations

import numpy as np

from gmsnet.kernels.jit.compile import inlined, part
from gmsnet.kernels.star.space import GX, GY, GZ, ISO, XX, XY, XZ, YY, YZ, ZZ
from gmsnet.kernels.star.space_blocks import LANES3
from gmsnet.kernels.star.surface import directions_at, on_curves, snap3


@inlined
def find_rows(row, centre, block, rows):
    """Writes the rows of the nodes of a block; returns whether one of them slides: few blocks have such nodes."""
    found = False
    for lane in range(LANES3):
        rows[lane] = row[centre[block * LANES3 + lane]]
        found |= rows[lane] >= 0
    return found


@inlined
def confined(on_curve, u, v, w, gx, gy, gz, xx, yy, zz, xy, xz, yz):
    """A gradient and a Hessian along a curve with the tangent (u, v, w), or along a patch with that normal.

    With the normal n, H becomes PHP + (nᵀHn)nnᵀ, P = I − nnᵀ; with the tangent t, (tᵀHt)I.
    """
    p, q, r = xx * u + xy * v + xz * w, xy * u + yy * v + yz * w, xz * u + yz * v + zz * w
    slope, bend = gx * u + gy * v + gz * w, u * p + v * q + w * r
    if on_curve:
        return slope * u, slope * v, slope * w, bend, bend, bend, 0.0 * bend, 0.0 * bend, 0.0 * bend
    gx, gy, gz = gx - slope * u, gy - slope * v, gz - slope * w
    xx, yy, zz = xx + 2.0 * u * (bend * u - p), yy + 2.0 * v * (bend * v - q), zz + 2.0 * w * (bend * w - r)
    xy = xy + 2.0 * bend * u * v - u * q - v * p
    xz = xz + 2.0 * bend * u * w - u * r - w * p
    yz = yz + 2.0 * bend * v * w - v * r - w * q
    return gx, gy, gz, xx, yy, zz, xy, xz, yz


@part
def restrict3(surface, blocks, block, isotropic, workspace):
    """Makes gradients and Hessians those along the patch or curve, so that Newton's step is, too. isotropic: of ISO."""
    if surface is not None and find_rows(surface.row, blocks.centre, block, workspace.row):
        sums, star, half = workspace.sums, workspace.star, np.float32(0.5)
        for lane in range(LANES3):
            row = workspace.row[lane]
            if row < 0:
                continue
            u, v, w = directions_at(surface, row, star[4 * lane], star[4 * lane + 1], star[4 * lane + 2])
            u, v, w = np.float32(u), np.float32(v), np.float32(w)
            iso = np.float32(isotropic) * sums[ISO * LANES3 + lane]
            xx, yy = 2.0 * sums[XX * LANES3 + lane] + iso, 2.0 * sums[YY * LANES3 + lane] + iso
            zz = 2.0 * sums[ZZ * LANES3 + lane] + iso
            xy, xz, yz = sums[XY * LANES3 + lane], sums[XZ * LANES3 + lane], sums[YZ * LANES3 + lane]
            gx, gy, gz = sums[GX * LANES3 + lane], sums[GY * LANES3 + lane], sums[GZ * LANES3 + lane]
            gx, gy, gz, xx, yy, zz, xy, xz, yz = confined(
                on_curves(surface.kind[row]), u, v, w, gx, gy, gz, xx, yy, zz, xy, xz, yz
            )
            sums[GX * LANES3 + lane], sums[GY * LANES3 + lane], sums[GZ * LANES3 + lane] = gx, gy, gz
            sums[XX * LANES3 + lane], sums[YY * LANES3 + lane], sums[ZZ * LANES3 + lane] = (
                half * xx,
                half * yy,
                half * zz,
            )
            sums[XY * LANES3 + lane], sums[XZ * LANES3 + lane], sums[YZ * LANES3 + lane] = xy, xz, yz
            sums[ISO * LANES3 + lane] = 0.0


@inlined
def is_there(star, target, step, inverse, lane):
    """Does the step of a lane lead to the target that is kept of it?"""
    there = True
    for k in range(3):
        there &= np.float32((target[4 * lane + k] - star[4 * lane + k]) * inverse) == step[k * LANES3 + lane]
    return there


@part
def land3(surface, blocks, block, trial, workspace):
    """Turns steps of nodes that slide into those to their places, which are kept in ``target`` and ``place``.

    trial: of this block. Steps that are as the trial before left them are not landed once more: so what a node does
    does not hang on the nodes of other lanes.
    """
    if surface is not None and find_rows(surface.row, blocks.centre, block, workspace.row):
        star, step = workspace.star, workspace.step
        for lane in range(LANES3):
            row = workspace.row[lane]
            if row < 0:
                continue
            inverse = np.float64(workspace.inverse[lane])
            if trial > 0 and is_there(star, workspace.target, step, inverse, lane):
                continue
            dx, dy, dz = step[lane] / inverse, step[LANES3 + lane] / inverse, step[2 * LANES3 + lane] / inverse
            x, y, z, place = star[4 * lane], star[4 * lane + 1], star[4 * lane + 2], np.int64(surface.place[row])
            if (dx != 0.0 or dy != 0.0 or dz != 0.0) and np.isfinite(dx) and np.isfinite(dy) and np.isfinite(dz):
                x, y, z, place = snap3(surface, row, x + dx, y + dy, z + dz)
                step[lane] = (x - star[4 * lane]) * inverse
                step[LANES3 + lane] = (y - star[4 * lane + 1]) * inverse
                step[2 * LANES3 + lane] = (z - star[4 * lane + 2]) * inverse
            workspace.target[4 * lane], workspace.target[4 * lane + 1], workspace.target[4 * lane + 2] = x, y, z
            workspace.place[lane] = place


@part
def note_places(surface, workspace):
    """Takes note of where nodes that slide will be, as ``land3`` found it, in the lanes that are allowed to move."""
    if surface is not None:
        for lane in range(LANES3):
            if workspace.row[lane] >= 0 and workspace.allowed[lane]:
                surface.place[workspace.row[lane]] = workspace.place[lane]


@part
def on_surface(surface, node, x, y, z):
    """Where a node goes that would go to (x, y, z): there, or, if it slides, where ``snap3`` says; and its facet."""
    if surface is not None:
        row = surface.row[node]
        if row >= 0:
            return snap3(surface, row, x, y, z)
    return x, y, z, 0


@part
def take_place(surface, node, place):
    """Takes note of the facet or piece where a node that slides has gone."""
    if surface is not None:
        row = surface.row[node]
        if row >= 0:
            surface.place[row] = place
