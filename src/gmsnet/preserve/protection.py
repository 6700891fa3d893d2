"""What of a mesh is there on purpose and stays: stretched layers, and the sizes of cells."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from gmsnet.errors import InputError
from gmsnet.kernels.methods.bands import AREA, UPPER
from gmsnet.measure.report import SHAPE
from gmsnet.measure.signs import exact_signs
from gmsnet.measure.target import Target
from gmsnet.measure.volumes import exact_signs3
from gmsnet.mesh.mesh import Mesh
from gmsnet.methods.banded import Kept
from gmsnet.preserve.anchored import split
from gmsnet.preserve.columns import layers_of_volume
from gmsnet.preserve.layers import Layers, stretched_layers
from gmsnet.preserve.shared import Alone, Shared
from gmsnet.preserve.survey import Survey
from gmsnet.preserve.wall_edges import Beside
from gmsnet.preserve.walls import NEAR, near_walls
from gmsnet.topology.topology import Topology
from gmsnet.topology.volume import Volume

SIZE, METRIC, NONE = "size", "metric", "none"
PRESERVE = (SHAPE, SIZE, METRIC, NONE)

Flags = NDArray[np.bool_]
NO_LAYERS = "fix_layers: no stretched layers were found, so none are held"
Floats = NDArray[np.float64]

LAYER, WALL = "stretched layer", "refined near a wall"


@dataclass(frozen=True, eq=False)
class Protection:
    """What of a mesh is there on purpose. notes: what to say about that.

    base: the topology without any. layers: (N,) bool by id, the nodes that are held on account of stretched layers.
    walls: by id, the nodes next to walls that the mesh is refined towards, which move in a stage of their own
    (wall_stage.py), and how exactly their cells keep their areas. None where there are none. beside: the cells beside
    walls, where heights over these are to be compared.
    """

    base: Topology | Volume
    notes: list[str]
    layers: Flags | None = None
    walls: Kept | None = None
    beside: Beside | None = None

    @property
    def near_walls(self) -> Flags | None:
        """(N,) bool by id, the nodes of ``walls``."""
        return None if self.walls is None else self.walls.nodes

    @cached_property
    def outer(self) -> Topology | Volume:
        """The topology with the nodes of layers held."""
        return self.base if self.layers is None else self.base.holding(self.layers, LAYER)

    @cached_property
    def topology(self) -> Topology | Volume:
        """The topology with all of them held."""
        return self.outer if self.walls is None else self.outer.holding(self.walls.nodes, WALL)

    def released(self, nodes: Flags) -> tuple[Protection, str] | None:
        """Without these nodes (N,) by id, and what to say of that; None if none of them is protected."""
        layers = None if self.layers is None else self.layers & ~nodes
        walls = None if self.walls is None else self.walls._replace(nodes=self.walls.nodes & ~nodes)
        count = len(set(self.base.free[nodes[self.base.free]].tolist()) - set(self.topology.free.tolist()))
        if not count:
            return None
        note = f"{_amount(count)} let go again, for cells beside them were inverted"
        return Protection(self.base, self.notes, layers, walls), note


def protected(
    mesh: Mesh, topology: Topology, preserve: str, fix_layers: bool, near: Floats, *, firm: bool = False
) -> Protection:
    """What of a mesh is protected: stretched layers of walls, unless ``preserve`` is "none", and the areas of cells
    next to walls that the mesh is refined towards, if it is "shape". "metric" holds nothing: see run/metric_stage.py.
    fix_layers: all cells that are
    stretched alike, whatever ``preserve`` is.

    near: ``near_points(mesh, topology)``. firm: only nodes that are certainly meant, near walls those of cells without
    damage, in layers those that hang on nodes away from inverted cells.
    """
    if not len(topology.free):
        return Protection(topology, [])
    survey = Survey.of(mesh, topology, near)
    found, elsewhere = stretched_layers(mesh, topology, survey), None
    if found and not fix_layers:
        found, elsewhere = split(mesh, topology, survey, found)
    layers = found.nodes if found and (fix_layers or preserve not in (METRIC, NONE)) else None
    alone = Alone(topology)
    if firm and layers is not None:
        layers = _certain(layers, topology, exact_signs(near, topology.near, topology.near_orientation) > 0, alone)
    protection = _with_layers(topology, found, layers, preserve, fix_layers, alone)
    notes = protection.notes
    if elsewhere and preserve != METRIC:
        notes.append(f"{elsewhere.away_from_walls}; if they are meant, fix_layers holds them")
    if preserve != SHAPE:
        return protection
    outer = protection.outer
    assert isinstance(outer, Topology)
    walls, coarse = near_walls(mesh, outer, survey)
    walls = walls.firm if firm else walls
    notes.extend(_coarse(coarse))
    walled = Protection(topology, notes, layers, walls)
    last = walled if walls.nodes.any() and WALL in walled.topology.held else protection
    return replace(last, beside=Beside.of(topology.simplices, survey.beside, survey.rim))


def protected_volume(
    topology: Volume, preserve: str, fix_layers: bool, near: Floats, *, firm: bool, shared: Shared | None = None
) -> Protection:
    """The same of a mesh of volumes: its stretched layers. near: (N, 4). shared: with whom, of a part of a mesh."""
    shared = Alone(topology) if shared is None else shared
    found = layers_of_volume(topology, near, shared)
    layers = found.nodes if found and (fix_layers or preserve not in (METRIC, NONE)) else None
    if firm and layers is not None:
        positive = exact_signs3(near, topology.near, topology.near_orientation) > 0
        layers = _certain(layers, topology, positive, shared)
    return _with_layers(topology, found, layers, preserve, fix_layers, shared)


def _with_layers(
    topology: Topology | Volume, found: Layers, layers: Flags | None, preserve: str, fix_layers: bool, shared: Shared
) -> Protection:
    """The protection of layers and what to say of it. layers: (N,) by id, which nodes are to be held."""
    notes: list[str] = []
    protection = Protection(topology, notes, layers)
    if layers is not None:
        why = "fix_layers" if preserve in (METRIC, NONE) else f"preserve={preserve!r}"
        mend = "leave fix_layers out" if fix_layers else "preserve='none' lets them move"
        amount = _amount(shared.total(len(protection.outer.held.get(LAYER, ()))))
        notes.append(f"{found.summary}; {amount} held for that ({why}); if it is not meant, {mend}")
    elif found and preserve != METRIC:
        notes.append(f"{found.summary}; nothing is held for that (preserve={preserve!r})")
    if fix_layers and not found:
        notes.append(NO_LAYERS)
    return protection


def _certain(layers: Flags, topology: Topology | Volume, positive: Flags, shared: Shared) -> Flags:
    """Of the nodes of layers (N,) by id, those without an inverted cell, and those that share a layer's cell with one.

    positive: which of the simplices are. Beside inverted cells others may look like a layer by chance, or have been
    thrown out of one.
    """
    inside, bad = shared.spread(layers[topology.memory]), np.zeros(len(layers), dtype=bool)
    bad[topology.near[~positive]] = True
    bad = shared.spread(bad)
    if not shared.total(int(bad.any())):
        return layers
    core = inside & ~bad
    cells = topology.near[positive & inside[topology.near].all(axis=1)]
    certain = core.copy()
    certain[cells[core[cells].any(axis=1)]] = True
    certain = _in_place(shared.spread(certain), topology, positive, shared)
    found = np.zeros_like(layers)
    found[topology.memory[certain]] = True
    return found


def _in_place(certain: Flags, topology: Topology | Volume, positive: Flags, shared: Shared) -> Flags:
    """Of certain nodes (N,) by places, those that make no inverted cell with one another and with held ones.

    Of each such cell those nodes are left out, round by round, of whose cells the largest share is inverted.
    """
    free = shared.spread(topology.near_free)
    found = certain & free  # the others stay anyhow
    fixed = found | ~free
    rows = np.flatnonzero(fixed[topology.near].all(axis=1) & found[topology.near].any(axis=1))
    corners, inverted = topology.near[rows], ~positive[rows]
    while shared.total(int(inverted.any())):
        every, bad = (np.bincount(some.ravel(), minlength=len(found)) for some in (corners, corners[inverted]))
        share = shared.spread(np.where(found, bad / np.maximum(every, 1), 0.0))[corners[inverted]]
        found[corners[inverted][share == share.max(axis=1, keepdims=True)]] = False
        found = shared.spread(found)
        left = (found | ~free)[corners].all(axis=1)
        corners, inverted = corners[left], inverted[left]
    return found | (certain & ~free)


def wall_note(walls: Kept, nodes: int, moved: bool) -> str:
    """What to say of so many nodes next to walls that the mesh is refined towards. moved: in a stage of their own."""
    so = f"move only as far as the areas of their cells stay within {AREA:.0%} of the input's" if moved else ""
    if moved and walls.noisy:
        so += ", or between those and the mean of the areas around where the input is disturbed"
    calm = (walls.heights > 0.0) & (walls.blend == 0.0)
    if moved and calm.any():
        most = (1.0 + AREA) * UPPER ** walls.heights[calm].min() - 1.0
        so += f", and the heights of those on the wall within {most:.0%}{' where it is not' if walls.noisy else ''}"
    mend = "" if moved else "; preserve='none' lets them move"
    so = so or "are held in this run"
    return f"the mesh is refined towards its walls: the {nodes:,} nodes next to them {so} (preserve={SHAPE!r}){mend}"


def _coarse(walls: int) -> list[str]:
    """What to say of so many walls that the mesh is refined towards, but so coarsely that no cell is kept."""
    if not walls:
        return []
    which = "a wall" if walls == 1 else f"{walls} walls"
    so = f"cells on it are larger than {NEAR:.0%} of its diameter, and smoothed like others"
    return [f"the mesh is refined towards {which}, but {so}: preserve={SIZE!r} changes their heights less"]


def carried_note(nodes: int) -> str:
    """The same of nodes whose walls move."""
    return (
        f"the mesh is refined towards its walls: the {nodes:,} nodes next to them are carried along with them "
        f"(preserve={SHAPE!r}); preserve='none' lets them move on their own"
    )


def _amount(count: int) -> str:
    return f"{count:,} node is" if count == 1 else f"{count:,} nodes are"


def method_for(method: str, variant: str | None, preserve: str, target: Target) -> str:
    """The method that keeps what is to be preserved.

    Raises InputError where the given one cannot.
    """
    if preserve != SIZE:
        return method
    if method not in ("auto", "sized"):
        raise InputError(f"{method} does not keep the sizes of cells: for preserve='size' use the method auto or sized")
    if target:
        raise InputError("a target and preserve='size' contradict each other: cells that miss it may need other sizes")
    if variant is not None:
        raise InputError(f"preserve='size' has a method of its own, which has no variants: leave out {variant!r}")
    return "sized"
