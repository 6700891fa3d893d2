"""smooth() and quality(): what users call."""

from __future__ import annotations

import os
import time
from collections.abc import Callable
from contextlib import AbstractContextManager
from dataclasses import replace
from typing import Any

from gmsnet.cuda.executor import gpu
from gmsnet.measure.report import QualityReport, measure
from gmsnet.mesh.adapters import to_mesh
from gmsnet.parallel.executor import Executor
from gmsnet.parallel.interrupts import interruptible
from gmsnet.parallel.threads import workers
from gmsnet.run.call import ended
from gmsnet.run.options import CUDA, SmoothOptions
from gmsnet.run.outcome import result_of
from gmsnet.run.set_up import first_state
from gmsnet.run.smooth_result import SmoothResult
from gmsnet.run.stages import carry_out
from gmsnet.run.state import State
from gmsnet.run.sweep import MOST_SWEEPS, Sweep


def smooth(
    mesh: Any,
    method: str = "auto",
    *,
    variant: str | None = None,
    objective: str | None = None,
    max_sweeps: int = MOST_SWEEPS,
    threads: int | None = None,
    target_quality: float | None = None,
    target_angle: float | None = None,
    target_dihedral: float | None = None,
    fixed: Any = None,
    preserve: str = "shape",
    fix_layers: bool = False,
    untangle: bool = True,
    guard: str = "worst",
    seed: int = 0,
    callback: Callable[[Sweep], bool | None] | None = None,
    weights: str | os.PathLike[str] | None = None,
    best_by: str = "shape",
    slide: Any = None,
    feature_angle: float = 30.0,
    geometry: Any = None,
    surface_tolerance: float | None = None,
    hausdorff: float | None = None,
    free_needles: bool = False,
    update_normals: bool = False,
    join_regions: bool = False,
    device: str = "cpu",
    metric: Any = None,
    size: Any = None,
) -> SmoothResult:
    """Moves the free nodes of a mesh so that its elements become better; changes nothing else.

    No cell that is valid becomes invalid, the worst cell does not get worse (``guard``), and of all meshes on the way
    the best is returned: the one with the fewest inverted cells, then with the largest q̂ (for a target: with the fewest
    cells that miss it), the input among them.

    mesh: (points, cells) arrays, a dict of arrays, a Mesh, or an object of meshio, meshlane, PyVista, scikit-fem,
    Matplotlib or SciPy; it is not changed. method: a name
    in METHODS. variant, objective: names out of the method's own lists (default: their first). max_sweeps: at most
    so many sweeps (as many again for second-order cells that have missed a target); in most, each node is visited
    once, in those of ``worst-first`` some nodes are often. threads:
    at most so many (default: the processors at hand); the result is the same bits for any number. target_quality,
    target_angle: the minimum 1/q, in (0, 1], and the minimum angle, in (0, 60] degrees, of quads alone in (0, 89], that
    every cell is to have: only cells that miss it and what is around them are smoothed, until none misses it.
    target_dihedral: the minimum dihedral angle of tetrahedra, in (0, 70.5] degrees; target_quality is of their η.
    fixed: nodes to hold besides boundary, interfaces and the like: ids, a mask, a marker's name or a list of names.
    preserve: "shape" holds the
    nodes of stretched layers along walls, "size" besides weighs the areas of cells, without a bound, "none" neither;
    "metric" holds nothing, and moves nodes towards a smooth metric that is recovered from the cells as they are;
    "size" and "metric" are of meshes in a plane alone.
    fix_layers: hold all cells that are stretched alike, whatever ``preserve`` says. untangle: mend inverted cells
    first, where there are any. guard: what each sweep keeps besides validity: "valid" nothing (as the paper), "worst"
    that the worst 1/q of the cells with a free node never falls, "star" that the worst 1/q around any free node never
    falls. seed: for methods that draw random numbers (none does so far). callback: called after each look at the mesh:
    after each sweep with most methods, with auto after up to 20; a true answer stops the run. weights: a safetensors
    file for methods with weights. best_by: which 1/q enters the q̂ that says which mesh is the best: "shape" (1/q) or
    "aspect" (1/q_V, with which the paper's tables are formed). slide: whether nodes of boundaries, interfaces and line
    cells move along their curves, boundary nodes of volumes on their surface: None (they stay), True or "all", or names
    of markers whose nodes may. feature_angle: degrees; curves end, and edges of surfaces are sharp, where they turn by
    more. geometry: what to slide on instead of arcs through the input's nodes (docs/sliding.md). surface_tolerance: how
    far from the input's facets nodes of surfaces may go, over the mean length of their edges (default: 0.05; with a
    geometry without a bound). hausdorff: how far facets of surfaces, or of boundaries that slide, may go from the
    input's, over the diagonal of the box around it (default: 0.02, of volumes 0.01, and no less than nodes may go; with
    a geometry without a bound). free_needles: edges that look sharp only because a facet of a surface is thin are no
    features. update_normals: normals of faces and points, in the data of a surface and in the file that it was read
    from, are computed anew where nodes have moved (docs/surfaces.md).
    join_regions: regions mean nothing, so nodes of interfaces between them may move; those of markers there stay.
    device: "cpu", or "cuda": a GPU of NVIDIA does the sweeps that it can, with the same bits (docs/cuda.md).
    metric: the tensors of which the cells are to be unit cells, by shape and size (docs/metric.md): an array (N, 3) of
    m11, m12, m22 at the nodes, or a function from points (n, 2) to such an array. size: the same for lengths h of
    edges: an array (N,), or a function from points (n, 2) to one (n,); its metric is h⁻²·I.

    Raises InputError for what cannot be used, and where memory does not suffice, before anything is moved. A
    KeyboardInterrupt (Ctrl-C, or raised by the callback) reaches the caller; its attribute ``result`` is then the
    SmoothResult of the best mesh so far, or None if there is none yet, or a second one came before it was formed.
    """
    options = SmoothOptions(
        method=method, variant=variant, objective=objective, max_sweeps=max_sweeps, threads=threads,
        target_quality=target_quality, target_angle=target_angle, target_dihedral=target_dihedral,
        preserve=preserve, fix_layers=fix_layers, untangle=untangle, guard=guard, seed=seed, callback=callback,
        weights=weights, best_by=best_by, slide=slide, feature_angle=feature_angle, geometry=geometry,
        surface_tolerance=surface_tolerance, hausdorff=hausdorff, free_needles=free_needles,
        update_normals=update_normals, join_regions=join_regions, device=device, metric=metric, size=size,
    )  # fmt: skip
    return smooth_with(mesh, options, fixed)


def smooth_with(mesh: Any, options: SmoothOptions, fixed: Any = None) -> SmoothResult:
    """``smooth`` with options that have been checked already. mesh, fixed, errors: see there."""
    began = time.perf_counter()

    def work() -> State:
        smoother = options.smoother()
        with interruptible(), executor_for(options) as executor:
            state = carry_out(first_state(mesh, fixed, smoother, options, executor), options, executor)
            return replace(state, remarks=(*state.remarks, *executor.remarks()))

    return ended(work, lambda state: result_of(state, options, began))


def executor_for(options: SmoothOptions) -> AbstractContextManager[Executor]:
    """Who carries out the work, until the context ends."""
    return gpu(options.thread_count) if options.device == CUDA else workers(options.thread_count)


@interruptible()
def quality(mesh: Any) -> QualityReport:
    """The measures of a mesh's triangles and quads, or tetrahedra: arrays, or any object that ``smooth`` takes."""
    return measure(to_mesh(mesh)[0])
