"""What of a mesh is there on purpose and stays: stretched layers, and the sizes of cells."""

from __future__ import annotations

from gmsnet.arguments import NONE, SIZE
from gmsnet.errors import InputError
from gmsnet.layers import stretched_layers
from gmsnet.mesh import Mesh
from gmsnet.targets import Target
from gmsnet.topology import Topology

LAYER = "stretched layer"


def protected(mesh: Mesh, topology: Topology, preserve: str, fix_layers: bool) -> tuple[Topology, list[str]]:
    """The topology with the nodes of stretched layers held where that is asked for, and what to say about layers."""
    if not len(topology.free):
        return topology, []
    layers = stretched_layers(mesh, topology)
    if not layers:
        return topology, ["fix_layers: no stretched layers were found, so none are held"] if fix_layers else []
    if preserve == NONE and not fix_layers:
        return topology, [f"{layers.summary}; nothing is held for that (preserve={preserve!r})"]
    inner = topology.holding(layers.nodes, LAYER)
    count = len(inner.held.get(LAYER, ()))
    why = "fix_layers" if fix_layers else f"preserve={preserve!r}"
    return inner, [f"{layers.summary}; {count:,} nodes are held for that ({why})"]


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
