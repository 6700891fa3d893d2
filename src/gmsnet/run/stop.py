"""Why a run ended, as ``SmoothResult.stop_reason`` and the reports say it."""

MAX_SWEEPS = "max sweeps"
NO_PROGRESS = "no further gain"
TARGET_REACHED = "target reached"
CALLBACK = "stopped by callback"
INTERRUPTED = "interrupted"
NOTHING_TO_MOVE = "nothing to move"
IN_PLACE = "boundary in place"
NOT_IN_PLACE = "boundary not in place"


def by_target(reason: str, missed: int | None, *, swept: bool) -> str:
    """Why a run ended, once it is known how many cells miss the target: the stages see their own cells, or corners.

    missed: None without a target. swept: whether there were sweeps.
    """
    if missed is None or reason in (CALLBACK, INTERRUPTED):
        return reason
    if not missed:
        return TARGET_REACHED
    if reason == TARGET_REACHED:
        return NO_PROGRESS if swept else NOTHING_TO_MOVE
    return reason
