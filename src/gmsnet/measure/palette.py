"""The colours of measures, wherever they are shown."""

from __future__ import annotations

BEFORE, AFTER = "#e0a800", "#173f7a"  # two states of one mesh wherever they are compared
BAD_TO_GOOD = ["#ffd60a", "#e9c46a", "#8fb8a0", "#3f7fb5", "#103a80"]  # yellow … blue; also apart in grey print
INVERTED = "#d1001f"
OTHER_CELLS = "#e6e6e6"  # whose quality is not known
