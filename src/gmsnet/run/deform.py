"""deform(): boundaries move, the inside follows."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import fields
from functools import partial
from typing import Any

from gmsnet.errors import InputError
from gmsnet.kernels.simplex.bernstein import NAMES
from gmsnet.measure.target import Target
from gmsnet.mesh.adapters import to_mesh
from gmsnet.mesh.mesh import Mesh
from gmsnet.mesh.selection import chosen_nodes
from gmsnet.motion.prescribed import Prescribed
from gmsnet.parallel.interrupts import interruptible
from gmsnet.parallel.threads import workers
from gmsnet.preserve.protection import METRIC
from gmsnet.run.call import ended
from gmsnet.run.deform_result import DeformResult
from gmsnet.run.deform_stage import move_boundary
from gmsnet.run.options import SmoothOptions
from gmsnet.run.outcome import result_of
from gmsnet.run.set_up import check_mesh, first_state
from gmsnet.run.stages import carry_out
from gmsnet.run.state import Motion, State
from gmsnet.run.sweep import MOST_SWEEPS, Sweep
from gmsnet.run.untangle_stage import untangle_all


def deform(
    mesh: Any,
    displacement: Any = None,
    nodes: Any = None,
    *,
    rotate: Any = None,
    places: Any = None,
    fixed: Any = None,
    preserve: str = "shape",
    fix_layers: bool = False,
    slide: Any = None,
    feature_angle: float = 30.0,
    guard: str = "worst",
    max_sweeps: int = MOST_SWEEPS,
    threads: int | None = None,
    callback: Callable[[Sweep], bool | None] | None = None,
) -> DeformResult:
    """Moves nodes of a mesh's boundary to new places; the nodes inside follow. Changes nothing but coordinates.

    No cell that is valid becomes inverted. At ``fraction`` 1 each node that is moved has the very coordinates asked
    for; else the mesh is that of the last valid step, and ``reason`` says what stood against the next one. All other
    nodes that ``smooth`` holds (boundary, interfaces, line cells, ``fixed``) stay. Layers and cells near refined walls
    keep their shapes as they are carried along; where other cells have lost more than a fifth of their 1/q, the mesh is
    smoothed around them as by ``smooth``.

    mesh: as for ``smooth``, in a plane or of volumes; first-order cells. displacement: one vector for all nodes that
    are moved, or one for each, in the order of ``nodes``: ids as given, those of a mask or a marker ascending. nodes:
    ids, a mask, a marker's name or a list of names; None: displacement has one row for each node of the mesh, and those
    that are not zero are moved.
    rotate: (nodes, degrees, (x, y)), or several of these: turns nodes counter-clockwise about a centre in the plane of
    the mesh, before they are displaced; of a volume (nodes, degrees, (x, y, z), axis (3,)), counter-clockwise for who
    looks against the axis. More than half a turn is told from this alone. places: new coordinates instead of a
    displacement, in the same forms. The other options are those of ``smooth``; slide: nodes of boundaries that are not
    moved follow along them, and slide as the mesh is smoothed.

    Raises InputError for what cannot be used, before anything is moved. KeyboardInterrupt: as for ``smooth``.
    """
    options = SmoothOptions(
        fix_layers=fix_layers, preserve=preserve, slide=slide, feature_angle=feature_angle, guard=guard,
        max_sweeps=max_sweeps, threads=threads, callback=callback,
    )  # fmt: skip
    given = to_mesh(mesh)[0]
    check_deformable(given)
    return deform_with(mesh, options, Prescribed.of(given, displacement, nodes, rotate, places), fixed)


def deform_with(mesh: Any, options: SmoothOptions, prescribed: Prescribed, fixed: Any = None) -> DeformResult:
    """``deform`` with a mesh, options and places that have been checked already. The rest: see there."""
    began = time.perf_counter()

    if options.preserve == METRIC:
        raise InputError("a metric is not carried along with boundaries: preserve must be 'shape', 'size' or 'none'")

    def work() -> State:
        smoother = options.smoother()
        _check_fixed(to_mesh(mesh)[0], fixed, prescribed)
        with interruptible(), workers(options.thread_count) as executor:
            state = first_state(mesh, fixed, smoother, options, executor, prescribed.moved)
            move = partial(move_boundary, prescribed=prescribed)
            return carry_out(state, options, executor, (untangle_all, move))

    return ended(work, lambda state: _result(state, options, began))


def check_deformable(mesh: Mesh) -> None:
    """InputError for meshes that cannot be deformed: curved surfaces, second-order cells."""
    check_mesh(mesh, Target(None, None))
    if mesh.plane is None and not mesh.has_volumes:
        raise InputError("boundaries of surfaces in space cannot be moved: deform takes volumes, and meshes in a plane")
    blocks = [block for block in mesh.cells if len(block.nodes)]
    kinds = sorted({
        block.kind for block in blocks if block.kind in NAMES or (block.dimension == 3 and block.cell.order > 1)
    })  # fmt: skip
    if kinds:
        raise InputError(
            f"the mesh has second-order cells ({', '.join(kinds)}): boundaries of first-order cells alone can be moved "
            "so far"
        )


def _check_fixed(mesh: Mesh, fixed: Any, prescribed: Prescribed) -> None:
    if fixed is None:
        return
    both = [node for node in chosen_nodes(mesh, fixed, "fixed").tolist() if prescribed.moved[node]]
    if both:
        raise InputError(f"fixed names the node {min(both)}, which is to be moved: leave it out of one of the two")


def _result(state: State, options: SmoothOptions, began: float) -> DeformResult:
    done, motion = result_of(state, options, began), state.motion or Motion(reason=state.stop_reason)
    known = {each.name: getattr(done, each.name) for each in fields(done)}
    known["compared"] = None  # the surface is elsewhere on purpose
    return DeformResult(**known, fraction=motion.fraction, steps=motion.steps, reason=motion.reason)
