"""The first state of a surface in space that is to be smoothed."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gmsnet.constraints.options import check_slide
from gmsnet.constraints.shell import FEATURE, patches_of_surface, sides_of, torn_apart
from gmsnet.constraints.sliding_in_space import SurfaceSliding
from gmsnet.constraints.smooth_patches import vertices_of
from gmsnet.errors import InputError
from gmsnet.measure.report import measure
from gmsnet.mesh.known_cells import unmeasured, unmoved_faces
from gmsnet.mesh.mesh import Mesh
from gmsnet.mesh.normals import fields_in, normals_in, renewed_mesh
from gmsnet.methods import Smoother
from gmsnet.parallel.executor import Executor
from gmsnet.preserve.protection import Protection
from gmsnet.run.options import SmoothOptions
from gmsnet.run.state import State
from gmsnet.run.unfold import unfolded
from gmsnet.topology.held import ON_BOUNDARY
from gmsnet.topology.ordering import space_points, taken
from gmsnet.topology.shell import Shell
from gmsnet.topology.topology import Topology

Floats = NDArray[np.float64]


def first_of_surface(
    given: Mesh, restore: Callable[[Floats], Any], asked: NDArray[np.bool_], smoother: Smoother,
    options: SmoothOptions, executor: Executor,
) -> tuple[State, Shell]:  # fmt: skip
    """The state of a mesh in no plane before the first stage. asked: (N,) bool, nodes to hold."""
    names = check_slide(given, options.slide, options.feature_angle, options.geometry)
    topology, start = Topology.and_points(given, asked, options.thread_count)
    torn = torn_apart(space_points(given)[:, :3], topology.held.get(ON_BOUNDARY))
    how = names, options.feature_angle, asked | torn
    facets, patches = patches_of_surface(given, topology, *how, options.free_needles)
    mended, notes, laid = unfolded(given, facets, patches, asked, options)
    if notes:
        facets, patches = patches_of_surface(mended, topology, *how, laid | options.free_needles)
    slides = patches.slides | patches.curves.slides
    if (patches.curves.slides & ~_flagged(topology.free, len(slides))).any():
        topology, start = Topology.and_points(given, asked, options.thread_count, patches.curves.slides)
    vertices = vertices_of(patches, space_points(mended)[:, :3])
    shell = Shell.made(topology, sides_of(mended, topology, patches, vertices)).holding(~slides, FEATURE)
    sliding = SurfaceSliding.of(
        mended,
        facets,
        patches,
        shell.memory,
        shell.free,
        options.distance,
        options.geometry,
        vertices,
        options.hausdorff,
        bool(notes),
    )
    others = unmeasured(given)
    remarks: tuple[str, ...] = (f"not measured, and their nodes are held: {others}",) if others else ()
    if curved := unmoved_faces(given):
        remarks += (f"cells of second order move in a plane and in volumes, on a surface they are held: {curved}",)
    if torn.any():
        remarks += (
            f"{int(torn.sum()):,} nodes of the boundary have another one in their place, to rounding: facets are not "
            "joined there, so these nodes are held. Make equal points one point first, and they can move",
        )
    remarks += _of_normals(given, options.update_normals)
    given = given.without_cells()
    before = measure(given, shell, start, executor.for_blocks(0))
    nothing = np.empty(0, dtype=np.float32)
    points = taken(space_points(mended), shell.memory) if notes else start
    state = State(
        given, restore, smoother, before, Protection(shell, []), start, points, nothing, remarks, sliding=sliding,
        untangling=notes, untangled=points if notes else None,
    )  # fmt: skip
    return state, shell


def _of_normals(mesh: Mesh, update: bool) -> tuple[str, ...]:
    """What becomes of normals in a mesh or its file, in words. update: whether they are to be computed anew."""
    if update:
        found = normals_in(mesh)
        told = f"normals ({', '.join(found)}) are computed anew where nodes move"
        return (
            told if found else "update_normals: the mesh and its file have no normals that are known, or all are 0",
        )
    source = "" if mesh.source is None else mesh.source.normals
    if stale := ", ".join(filter(None, [*fields_in(mesh.point_data, mesh.cell_data), source])):
        return (f"normals in the file ({stale}) stay as they are where nodes move: update_normals computes them anew",)
    return ()


def renewing(given: Mesh, mesh: Any) -> Callable[[Floats], Mesh]:
    """What makes a mesh of new points, with new normals. mesh: what came in. InputError where that is no Mesh."""
    if given is not mesh:
        raise InputError(
            f"update_normals is of files and of meshes that gmsnet.read gives, and this is a {type(mesh).__name__}: "
            "leave it out, and have its own library compute normals of the result"
        )
    return partial(renewed_mesh, given)


def _flagged(nodes: NDArray[np.int32], count: int) -> NDArray[np.bool_]:
    """(count,) bool."""
    flags = np.zeros(count, dtype=bool)
    flags[nodes] = True
    return flags
