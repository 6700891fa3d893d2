"""What of a mesh is there on purpose and stays: stretched layers, and the sizes of cells."""

from __future__ import annotations

from gmsnet.arguments import NONE, SIZE
from gmsnet.errors import InputError
from gmsnet.layers import stretched_layers
from gmsnet.mesh import Mesh
from gmsnet.targets import Target
from gmsnet.topology import Topology
from gmsnet.walls import near_walls

LAYER, WALL = "stretched layer", "refined near a wall"


def protected(mesh: Mesh, topology: Topology, preserve: str, fix_layers: bool) -> tuple[Topology, list[str]]:
    """The topology with nodes held that are where they are on purpose, and what to say about that.

    Those are the nodes of stretched layers, unless ``preserve`` is "none" and fix_layers is false, and the nodes next
    to walls that the mesh is refined towards, unless ``preserve`` is "none".
    """
    notes: list[str] = []
    if not len(topology.free):
        return topology, notes
    layers = stretched_layers(mesh, topology)
    held = fix_layers or preserve != NONE
    if layers and held:
        topology = topology.holding(layers.nodes, LAYER)
        why = "fix_layers" if preserve == NONE else f"preserve={preserve!r}"
        notes.append(f"{layers.summary}; {_amount(topology, LAYER)} held for that ({why})")
    elif layers:
        notes.append(f"{layers.summary}; nothing is held for that (preserve={preserve!r})")
    elif fix_layers:
        notes.append("fix_layers: no stretched layers were found, so none are held")
    if preserve != NONE:
        topology = topology.holding(near_walls(mesh, topology), WALL)
        if WALL in topology.held:
            notes.append(
                f"the mesh is refined towards its walls: {_amount(topology, WALL)} held next to them "
                f"(preserve={preserve!r})"
            )
    return topology, notes


def _amount(topology: Topology, reason: str) -> str:
    count = len(topology.held.get(reason, ()))
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
