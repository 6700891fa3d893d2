"""What of a mesh is there on purpose and stays: stretched layers, and the sizes of cells."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from gmsnet.errors import InputError
from gmsnet.measure.report import SHAPE
from gmsnet.measure.target import Target
from gmsnet.mesh.mesh import Mesh
from gmsnet.methods.sized import BAND
from gmsnet.preserve.anchored import split
from gmsnet.preserve.layers import stretched_layers
from gmsnet.preserve.survey import Survey
from gmsnet.preserve.walls import near_walls
from gmsnet.topology.topology import Topology
from gmsnet.topology.volume import Volume

SIZE, NONE = "size", "none"
PRESERVE = (SHAPE, SIZE, NONE)

Flags = NDArray[np.bool_]
Floats = NDArray[np.float64]

LAYER, WALL = "stretched layer", "refined near a wall"


@dataclass(frozen=True, eq=False)
class Protection:
    """What of a mesh is there on purpose. notes: what to say about that.

    base: the topology without any. layers: (N,) bool by id, the nodes that are held on account of stretched layers.
    kept: (N,) bool by id, the nodes next to walls that the mesh is refined towards, which move in a stage of their own
    (wall_stage.py). None where there are none.
    """

    base: Topology | Volume
    notes: list[str]
    layers: Flags | None = None
    kept: Flags | None = None

    @cached_property
    def outer(self) -> Topology | Volume:
        """The topology with the nodes of layers held."""
        return self.base if self.layers is None else self.base.holding(self.layers, LAYER)

    @cached_property
    def topology(self) -> Topology | Volume:
        """The topology with all of them held."""
        return self.outer if self.kept is None else self.outer.holding(self.kept, WALL)

    def released(self, nodes: Flags) -> Protection | None:
        """Without these nodes (N,) by id; None if none of them is protected."""
        layers, kept = (None if held is None else held & ~nodes for held in (self.layers, self.kept))
        count = len(set(self.base.free[nodes[self.base.free]].tolist()) - set(self.topology.free.tolist()))
        if not count:
            return None
        note = f"{_amount(count)} let go again, for cells beside them were inverted"
        return Protection(self.base, [*self.notes, note], layers, kept)


def protected(mesh: Mesh, topology: Topology, preserve: str, fix_layers: bool, near: Floats) -> Protection:
    """What of a mesh is protected: stretched layers of walls, unless ``preserve`` is "none", and the areas of cells
    next to walls that the mesh is refined towards, unless ``preserve`` is "none". fix_layers: all cells that are
    stretched alike, whatever ``preserve`` is.

    near: ``near_points(mesh, topology)``.
    """
    notes: list[str] = []
    if not len(topology.free):
        return Protection(topology, notes)
    survey = Survey.of(mesh, topology, near)
    found, elsewhere = stretched_layers(mesh, topology, survey), None
    if found and not fix_layers:
        found, elsewhere = split(mesh, topology, survey, found)
    layers = found.nodes if found and (fix_layers or preserve != NONE) else None
    protection = Protection(topology, notes, layers)
    if layers is not None:
        why = "fix_layers" if preserve == NONE else f"preserve={preserve!r}"
        mend = "leave fix_layers out" if fix_layers else "preserve='none' lets them move"
        amount = _amount(len(protection.outer.held.get(LAYER, ())))
        notes.append(f"{found.summary}; {amount} held for that ({why}); if it is not meant, {mend}")
    elif found:
        notes.append(f"{found.summary}; nothing is held for that (preserve={preserve!r})")
    if elsewhere:
        notes.append(f"{elsewhere.away_from_walls}; if they are meant, fix_layers holds them")
    if fix_layers and not found:
        notes.append("fix_layers: no stretched layers were found, so none are held")
    if preserve != SHAPE:
        return protection
    outer = protection.outer
    assert isinstance(outer, Topology)
    kept = near_walls(mesh, outer, survey)
    walled = Protection(topology, notes, layers, kept)
    return walled if kept.any() and WALL in walled.topology.held else protection


def wall_note(nodes: int, moved: bool) -> str:
    """What to say of so many nodes next to walls that the mesh is refined towards. moved: in a stage of their own."""
    so = (
        f"move only as far as the areas of their cells stay within {BAND:.0%} of the input's"
        if moved
        else "are held in this run"
    )
    mend = "" if moved else "; preserve='none' lets them move"
    return f"the mesh is refined towards its walls: the {nodes:,} nodes next to them {so} (preserve={SHAPE!r}){mend}"


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
