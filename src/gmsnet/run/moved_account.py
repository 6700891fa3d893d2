"""What there is to say about a finished run of ``deform``."""

from __future__ import annotations

from typing import Any

from gmsnet.mesh.display import amount, plain
from gmsnet.run.account import Account
from gmsnet.run.deform import DeformResult


class MovedAccount(Account):
    """A finished run of ``deform``."""

    @property
    def motion(self) -> DeformResult:
        """The result, as what it is."""
        assert isinstance(self.result, DeformResult)
        return self.result

    def faults(self) -> list[str]:
        """That the boundary is not in place, and what ``Account`` tells."""
        there = self.motion.fraction == 1.0
        return [*([] if there else [f"not in place: {self.motion.verdict}"]), *super().faults()]

    def verdict(self) -> str:
        """How far the boundary has come, and what was smoothed."""
        result = self.motion
        seconds = f"{plain(result.seconds - self.compiled)} s"
        if self.compiled:
            seconds += f" (and {plain(self.compiled)} s to compile kernels, once)"
        smoothed = f"{amount(result.sweeps, 'sweep')} where shapes suffered: {result.stop_reason}"
        if not result.sweeps:
            smoothed = "nothing had to be smoothed" if result.fraction == 1.0 else "nothing was smoothed"
        return f"{result.verdict}; {amount(int(result.moved.sum()), 'node')} moved in {seconds}; {smoothed}"

    def document(self) -> dict[str, Any]:
        """The outcome as plain values."""
        result = self.motion
        return {
            **super().document(), "fraction": result.fraction, "steps": result.steps, "reason": result.reason,
        }  # fmt: skip
