"""What there is to say about a finished run, in words and as plain values."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass
from functools import cached_property
from itertools import groupby, islice
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gmsnet.constraints.options import TOLERANCE
from gmsnet.measure.target import Target
from gmsnet.measure.worst import NAMED, named_cells, worst_cells
from gmsnet.mesh.display import amount, miss_it, plain
from gmsnet.mesh.mesh import Mesh
from gmsnet.preserve.protection import LAYER
from gmsnet.run import stop
from gmsnet.run.result import Result, free_nodes
from gmsnet.run.sweep import Sweep

FAR = "the shape has changed by more than 2 %: where nodes leave tight curves, facets become chords"
BOUND = "a smaller --hausdorff binds these"
HELD_THERE = ", and a smaller --feature-angle, or --fix, holds nodes there"
NEAR = f"; with a --surface-tolerance below {TOLERANCE} nodes stay near the input's chords, and round bodies shrink"
UNKNOWN = "not untangled, or untangling was off"
FOLDED = "it is folded over, and where facets in space fold, their nodes are held as those of a sharp edge"
NO_AREA = "it has no area, and facets in space are not untangled: two of its corners are at one place, or all in a line"


@dataclass(frozen=True, eq=False)
class Account:
    """A finished run. mesh: that was smoothed. compiled: the seconds of the result's that went into compilation."""

    mesh: Mesh
    result: Result
    compiled: float = 0.0

    @property
    def target(self) -> Target:
        """What every cell was to reach."""
        asked = self.result.asked
        return Target(asked.get("target_quality"), asked.get("target_angle"), asked.get("target_dihedral"))

    @property
    def method(self) -> str:
        """The smoother, as it was asked for."""
        return str(self.result.asked.get("method", "auto"))

    @property
    def choice(self) -> dict[str, Any]:
        """What was asked of the smoother; None where nothing was."""
        return {key: self.result.asked.get(key) for key in ("variant", "objective", "weights")}

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
        missed = np.flatnonzero(self.target.missed(after.shape, after.column(after.angles[0])))
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
        angle = float(after.column(after.angles[0]).min(initial=math.inf))
        figures = self.target.shortfall(self.least, angle, after.symbol)
        cells = self.missed[:NAMED]
        why = self.result.limits.reasons(cells, self.target.shape)
        reasons = "".join(f"\n  cell {after.cell[row]}: {why[row]}" for row in cells.tolist())
        return f"{'; '.join(figures)}; {named_cells(after, self.missed, miss_it(len(self.missed)))}{reasons}"

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

    def stage_rows(self) -> list[list[str]]:
        """The same as rows of a table, the first of them its head: figures are of the cells with a free node, or of the
        patches that are smoothed for a target. Empty if all was one stage."""
        of = "quality" if self.result.conformity is not None else self.result.after.symbol
        where = "in the patches that are smoothed" if self.target else "cells with a free node"
        rows = [
            [
                name,
                f"{sweeps}",
                f"{sweep.min_shape:.4f}",
                f"{sweep.mean_shape:.4f}",
                "-" if math.isnan(sweep.qhat) else f"{sweep.qhat:.4f}",
            ]
            for name, sweeps, sweep in self.stages()
        ]
        return [[f"stage, {where}", "sweeps", f"{of}, least", f"{of}, mean", "q-hat"], *rows] if rows else []

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
        on_surface = self.mesh.plane is None and not self.mesh.has_volumes
        found = zip(after.cell[rows].tolist(), after.centre[rows].tolist(), after.shape[rows].tolist(), strict=True)
        first = list[str]()
        for cell, centre, shape in islice(found, NAMED):
            other = (FOLDED if shape < 0.0 else NO_AREA) if on_surface else UNKNOWN
            first.append(f"cell {cell} at {' '.join(f'{value:.6g}' for value in centre)}: {why.get(cell, other)}")
        more = f"; and {len(rows) - len(first):,} more" if len(rows) > len(first) else ""
        hint = "; stretched layers are held: --preserve none lets them move" if LAYER in self.result.held else ""
        cells = amount(len(rows), "cell")
        return f"{cells} (numbers from 0): {'; '.join(first)}{more}{hint}"

    @cached_property
    def held(self) -> NDArray[np.bool_]:
        """(N,) which nodes are held."""
        held = np.zeros(len(self.mesh.points), dtype=bool)
        for ids in self.result.held.values():
            held[ids] = True
        return held

    @cached_property
    def worst(self) -> list[dict[str, Any]]:
        """The worst cells after smoothing."""
        return worst_cells(self.mesh, self.result.after, self.held)

    def verdict(self) -> str:
        """One honest sentence on what was gained and why the run ended."""
        result = self.result
        if result.stop_reason == stop.NOTHING_TO_MOVE and self.free:
            return f"nothing to move: of the cells that miss the target all nodes are held ({self.reasons()})"
        if result.stop_reason == stop.NOTHING_TO_MOVE:
            return f"nothing to move: all {amount(len(self.mesh.points), 'node')} are held ({self.reasons()})"
        method = " ".join([self.method, *(each for each in self.choice.values() if each is not None)])
        seconds = f"{plain(result.seconds - self.compiled)} s"
        if self.compiled:
            seconds += f" (and {plain(self.compiled)} s to compile kernels, once)"
        run = f"{method}, {amount(result.sweeps, 'sweep')} in {seconds}: {result.stop_reason}"
        if not result.moved.any():
            if result.stop_reason == stop.TARGET_REACHED and self.target_met:
                return "nothing was moved: the target is met already"
            if self.target:
                other = "without a target the worst cell would count first"
                return f"no gain: no mesh on the way was closer to the target than the input; {other} ({run})"
            return f"no gain: no mesh on the way was better than the input ({run})"
        return f"{int(result.moved.sum()):,} of {amount(self.free, 'free node')} moved ({run})"

    @property
    def free(self) -> int:
        """How many nodes could move."""
        return free_nodes(self.result)

    def surface(self) -> list[str]:
        """How far the surface has come from the input's, if one has changed."""
        change = self.result.surface_change
        if change is None:
            return []
        far = f"{FAR}; {BOUND}{HELD_THERE if self.mesh.has_volumes else ''}"
        if (self.result.asked.get("surface_tolerance") or TOLERANCE) < TOLERANCE:
            far += NEAR
        return [change.sentence(), *[far] * change.is_far]

    def reasons(self) -> str:
        """Why nodes are held, with how many of them; without those that were moved for all that, or before."""
        still = {reason: int(np.count_nonzero(~self.result.moved[ids])) for reason, ids in self.result.held.items()}
        return ", ".join(f"{reason}: {count:,}" for reason, count in still.items() if count)

    def document(self) -> dict[str, Any]:
        """The whole outcome as plain values."""
        result = self.result
        after, change = result.after, result.conformity
        return {
            "method": self.method,
            **self.choice,
            "nodes": len(self.mesh.points),
            "cells": sum(len(block.nodes) for block in self.mesh.cells),
            "before": result.before.summary(),
            "after": after.summary(),
            "surface": None if result.surface_change is None else result.surface_change.summary(),
            "conformity": None if change is None else {k: v.summary() for k, v in change._asdict().items()},
            "judged": result.judged.summary(),
            "improved": bool(result.moved.any()),
            "moved": int(result.moved.sum()),
            "free": self.free,
            "held": {reason: len(ids) for reason, ids in result.held.items()},
            "sweeps": result.sweeps,
            "stop_reason": result.stop_reason,
            "target_quality": self.target.quality,
            "target_angle": self.target.angle,
            "target_dihedral": self.target.dihedral,
            "target_met": self.target_met and not result.invalid_curved if self.target else None,
            "below_target": len(self.missed),
            "ceiling": result.limits.ceiling,
            "notes": result.notes,
            "unmended": [cell._asdict() for cell in result.unmended],
            "worst": self.worst,
            "history": [asdict(sweep) for sweep in result.history],
            "seconds": result.seconds,
            "seconds_compiling": self.compiled,
        }
