"""What of a mesh is there on purpose and stays: stretched layers, and the sizes of cells."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gmsnet.arguments import NONE, SHAPE, SIZE
from gmsnet.errors import InputError
from gmsnet.layers import stretched_layers
from gmsnet.mesh import Mesh
from gmsnet.methods.sized import BAND
from gmsnet.targets import Target
from gmsnet.topology import Topology
from gmsnet.walls import near_walls

LAYER, WALL = "stretched layer", "refined near a wall"


@dataclass(frozen=True, eq=False)
class Protection:
    """topology: with the nodes held that are where they are on purpose. notes: what to say about that.

    kept: (N,) bool by id, the nodes next to walls that the mesh is refined towards, which move in a stage of their own
    (wall_stage.py); None where there are none. outer: the topology in which they are free.
    """

    topology: Topology
    notes: list[str]
    outer: Topology
    kept: NDArray[np.bool_] | None = None


def protected(mesh: Mesh, topology: Topology, preserve: str, fix_layers: bool) -> Protection:
    """What of a mesh is protected: stretched layers, unless ``preserve`` is "none" and fix_layers is false, and the
    areas of cells next to walls that the mesh is refined towards, unless ``preserve`` is "none".
    """
    notes: list[str] = []
    if not len(topology.free):
        return Protection(topology, notes, topology)
    layers = stretched_layers(mesh, topology)
    if layers and (fix_layers or preserve != NONE):
        topology = topology.holding(layers.nodes, LAYER)
        why = "fix_layers" if preserve == NONE else f"preserve={preserve!r}"
        notes.append(f"{layers.summary}; {_amount(len(topology.held.get(LAYER, ())))} held for that ({why})")
    elif layers:
        notes.append(f"{layers.summary}; nothing is held for that (preserve={preserve!r})")
    elif fix_layers:
        notes.append("fix_layers: no stretched layers were found, so none are held")
    if preserve != SHAPE:
        return Protection(topology, notes, topology)
    inner = topology.holding(kept := near_walls(mesh, topology), WALL)
    if WALL not in inner.held:
        return Protection(topology, notes, topology)
    notes.append(
        f"the mesh is refined towards its walls: the {len(inner.held[WALL]):,} nodes next to them move only as far as "
        f"the areas of their cells stay within {BAND:.0%} (preserve={preserve!r})"
    )
    return Protection(inner, notes, topology, kept)


def _amount(count: int) -> str:
    return f"{count:,} node is" if count == 1 else f"{count:,} nodes are"


def method_for(method: str, preserve: str, target: Target) -> str:
    """The method that keeps what is to be preserved.

    Raises InputError where the given one cannot.
    """
    if preserve != SIZE:
        return method
    if method not in ("auto", "sized"):
        raise InputError(f"{method} does not keep the sizes of cells: for preserve='size' use the method auto or sized")
    if target:
        raise InputError("a target and preserve='size' contradict each other: cells that miss it may need other sizes")
    return "sized"
