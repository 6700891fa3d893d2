"""Why a run ended, as ``SmoothResult.stop_reason`` and the reports say it."""

MAX_SWEEPS = "max sweeps"
NO_PROGRESS = "no further gain"
TARGET_REACHED = "target reached"
CALLBACK = "stopped by callback"
INTERRUPTED = "interrupted"
NOTHING_TO_MOVE = "nothing to move"
