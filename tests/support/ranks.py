"""Meshes that are cut up, smoothed by ranks in threads, and compared with the serial run."""

from __future__ import annotations

import numpy as np

import gmsnet
from gmsnet.distributed.first import follow, release, smooth_from_first
from gmsnet.distributed.frame import framed
from gmsnet.distributed.ghosts import surrounded
from gmsnet.distributed.part import Part
from gmsnet.distributed.piece import pieces_of
from gmsnet.distributed.smoothing import smoothed
from gmsnet.measure.worst import places_of, unmet
from support.comm import together


def parts_at_random(mesh, ranks, rng, how):
    """Which rank has which cell: at random, in runs, or but for one all on the last one."""
    found = []
    for block in mesh.cells:
        count = len(block.nodes)
        if how == "interleaved":
            part = rng.integers(0, ranks, count)
        elif how == "strips":
            part = np.arange(count) * ranks // max(count, 1)
        else:
            part = np.full(count, ranks - 1)
            part[:1] = 0
        found.append(part.astype(np.int32))
    return found


def on_parts(mesh, parts, ranks, work):
    """What work(part) returns on each rank."""
    pieces = pieces_of(mesh, np.zeros(len(mesh.points), dtype=bool), parts, ranks)

    def one(comm):
        around = surrounded(pieces[comm.rank], comm)
        part = Part.of(around, framed(comm, around.mesh(pieces[comm.rank])), comm, None)
        found = work(part)
        part.halo.free()
        return found

    return together(ranks, one)


def spread(mesh, options, parts, ranks, fixed=None):
    """The points (N, dim) after a run over ranks, and what the first rank tells."""
    fixed = np.zeros(len(mesh.points), dtype=bool) if fixed is None else fixed
    pieces = pieces_of(mesh, fixed, parts, ranks)
    results = together(ranks, lambda comm: smoothed(pieces[comm.rank], options, comm))
    points = np.full_like(mesh.points, np.nan)
    for piece, result in zip(pieces, results, strict=True):
        seen = points[piece.ids]
        assert (np.isnan(seen) | (seen == result.points)).all(), "ranks agree on the nodes that they share"
        points[piece.ids] = result.points
    for result in results:
        assert _figures(result) == _figures(results[0])
    return points, results


def from_first(mesh, options, ranks):
    """The SmoothResult of a first rank that has the mesh, while the others follow it."""

    def work(comm):
        if comm.rank > 0:
            return follow(comm)
        found = smooth_from_first(mesh, options, comm=comm)
        release(comm)
        return found

    return together(ranks, work)[0]


def same(mesh, options, parts, ranks, fixed=None):
    serial = gmsnet.smooth(
        mesh, options.method, guard=options.guard, max_sweeps=options.max_sweeps, preserve=options.preserve,
        variant=options.variant, objective=options.objective, threads=1, fixed=fixed,
        target_quality=options.target_quality, target_angle=options.target_angle,
        target_dihedral=options.target_dihedral, slide=options.slide, feature_angle=options.feature_angle,
        surface_tolerance=options.surface_tolerance, hausdorff=options.hausdorff, join_regions=options.join_regions,
        untangle=options.untangle,
    )  # fmt: skip
    points, results = spread(mesh, options, parts, ranks, fixed)
    assert points.tobytes() == serial.points.tobytes()
    told = results[0]
    assert _of_stages(told.notes) == _of_stages(serial.notes)
    assert repr(told.after) == repr(serial.after.totals)
    assert repr(told.judged) == repr(serial.judged)
    assert told.stop_reason == serial.stop_reason
    assert [sweep.moved for sweep in told.history] == [sweep.moved for sweep in serial.history]
    assert told.worst == places_of(serial.after, unmet(serial.after, options.target))
    if options.target:
        assert told.missed == len(options.target.missed_in(serial.after))
    assert told.held == {reason: len(ids) for reason, ids in serial.held.items()}
    return told


def nodes_lent(monkeypatch, module, name):
    """How many nodes the first rank got each time, filled while ranks run. name: of what gathers them, in a module."""
    counts, gathered = [], getattr(module, name)

    def counting(part, field, active):
        loan = gathered(part, field, active)
        if loan.field is not None:
            counts.append(len(loan.field.points))
        return loan

    monkeypatch.setattr(module, name, counting)
    return counts


TOLD = (
    "untangling",
    "the mesh is refined",
    "slide:",
    "surface:",
    "target:",
    "feature angle",
    "hausdorff:",
    "not measured",
    "cells that have one height",
    "the mesh looks anisotropic",
    "fix_layers:",
)


def _of_stages(notes):
    """What is said of inverted cells, layers and walls, of nodes that slide and of cells that are left out."""
    return [note for note in notes if note.startswith(TOLD)]


def _figures(result):
    """As texts: what is not measured of volumes is nan, which is not equal to itself."""
    return repr(result.before), repr(result.after), result.sweeps
