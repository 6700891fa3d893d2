"""What ``gmsnet smooth`` says about what it did, as text and as JSON."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from functools import cached_property
from itertools import groupby
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gmsnet.cli import output, report
from gmsnet.cli.destination import shown
from gmsnet.measure.target import Target
from gmsnet.mesh.display import amount, plain
from gmsnet.mesh.mesh import Mesh
from gmsnet.preserve.protection import LAYER
from gmsnet.run import stop
from gmsnet.run.result import SmoothResult
from gmsnet.run.sweep import Sweep

UNKNOWN = "not untangled, or untangling was off"


@dataclass(frozen=True, eq=False)
class Outcome:
    """A finished run.

    written: the file that was written, None where there was no need to. lost: by conversion. choice: variant, objective
    and weights as they were given, or None. compiled: the seconds of those of the result that went into compilation.
    """

    input: str
    written: str | None
    method: str
    mesh: Mesh
    result: SmoothResult
    target: Target
    lost: list[str]
    plot: str | None
    choice: Mapping[str, Any] = field(default_factory=dict)
    compiled: float = 0.0

    @property
    def least(self) -> float:
        """The minimum 1/q of a cell after smoothing; infinite where there are no triangles."""
        return float(self.result.after.shape.min(initial=math.inf))

    @cached_property
    def missed(self) -> NDArray[np.int64]:
        """Rows of the cells that miss the target as they are now, if any was asked for, the worst first."""
        after = self.result.after
        if not self.target:
            return np.empty(0, dtype=np.int64)
        missed = np.flatnonzero(self.target.missed(after.shape, after.min_angle))
        return missed[np.argsort(after.shape[missed], kind="stable")]

    @property
    def target_met(self) -> bool:
        """Whether the cells as they are now reach the target."""
        return not len(self.missed)

    def faults(self) -> list[str]:
        """What was asked for and is not so: cells that miss the target, cells that are inverted still."""
        faults = []
        if not self.target_met:
            faults.append(f"target not met: {self.shortfall()}")
        if self.result.after.inverted:
            faults.append(f"inverted still: {self.tangle()}")
        if count := self.result.invalid_curved:
            faults.append(f"invalid still: {amount(count, 'second-order cell')}")
        return faults

    def shortfall(self) -> str:
        """By how much the target is missed, and by which cells."""
        after = self.result.after
        figures, wanted = [], self.target
        if wanted.quality is not None and self.least < wanted.quality:
            gap = wanted.quality - self.least
            figures.append(f"the minimum 1/q is {self.least:.4g}, {gap:.4g} below {wanted.quality:g}")
        angle = float(after.min_angle.min(initial=math.inf))
        if wanted.angle is not None and angle < wanted.angle:
            figures.append(f"the minimum angle is {angle:.4g}°, {wanted.angle - angle:.4g}° below {wanted.angle:g}°")
        cells = self.missed[: report.NAMED]
        why = self.result.limits.reasons(cells, self.target.shape)
        miss = "misses it" if len(self.missed) == 1 else "miss it"
        reasons = "".join(f"\n  cell {after.cell[row]}: {why[row]}" for row in cells.tolist())
        return f"{'; '.join(figures)}; {report.named_cells(after, self.missed, miss)}{reasons}"

    def stages(self) -> list[tuple[str, int, Sweep]]:
        """What the method did one after the other, with how many sweeps, and the mesh then; empty if all was one."""
        found: list[tuple[str, int, Sweep]] = []
        begun = 0
        for stage, looks in groupby(self.result.history, key=lambda sweep: sweep.stage):
            *_, last = looks
            if stage:
                found.append((stage, last.index - begun, last))
            begun = last.index
        return found

    def nearness(self) -> str:
        """How near the minimum 1/q is to the most that it can be, as far as a bound is known."""
        bounds, symbol = self.result.limits, self.result.after.symbol
        if not len(bounds.bound):
            return f"no bound is known for the minimum {symbol}"
        return f"the minimum {symbol} is {self.least:.4g} and cannot exceed {bounds.ceiling:.4g}: {bounds.describe(0)}"

    def tangle(self) -> str:
        """Which cells are inverted still, where, and why as far as that is known."""
        after = self.result.after
        rows = np.flatnonzero(~after.valid)
        why = {cell.cell: cell.reason for cell in self.result.unmended}
        first = [
            f"cell {cell} at {' '.join(f'{value:.6g}' for value in centre)}: {why.get(cell, UNKNOWN)}"
            for cell, centre in zip(after.cell[rows].tolist(), after.centre[rows].tolist(), strict=True)
        ][: report.NAMED]
        more = f"; and {len(rows) - len(first):,} more" if len(rows) > len(first) else ""
        hint = "; stretched layers are held: --preserve none lets them move" if LAYER in self.result.held else ""
        cells = amount(len(rows), "cell")
        return f"{cells} (numbers from 0): {'; '.join(first)}{more}{hint}"

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
            if result.conformity is not None:
                console.print(report.conformity(result.conformity))
            console.print(f"\nworst cells{' now' if moved else ''} (numbers from 0)")
            console.print(report.worst_table(self.worst))
            console.print()
        if stages := self.stages():
            of = "quality" if self.result.conformity is not None else self.result.after.symbol
            console.print(report.stage_table(stages, bool(self.target), of))
            console.print()
        console.print(self.verdict())
        for note in self.result.notes:
            console.print(note)
        if len(result.after.cell) and self.free:
            console.print(self.nearness())
        if result.held and self.free:
            held = len(self.mesh.points) - self.free
            console.print(f"held: {held:,} of {amount(len(self.mesh.points), 'node')} ({self._reasons()})")
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
        if result.stop_reason == stop.NOTHING_TO_MOVE and self.free:
            return f"nothing to move: of the cells that miss the target all nodes are held ({self._reasons()})"
        if result.stop_reason == stop.NOTHING_TO_MOVE:
            return f"nothing to move: all {amount(len(self.mesh.points), 'node')} are held ({self._reasons()})"
        given = [self.choice.get(key) for key in ("variant", "objective", "weights")]
        method = " ".join([self.method, *(each for each in given if each is not None)])
        seconds = f"{plain(result.seconds - self.compiled)} s"
        if self.compiled:
            seconds += f" (and {plain(self.compiled)} s to compile kernels, once)"
        run = f"{method}, {amount(result.sweeps, 'sweep')} in {seconds}: {result.stop_reason}"
        if not result.moved.any():
            if result.stop_reason == stop.TARGET_REACHED and self.target_met:
                return "nothing was moved: the target is met already"
            return f"no gain: no mesh on the way was better than the input ({run})"
        return f"{int(result.moved.sum()):,} of {amount(self.free, 'free node')} moved ({run})"

    @property
    def free(self) -> int:
        """How many nodes could move."""
        return len(self.mesh.points) - sum(len(ids) for ids in self.result.held.values())

    def _reasons(self) -> str:
        return ", ".join(f"{reason}: {len(ids):,}" for reason, ids in self.result.held.items())

    def print_line(self, number: str) -> None:
        """What matters most, in one line."""
        before, after = self.result.before, self.result.after
        gain = "no cells to measure"
        if before.totals is not None and after.totals is not None:
            pairs = [(before.shape.min(), after.shape.min()), (before.shape.mean(), after.shape.mean())]
            least, mean = (f"{one:.4f} → {other:.4f}" for one, other in pairs)
            gain = f"{after.symbol} least {least}, mean {mean}"
        written = "not written" if self.written is None else self.written
        output.console().print(f"{number}{shown(self.input)}: {gain}; {self.verdict()}; {written}")

    def print_json(self, *, line: bool = False) -> None:
        """The whole outcome as one document."""
        output.print_json(self.document(), line=line)

    def document(self) -> dict[str, Any]:
        """The whole outcome as plain values."""
        result = self.result
        after, change = result.after, result.conformity
        return {
            "input": self.input,
            "output": self.written,
            "plot": self.plot,
            "method": self.method,
            **{key: self.choice.get(key) for key in ("variant", "objective", "weights")},
            "nodes": len(self.mesh.points),
            "cells": sum(len(block.nodes) for block in self.mesh.cells),
            "before": result.before.summary(),
            "after": after.summary(),
            "conformity": None if change is None else {k: v.summary() for k, v in change._asdict().items()},
            "improved": bool(result.moved.any()),
            "moved": int(result.moved.sum()),
            "free": self.free,
            "held": {reason: len(ids) for reason, ids in result.held.items()},
            "sweeps": result.sweeps,
            "stop_reason": result.stop_reason,
            "target_quality": self.target.quality,
            "target_angle": self.target.angle,
            "target_met": self.target_met if self.target else None,
            "below_target": len(self.missed),
            "ceiling": result.limits.ceiling,
            "notes": result.notes,
            "unmended": [cell._asdict() for cell in result.unmended],
            "worst": self.worst,
            "lost": self.lost,
            "history": [asdict(sweep) for sweep in result.history],
            "seconds": result.seconds,
            "seconds_compiling": self.compiled,
        }
