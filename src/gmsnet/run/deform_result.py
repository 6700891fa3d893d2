"""What ``deform`` returns, and what there is to say about it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from gmsnet.mesh.display import amount, plain
from gmsnet.mesh.mesh import Mesh
from gmsnet.run.account import Account
from gmsnet.run.smooth_result import SmoothResult


@dataclass(frozen=True, eq=False, repr=False)
class DeformResult(SmoothResult):
    """What ``deform`` returns: a SmoothResult, and how far the boundary has come.

    fraction: of its way, 1.0 where all nodes are at the places asked for. steps: in so many. reason: why it has not
    come further, "" where it has.
    """

    fraction: float = 0.0
    steps: int = 0
    reason: str = ""

    _function = "deform"

    def _account(self, mesh: Mesh) -> Account:
        return MovedAccount(mesh, self)

    @property
    def _remarks(self) -> list[str]:
        return [self.verdict, *super()._remarks]

    @property
    def verdict(self) -> str:
        """How far the boundary has come, in a sentence."""
        steps = f"in {self.steps} step{'s' if self.steps != 1 else ''}"
        if self.fraction == 1.0:
            return f"the boundary is in place ({steps})"
        far = f"{100.0 * self.fraction:.4g} % of its way" if self.fraction else "no part of its way"
        return f"the boundary has come {far} ({steps}): {self.reason}"


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
