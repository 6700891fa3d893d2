"""The default for a target (``target_quality``, ``target_angle``): the cells that miss it are smoothed alone.

See methods/below.py. Newton sweeps on Σq come before, where these cells are many.
"""

from __future__ import annotations

from gmsnet.measure.target import Target
from gmsnet.methods.auto import Auto
from gmsnet.methods.below import GENTLE, MANY, NEAR, WIDE, Below
from gmsnet.methods.below_in_space import BelowInSpace
from gmsnet.methods.phases import NEWTON, VOLUME_PLAN, WORST, Phase


def for_target(target: Target, share: float, *, rings: int, floor: float | None = None) -> Auto:
    """The plan for patches around the cells that miss a target. share: these, of the patches' cells.

    rings: of free nodes that move. With more than one, all of them move at first, for the cells that miss it; then come
    the worst cells alone, and another try that keeps these; with more than two, Newton's sweeps on Σq over the patches
    come before all.

    floor: in space, of D/S^(3/2) while dihedral angles gain (BelowInSpace); what is left there is left to sweeps over
    the cells that miss it, after one of Newton's where they are many.
    """
    plan = WIDE if rings > 1 else NEAR if target.angle is None else GENTLE
    many = share > MANY or rings > 2
    if floor is not None:
        in_space = Phase("cells that miss the target", lambda: BelowInSpace(target, floor, everywhere=rings > 1), 1)
        return Auto([VOLUME_PLAN[0], in_space] if many else [in_space])
    below = Phase("cells that miss the target", lambda: Below(target, plan, everywhere=False), 1)
    phases = [NEWTON._replace(looks=False)] if many else []
    if rings > 1:
        wide = below._replace(create=lambda: Below(target, plan, everywhere=True), looks=False)
        phases += [wide, WORST._replace(looks=False)]
    return Auto([*phases, below])
