"""What comes before the sweeps over ranks: what is there on purpose, and inverted cells mended."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gmsnet.constraints.sliding import REASON
from gmsnet.distributed.gathered import Whole
from gmsnet.distributed.intent import Look
from gmsnet.distributed.mending import Mended, inverted_in, mended
from gmsnet.distributed.on_first import Intent, intent_of
from gmsnet.distributed.on_ranks import OnRanks
from gmsnet.distributed.part import Part
from gmsnet.distributed.piece import Piece
from gmsnet.distributed.stages import Meant
from gmsnet.distributed.winding import Winding
from gmsnet.kernels.topology.places import places_in
from gmsnet.measure.report import SHAPE
from gmsnet.measure.totals import Totals
from gmsnet.methods.banded import Kept
from gmsnet.preserve.protection import LAYER, NO_LAYERS, NONE, WALL, protected_volume
from gmsnet.run.options import SmoothOptions
from gmsnet.topology.shell import Shell
from gmsnet.topology.volume import Volume

Floats = NDArray[np.float64]


def not_plain(part: Part, before: Totals | None) -> str:
    """Why the mesh cannot be shared out as it is; "" if it can."""
    topology, comm = part.topology, part.comm
    if before is None:
        return "no cell can be smoothed"
    winding = Winding(*comm.allreduce(np.array(Winding.of(topology))).tolist())
    if winding.unread:
        return "parts of the mesh, or facets that do not match, have to be seen whole"
    return "" if winding.alike else "cells are wound in both directions"


class Ready(NamedTuple):
    """What comes before the sweeps. why: they cannot be shared out, "" if they can. inverted: how many cells are;
    mended: what they have become, where they are mended first.
    """

    why: str
    intent: Intent = Intent()
    inverted: int = 0
    mended: Mended | None = None


def readied(
    piece: Piece, part: Part, options: SmoothOptions, before: Totals | None, known: Whole | None
) -> Ready:  # fmt: skip
    """What comes before the sweeps; called by all ranks alike. before: of the input. known: see ``gathered``."""
    why = not_plain(part, before)
    if why or before is None:
        return Ready(why)
    inverted = inverted_in(part) if before.uncertain else 0
    if isinstance(part.topology, Shell):  # sweeps bring back what shows the other side
        if inverted and options.target:
            return Ready("which cells miss the target is seen whole where some are inverted")
        return Ready("", inverted=inverted)
    intent = _intent(piece, part, options, known, None, firm=inverted > 0)
    if not inverted:
        return Ready("", intent)
    if not options.untangle:
        return Ready("inverted cells are to stay as they are")
    topology = meant(intent, piece, part).held
    if part.along is not None:
        topology = topology.holding(part.along.slides_at(part.around.nodes.ids), REASON)
    done = mended(part, topology, inverted)
    if done is None:
        return Ready("inverted cells could not be mended with what lies around them")
    return Ready("", _intent(piece, part, options, known, done.points, firm=False), inverted, done)


def _intent(
    piece: Piece, part: Part, options: SmoothOptions, known: Whole | None, points: Floats | None, *, firm: bool
) -> Intent:  # fmt: skip
    """What is there on purpose. points: see Mended, where inverted cells were mended; None as they are."""
    wanted = options.preserved != NONE or options.fix_layers
    if not wanted or not part.comm.allreduce(len(part.topology.free)):
        return Intent()
    at = part.topology.places[places_in(part.around.nodes.ids, piece.ids)]
    if isinstance(part.topology, Volume):
        near = part.points if points is None else points
        found = protected_volume(
            part.topology, options.preserved, options.fix_layers, near, firm=firm, shared=OnRanks(part)
        )
        layers = None if found.layers is None else part.halo.spread(found.layers[part.topology.memory])[at]
        return Intent(layers, notes=found.notes)
    look = Look.at(part, part.points if points is None else points, walls=options.preserved == SHAPE)
    beside = look.beside if points is None and not firm else None
    if not (look.layers or look.walls):
        return Intent(notes=(NO_LAYERS,) if options.fix_layers else (), beside=beside)
    now = None if points is None else points[at]
    return intent_of(piece, options, part.comm, known, now, part.along, firm=firm)._replace(beside=beside)


def meant(intent: Intent, piece: Piece, part: Part) -> Meant:
    """The connectivity of a part with the nodes held that are there on purpose."""
    topology, ids = part.topology, part.around.nodes.ids

    def on_part(values: NDArray[Any]) -> Floats:
        """(n,) by id of the part, of those at the nodes of the piece."""
        found = np.zeros(len(ids))
        found[places_in(ids, piece.ids)] = values
        return np.asarray(part.halo.spread(found[topology.memory])[topology.places])

    if intent.layers is not None:
        topology = topology.holding(on_part(intent.layers) > 0.0, LAYER)
    if intent.walls is None:
        return Meant(topology, topology)
    walls = Kept.of_columns([on_part(values) for values in intent.walls])
    return Meant(topology, topology.holding(walls.nodes, WALL), walls)
