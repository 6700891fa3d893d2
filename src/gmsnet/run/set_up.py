"""The first state of a mesh that is to be smoothed: connectivity, measures, and what is protected."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gmsnet.constraints.options import check_slide
from gmsnet.constraints.sliding import sliding_in_plane
from gmsnet.constraints.sliding_in_space import sliding_volume
from gmsnet.errors import InputError
from gmsnet.measure.report import ASPECT, SHAPE, QualityReport, measure
from gmsnet.measure.target import Target
from gmsnet.measure.totals import Totals, totals_of, totals_with_others
from gmsnet.mesh.adapters import to_mesh
from gmsnet.mesh.known_cells import measured, unknown_cells, unmeasured, unmoved
from gmsnet.mesh.mesh import Mesh
from gmsnet.mesh.selection import fixed_mask, images
from gmsnet.methods import Smoother, StarSmoother
from gmsnet.methods.auto import Auto
from gmsnet.methods.cells import check_cells, counts_of
from gmsnet.parallel.executor import Executor
from gmsnet.parallel.memory import refuse_unless_free
from gmsnet.preserve.protection import METRIC, NONE, SIZE, Protection, protected, protected_volume
from gmsnet.run.metric_stage import check_given
from gmsnet.run.options import MOST_ANGLE, SmoothOptions
from gmsnet.run.remarks import NOT_MEASURED, held_anyway, inside_out_note, repeating, without_effect
from gmsnet.run.second_order import second_order_of
from gmsnet.run.second_order_volumes import second_order_solids_of
from gmsnet.run.set_up_surface import first_of_surface, renewing
from gmsnet.run.state import State
from gmsnet.topology.doubled import doubled_note
from gmsnet.topology.mixed_volume import MixedVolume, wound_of
from gmsnet.topology.ordering import space_points, taken
from gmsnet.topology.topology import Topology
from gmsnet.topology.volume import Volume
from gmsnet.topology.wound import refuse_flat

Floats = NDArray[np.float64]
Looked = tuple[QualityReport, Totals | None, Protection]

MANY = 20_000  # nodes: for the set-up of fewer a second thread is not worth starting
# That a call takes at most on a mesh of triangles, copies of them included; ``auto`` takes 251, all nodes at once 550.
BYTES_PER_NODE = 600


def first_state(
    mesh: Any, fixed: Any, smoother: Smoother, options: SmoothOptions, executor: Executor,
    moved: NDArray[np.bool_] | None = None,
) -> State:  # fmt: skip
    """The state before the first stage. mesh, fixed: see ``gmsnet.smooth``. moved: (N,) by id, held beside ``fixed``.

    Raises InputError for a mesh that cannot be smoothed or does not fit into memory, and for nodes that it has not.
    """
    target = options.target
    given, restore = to_mesh(mesh)
    check_mesh(given, target)
    check_options(given, options)
    remarks = []
    refuse_unless_free(BYTES_PER_NODE * len(given.points), f"smoothing {len(given.points):,} nodes")
    asked, matching = fixed_mask(given, fixed), images(given)
    if options.update_normals and given.plane is None and not given.has_volumes:
        restore = renewing(given, mesh)
    if options.join_regions:
        given = given.with_one_region()
    if given.has_volumes:
        return _first_of_volume(given, restore, asked, matching, fixed, smoother, options, executor, moved)
    if given.plane is None:
        state, shell = first_of_surface(given, restore, asked, smoother, options, executor)
        return replace(
            state, remarks=(*state.remarks, *held_anyway(given, asked, matching, shell, fixed, options.slides))
        )
    threads = _threads(given, options)
    still = asked if moved is None else asked | moved
    topology, start, sliding = sliding_in_plane(
        given, options.slide, options.feature_angle, still, options.geometry, threads
    )
    second = second_order_of(given, topology, options)
    remarks += held_anyway(given, asked, matching, topology, fixed, options.slides)
    remarks += without_effect(options, False, second)
    if options.adapts and second is not None:
        raise InputError("a metric for second-order cells cannot be had so far: leave out metric, size and preserve")
    values = check_given(options, len(given.points))
    if target and (others := unmeasured(given)):
        remarks.append(f"the target is asked of triangles and quads alone, not of {others}")
    if unknown := unknown_cells(given):
        remarks.append(f"the nodes of {unknown} are held: gmsnet does not know this type of cells")
    given = given.without_cells()  # whatever was copied of them is given back
    shapes = np.full(len(topology.near) if target else 0, np.nan, dtype=np.float32)  # of triangles alone it is written

    def looked_at(near: Floats) -> Looked:
        looks, first, every = executor.for_blocks(0), None, None
        if not target:  # else the shapes of all cells are wanted
            first = totals_of(near, topology.scored, looks)
            every = totals_with_others(near, topology, first, looks)
        before = measure(given, topology, near, looks, every, shapes)
        firm = bool(target) or before.inverted > 0
        found = protected(given, topology, options.preserved, options.fix_layers, near, firm=firm)
        return before, first, found

    before, first, protection = _beside_stars(partial(looked_at, start), topology, smoother, options, threads)
    if values is not None and before.inverted:
        raise InputError(
            f"{'metric' if options.size is None else 'size'} is given at the nodes of a mesh with "
            f"{before.inverted:,} inverted cells, between which it has no meaning: untangle the mesh first, or give a "
            "function of place"
        )
    return State(
        given,
        restore,
        smoother,
        before,
        protection,
        start,
        start,
        shapes,
        tuple(remarks),
        totals=first if protection.topology is topology else None,  # else a run compares fewer cells
        first=None if first is None else (topology, first),
        sliding=sliding,
        second_order=second,
        nodal=values,
    )


def _first_of_volume(
    given: Mesh, restore: Callable[[Floats], Any], asked: NDArray[np.bool_], matching: NDArray[np.bool_], fixed: Any,
    smoother: Smoother, options: SmoothOptions, executor: Executor, moved: NDArray[np.bool_] | None,
) -> State:  # fmt: skip
    """The same of a mesh of volumes."""
    names = check_slide(given, options.slide, options.feature_angle, options.geometry)
    still = asked if moved is None else asked | moved
    threads = _threads(given, options)
    topology, sliding = sliding_volume(
        given, wound_of(given, still, threads), names, options.feature_angle, still, options.distance,
        options.geometry, options.hausdorff, threads,
    )  # fmt: skip
    remarks = held_anyway(given, asked, matching, topology, fixed, options.slides)
    remarks += doubled_note(given, topology)
    second = second_order_solids_of(given, topology, options)
    others = [unmoved(counts_of(given))]
    if second is None and isinstance(topology, MixedVolume):
        others.append(repeating(counts_of(given), len(topology.cell)))
    if left_out := ", ".join(filter(None, others)):
        remarks.append(NOT_MEASURED + left_out)
    if isinstance(topology, MixedVolume):
        remarks += inside_out_note(topology.inside_out())
    start = taken(space_points(given), topology.memory)
    remarks += without_effect(options, True, second)
    bare, nothing = given.without_cells(), np.empty(0, dtype=np.float32)

    def looked_at() -> Looked:
        looks, first = executor.for_blocks(0), None
        before = measure(bare, topology, start, looks) if second is None else measure(given)
        if second is None and not options.target:
            whole = topology.scored is topology.simplices
            first = before.totals if whole else totals_of(start, topology.scored, looks)
        if options.target and not len(before.cell):
            raise InputError(f"a target is asked of cells that can be measured, and this mesh has none: {left_out}")
        firm = before.inverted > 0
        return before, first, protected_volume(topology, options.preserved, options.fix_layers, start, firm=firm)

    threads = 1 if second is not None else threads
    before, first, protection = _beside_stars(looked_at, topology, smoother, options, threads)
    given = bare
    return State(
        given, restore, smoother, before, protection, start, start, nothing, tuple(remarks),
        totals=first if protection.topology is topology else None,
        first=None if first is None else (topology, first), sliding=sliding, second_order=second,
    )  # fmt: skip


def _threads(mesh: Mesh, options: SmoothOptions) -> int:
    """On how many threads the set-up is made."""
    return options.thread_count if len(mesh.points) >= MANY else 1


def _beside_stars(
    look: Callable[[], Looked], topology: Topology | Volume, smoother: Smoother, options: SmoothOptions, threads: int
) -> Looked:  # fmt: skip
    """What a look returns, with the stars made beside it where there is a thread for that.

    Most often nothing is protected, and these are the stars that are smoothed.
    """
    if threads == 1 or options.target or not isinstance(smoother, Auto | StarSmoother):
        return look()
    return topology.stars_beside(look)


def check_options(mesh: Mesh, options: SmoothOptions, counts: Mapping[str, int] | None = None) -> None:
    """InputError for options that a mesh of these cells does not take. counts: kind → cells, where it is a part."""
    if mesh.plane is None:
        check_in_space(options)
    check_cells(mesh, options.method_name, options.objective or options.variant, counts)
    check_surface_options(mesh, options)


def check_surface_options(mesh: Mesh, options: SmoothOptions) -> None:
    """InputError for options of surfaces where the mesh is none, or no node of its boundary slides."""
    if mesh.has_volumes and options.hausdorff is not None and not options.slides:
        raise InputError("hausdorff is of facets whose nodes move, and those of the boundary stay: give slide, too")
    if mesh.plane is None and not mesh.has_volumes:
        return
    bounds = options.hausdorff is not None and not mesh.has_volumes
    for name, given in (("hausdorff", bounds), ("free_needles", options.free_needles)):
        if given:
            raise InputError(f"{name} is of surfaces in space, and this mesh is none: leave it out")


def check_in_space(options: SmoothOptions) -> None:
    """InputError for what cannot be asked of volumes and surfaces yet."""
    if options.preserve in (SIZE, METRIC):
        raise InputError(
            f"preserve={options.preserve!r} is of meshes in a plane, and this one is in space: "
            f"leave it out, or give {SHAPE!r} or {NONE!r}"
        )
    if options.adapts:
        raise InputError("meshes in space cannot be smoothed towards a metric yet: leave out metric and size")
    if options.best_by == ASPECT:
        raise InputError("best_by is of meshes in a plane: leave it out for one in space")


def check_target(mesh: Mesh, target: Target) -> None:
    """InputError for a minimum angle that cells of this mesh do not have."""
    if mesh.has_volumes and target.angle is not None:
        raise InputError(
            "target_angle is of the angles of triangles and quads, and this mesh has volumes: give target_dihedral"
        )
    corners = {block.cell.corners for block in mesh.cells if block.dimension == 2 and len(block.nodes)}
    if 3 in corners and target.angle is not None and target.angle > MOST_ANGLE:
        raise InputError(
            f"target_angle: no triangle has a minimum angle of more than {MOST_ANGLE:g}°, and this mesh has some, got "
            f"{target.angle:g}"
        )
    if mesh.has_volumes and target.dihedral is not None and mesh.has_solids:
        raise InputError(
            "target_dihedral is of meshes of tetrahedra alone, and this one has other volumes: give target_quality"
        )
    curved = sorted(
        {block.kind for block in mesh.cells if block.dimension == 3 and len(block.nodes) and block.cell.order > 1}
    )
    if curved and target.dihedral is not None:
        raise InputError(
            f"target_dihedral is of tetrahedra of the first order, and this mesh has {', '.join(curved)} cells: give "
            "target_quality"
        )
    if not mesh.has_volumes and target.dihedral is not None:
        raise InputError("target_dihedral is of tetrahedra, and this mesh has none: give target_angle")


def check_mesh(mesh: Mesh, target: Target) -> None:
    """InputError for meshes that cannot be smoothed, and targets of no triangle."""
    check_target(mesh, target)
    others = unmeasured(mesh) if target and not mesh.has_volumes else ""
    if others and not any(len(block.nodes) for block in mesh.cells if measured(mesh, block)):
        raise InputError(
            f"a target is asked of triangles and quads, and this mesh has none: {others} cannot be measured so far"
        )
    if mesh.has_volumes:
        refuse_flat(mesh)
        return
    if mesh.plane is None and (unknown := unknown_cells(mesh)):
        raise InputError(
            f"the mesh varies in x, y and z and has cells of a type that gmsnet does not know ({unknown}): "
            "whether it is a surface or a volume cannot be told"
        )
