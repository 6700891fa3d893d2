"""The losses of a training as a table and as a picture."""

from __future__ import annotations

import io
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gmsnet.learn.trainee import Row
from gmsnet.plot import check_target, new_figure

HEADER = ",".join(("epoch", "network", *Row._fields)) + "\n"
MOST_LINEAR = 4.0  # largest ratio of what is shown to its smallest that is not shown on a logarithmic axis


def csv_bytes(history: Mapping[str, Sequence[Row]]) -> bytes:
    """For each epoch a row for each network."""
    rows = [
        f"{epoch},{name},{row.train_loss:.8g},{row.validation_loss:.8g},{row.validation_metric_loss:.8g},"
        f"{row.learning_rate:.6g}\n"
        for epoch, each in enumerate(zip(*history.values(), strict=True), start=1)
        for name, row in zip(history, each, strict=True)
    ]
    return (HEADER + "".join(rows)).encode()


def check_plotting() -> None:
    """Raises MissingExtraError where matplotlib is not installed, before any work."""
    check_target("curves.png")


def png_bytes(history: Mapping[str, Sequence[Row]], loss: str, marks: Mapping[str, float]) -> bytes:
    """The curves over the epochs; of a single network also that of the drawn nodes, and the marks as horizontal lines.

    loss: its name, for the axis.
    """
    figure = new_figure(7.0, 4.2)
    axes = figure.add_subplot()
    shown = list(marks.values())
    single = len(history) == 1
    for k, (name, rows) in enumerate(history.items()):
        epochs = range(1, len(rows) + 1)
        curve = [row.validation_loss for row in rows]
        shown += curve[len(rows) // 10 :]
        if single:
            drawn = [row.train_loss for row in rows]
            axes.plot(epochs, drawn, color="#e0a800", linewidth=0.5, label="training (drawn nodes)")
        colour, label = ("#173f7a", "validation") if single else (f"C{k}", name)
        axes.plot(epochs, curve, color=colour, linewidth=1.2, label=label)
    for (name, value), style in zip(marks.items(), (":", "--", "-."), strict=False):
        axes.axhline(value, color="black", linewidth=0.8, linestyle=style, label=f"{name} ({value:.4g})")
    _scale(axes, np.array(shown))
    axes.set_xlabel("epoch")
    axes.set_ylabel(loss if single else f"{loss}, validation")
    figure.legend(frameon=False, loc="outside upper center", ncols=2 if single else 4, fontsize="small")
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", dpi=150)
    return buffer.getvalue()


def _scale(axes: Any, shown: NDArray[np.float64]) -> None:
    """The range of the values that are shown, without those that are not finite."""
    shown = shown[np.isfinite(shown)]
    if not shown.size:
        return
    low, high = shown.min(), shown.max()
    if low > 0 and high / low > MOST_LINEAR:
        axes.set_yscale("log")
        axes.set_ylim(low / 1.2, high * 1.2)
    elif high > low:
        axes.set_ylim(low - 0.1 * (high - low), high + 0.15 * (high - low))
