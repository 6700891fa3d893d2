"""What ``gmsnet smooth`` says about what it did, as text and as JSON."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

from gmsnet import engine
from gmsnet.cli import output, report
from gmsnet.cli.target import shown
from gmsnet.engine import SmoothResult
from gmsnet.mesh import Mesh


@dataclass(frozen=True, eq=False)
class Outcome:
    """A finished run.

    written: the file that was written, None where there was no need to. lost: by conversion. choice: variant, objective
    and weights as they were given, or None.
    """

    input: str
    written: str | None
    method: str
    mesh: Mesh
    result: SmoothResult
    target: float | None
    lost: list[str]
    plot: str | None
    choice: Mapping[str, Any] = field(default_factory=dict)

    @property
    def least(self) -> float:
        """The least 1/q of a cell after smoothing; infinite where there are no triangles."""
        return float(self.result.after.shape.min(initial=math.inf))

    @property
    def target_met(self) -> bool:
        """Whether the cells as they are now reach the target quality, if any was asked for."""
        return self.target is None or self.least >= self.target

    def shortfall(self) -> str:
        """By how much the target is missed, and by which cells."""
        assert self.target is not None
        gap = self.target - self.least
        cells = report.below(self.result.after, self.target)
        return f"the least 1/q is {self.least:.4g}, {gap:.4g} below {self.target:g}; {cells}"

    @cached_property
    def worst(self) -> list[dict[str, Any]]:
        """The worst cells after smoothing."""
        held = np.zeros(len(self.mesh.points), dtype=bool)
        for ids in self.result.held.values():
            held[ids] = True
        return report.worst_cells(self.mesh, self.result.after, held)

    def print(self, aside: bool) -> None:
        """The tables; ``aside``: on standard error, because the mesh itself went to the standard output."""
        result, console = self.result, output.console(stderr=aside)
        moved = result.moved.any()
        console.print(f"{shown(self.input)}: {report.counts(self.mesh)}")
        if len(result.after.cell):
            console.print()
            console.print(report.figures({"before": result.before, "after": result.after}))
            console.print(f"\nworst cells{' now' if moved else ''} (numbers from 0)")
            console.print(report.worst_table(self.worst))
            console.print()
        console.print(self.verdict())
        if result.held and self.free:
            held = len(self.mesh.points) - self.free
            console.print(f"held: {held:,} of {report.amount(len(self.mesh.points), 'node')} ({self._reasons()})")
        if self.written is None:
            console.print(f"left as it is: {self.input}")
        elif not aside:
            console.print(f"written{'' if moved else ' unchanged'}: {self.written}")
        for loss in self.lost:
            console.print(f"lost in conversion: {loss}")
        if self.plot is not None:
            console.print(f"picture: {self.plot}")

    def verdict(self) -> str:
        """One honest sentence on what was gained and why the run ended."""
        result = self.result
        if result.stop_reason == engine.NOTHING_TO_MOVE:
            return f"nothing to move: all {report.amount(len(self.mesh.points), 'node')} are held ({self._reasons()})"
        given = [self.choice.get(key) for key in ("variant", "objective", "weights")]
        method = " ".join([self.method, *(each for each in given if each is not None)])
        run = f"{method}, {report.amount(result.sweeps, 'sweep')} in {result.seconds:.3g} s: {result.stop_reason}"
        if not result.moved.any():
            if result.stop_reason == engine.TARGET_REACHED and self.target_met:
                return "nothing was moved: the target is met already"
            return f"no gain: no mesh on the way was better than the input ({run})"
        return f"{int(result.moved.sum()):,} of {report.amount(self.free, 'free node')} moved ({run})"

    @property
    def free(self) -> int:
        """How many nodes could move."""
        return len(self.mesh.points) - sum(len(ids) for ids in self.result.held.values())

    def _reasons(self) -> str:
        return ", ".join(f"{reason}: {len(ids):,}" for reason, ids in self.result.held.items())

    def print_json(self) -> None:
        """The whole outcome as one document."""
        result = self.result
        after = result.after
        output.print_json(
            {
                "input": self.input,
                "output": self.written,
                "plot": self.plot,
                "method": self.method,
                **{key: self.choice.get(key) for key in ("variant", "objective", "weights")},
                "nodes": len(self.mesh.points),
                "cells": sum(len(block.nodes) for block in self.mesh.cells),
                "before": result.before.summary(),
                "after": after.summary(),
                "improved": bool(result.moved.any()),
                "moved": int(result.moved.sum()),
                "free": self.free,
                "held": {reason: len(ids) for reason, ids in result.held.items()},
                "sweeps": result.sweeps,
                "stop_reason": result.stop_reason,
                "target_quality": self.target,
                "target_met": self.target_met,
                "below_target": 0 if self.target is None else int((after.shape < self.target).sum()),
                "worst": self.worst,
                "lost": self.lost,
                "history": [asdict(sweep) for sweep in result.history],
                "seconds": result.seconds,
            }
        )
