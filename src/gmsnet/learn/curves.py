"""The losses of a training as a table and as a picture."""

from __future__ import annotations

import io
from collections.abc import Mapping, Sequence

from gmsnet.plot import check_target, new_figure

HEADER = "epoch,train_loss,validation_loss,learning_rate\n"


def csv_bytes(history: Sequence[tuple[float, float, float]]) -> bytes:
    """One row for each epoch: its number, training loss, validation loss, learning rate."""
    rows = (f"{k},{train:.8f},{val:.8f},{rate:.6g}\n" for k, (train, val, rate) in enumerate(history, start=1))
    return (HEADER + "".join(rows)).encode()


def check_plotting() -> None:
    """Raises MissingExtraError where matplotlib is not installed, before any work."""
    check_target("curves.png")


def png_bytes(history: Sequence[tuple[float, float, float]], marks: Mapping[str, float]) -> bytes:
    """Both curves over the epochs, and the marks as horizontal lines."""
    figure = new_figure(7.0, 4.2)
    axes = figure.add_subplot()
    epochs = range(1, len(history) + 1)
    axes.plot(epochs, [row[0] for row in history], color="#e0a800", linewidth=0.5, label="training (drawn nodes)")
    axes.plot(epochs, [row[1] for row in history], color="#173f7a", linewidth=1.2, label="validation")
    for (name, value), style in zip(marks.items(), (":", "--", "-."), strict=False):
        axes.axhline(value, color="black", linewidth=0.8, linestyle=style, label=f"{name} ({value:.4f})")
    low = min(*(row[1] for row in history), *marks.values())
    high = max(*(row[1] for row in history[-len(history) * 9 // 10 :]), *marks.values())
    axes.set_ylim(low - 0.1 * (high - low), high + 0.15 * (high - low))
    axes.set_xlabel("epoch")
    axes.set_ylabel("MetricLoss")
    axes.legend(frameon=False)
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", dpi=150)
    return buffer.getvalue()
