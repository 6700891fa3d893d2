"""Distributions of measures over the cells of one or two meshes, as drawings within a page."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from gmsnet.measure.bins import bins_of
from gmsnet.page.contents import Contents
from gmsnet.page.markup import text

Floats = NDArray[np.float64]

WIDTH, HEIGHT = 520, 230
LEFT, RIGHT, TOP, BOTTOM = 46, 10, 12, 40  # around the drawing


def histograms(contents: Contents) -> str:
    """One drawing for each measure that says most."""
    after = contents.after
    if not len(after.cell):
        return ""
    low, high = after.angles
    space = low == "min_dihedral"
    kind = "dihedral angle" if space else "angle"
    names = [("shape", after.symbol), (low, f"smallest {kind} of a cell (°)"), (high, f"largest {kind} of a cell (°)")]
    if not space:
        names.pop()  # what it says is said by the smallest one
    return f'<div class="charts">{"".join(_figure(contents, *each) for each in names)}</div>'


def _figure(contents: Contents, name: str, label: str) -> str:
    columns = {state: report.column(name) for state, report in contents.reports.items()}
    states = {state: column[np.isfinite(column)] for state, column in columns.items()}
    if not all(len(each) for each in states.values()):
        return ""
    ends = bins_of(name, list(states.values()), contents.quads)
    shares = {state: 100.0 * np.histogram(each, ends)[0] / len(each) for state, each in states.items()}
    top = _round_up(max(float(share.max()) for share in shares.values()))
    worst = "largest" if name == "max_dihedral" else "smallest"
    extremes = {state: float(each.max() if name == "max_dihedral" else each.min()) for state, each in states.items()}
    shapes = "".join(_curve(state, share, top) + _mark(state, extremes[state], ends) for state, share in shares.items())
    said = "; ".join(f"{worst} {state}: {value:.4g}" for state, value in extremes.items())
    key = "".join(f'<li class="{state}">{state}: {worst} {value:.4g}</li>' for state, value in extremes.items())
    return (
        f'<figure class="chart"><svg viewBox="0 0 {WIDTH} {HEIGHT}" role="img" '
        f'aria-label="{text(f"Histogram of {label} over all cells; {said}")}">'
        f"{_axes(ends, top)}{shapes}</svg>"
        f'<figcaption>{text(label)}: share of cells (%) <ul class="key">{key}</ul></figcaption></figure>'
    )


def _x(value: float, ends: Floats) -> float:
    share = (value - ends[0]) / (ends[-1] - ends[0])
    return float(LEFT + min(max(share, 0.0), 1.0) * (WIDTH - LEFT - RIGHT))


def _y(share: float, top: float) -> float:
    return float(HEIGHT - BOTTOM - share / top * (HEIGHT - TOP - BOTTOM))


def _curve(state: str, shares: Floats, top: float) -> str:
    """The outline of the bars, filled."""
    x = np.linspace(LEFT, WIDTH - RIGHT, len(shares) + 1)
    y = [_y(share, top) for share in shares.tolist()]
    steps = "".join(f"V{y[k]:.1f}H{x[k + 1]:.1f}" for k in range(len(y)))
    return f'<path class="{state}" d="M{LEFT} {HEIGHT - BOTTOM}{steps}V{HEIGHT - BOTTOM}"/>'


def _mark(state: str, value: float, ends: Floats) -> str:
    """A triangle at the worst value."""
    x, y = _x(value, ends), HEIGHT - BOTTOM
    return f'<path class="mark {state}" d="M{x:.1f} {y - 1}l5 -9h-10z"/>'


def _axes(ends: Floats, top: float) -> str:
    lines = []
    for share in (0.0, 0.5 * top, top):
        y = _y(share, top)
        lines.append(f'<line class="rule" x1="{LEFT}" x2="{WIDTH - RIGHT}" y1="{y:.1f}" y2="{y:.1f}"/>')
        lines.append(f'<text x="{LEFT - 6}" y="{y + 4:.1f}" text-anchor="end">{share:g}</text>')
    for value in _ticks(ends):
        x = _x(value, ends)
        lines.append(f'<text x="{x:.1f}" y="{HEIGHT - BOTTOM + 18}" text-anchor="middle">{value:g}</text>')
    return "".join(lines)


def _ticks(ends: Floats) -> Sequence[float]:
    step = _round_up((ends[-1] - ends[0]) / 8)
    first = int(np.ceil(ends[0] / step - 1e-9))
    return [round(k * step, 10) + 0.0 for k in range(first, int(np.floor(ends[-1] / step + 1e-9)) + 1)]


def _round_up(value: float) -> float:
    """The next of 1, 2, 5, 10, … times a power of ten."""
    power = 10.0 ** np.floor(np.log10(max(value, 1e-9)))
    return float(next(factor * power for factor in (1.0, 2.0, 5.0, 10.0) if factor * power >= value * (1 - 1e-12)))
