"""The losses as surfaces over the position of the free node in one star."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from gmsnet import plot
from gmsnet.learn.backend import torch
from gmsnet.learn.losses import LOSSES
from gmsnet.learn.optimum import optimal_position
from gmsnet.paper.figures.picture import Drawn
from gmsnet.paper.units import Context

RING = np.array([[1.1, 0.0], [0.75, 0.8], [-0.35, 0.65], [-0.9, 0.1], [-0.45, -0.7], [0.35, -0.95]])
RINGS, SECTORS = 60, 240  # of the grid on which the losses are drawn
NEAREST = 0.995  # to the rim; on it cells are flat

Floats = NDArray[np.float64]
Axis = tuple[str, str, Callable[[Floats], Floats]]  # title, label of the axis, what is drawn of the loss
PANELS: dict[str, Axis] = {
    "q": ("aspect ratio", "log of the loss", np.log),
    "min-max-angle": ("min-max angle", "degrees", np.degrees),
    "cosine": ("cosine", "loss", np.asarray),
    "metric": ("MetricLoss", "loss", np.asarray),
}


def draw(context: Context) -> Drawn:
    """Four surfaces, each with its least point."""
    grid = _grid()
    positions = torch.as_tensor(grid.reshape(-1, 2))
    ring = torch.as_tensor(RING).expand(len(positions), -1, -1)
    degree = torch.full((len(positions),), len(RING))
    figure = plot.new_figure(13.0, 10.5)
    facts = {}
    for place, (name, (title, label, shown)) in enumerate(PANELS.items(), start=1):
        loss = LOSSES[name](ring, degree, positions).numpy().reshape(grid.shape[:2])
        height = shown(loss)
        axes = figure.add_subplot(2, 2, place, projection="3d")
        axes.plot_surface(
            grid[..., 0],
            grid[..., 1],
            height,
            rcount=RINGS,
            ccount=SECTORS // 2,
            cmap="viridis",
            linewidth=0.0,
            antialiased=False,
        )
        axes.set_title(title)
        axes.set_zlabel(label)
        axes.set_xticks([-1, 0, 1])
        axes.set_yticks([-1, 0, 1])
        axes.view_init(elev=28, azim=-60)
        facts[name] = {"least": float(loss.min()), "most": float(loss.max()), "rise": _rise(name)}
    rises = ", ".join(f"{PANELS[name][0]} {each['rise']:.0%}" for name, each in facts.items())
    caption = (
        "The mean loss of a star of six neighbours as its free node moves inside it (its rim is left out, where cells "
        "are flat). The aspect ratio loss is drawn as its logarithm: it grows without bound towards the rim; the other "
        "three are bounded. The min-max angle has creases and comes to a point, cosine loss and MetricLoss are round "
        f"at their minima. Rise at a tenth of the way to the rim, of that at half the way: {rises} (a cone has 20%, a "
        "parabola 4%). The paper shows the same four surfaces; it finds the aspect ratio unbounded and its own loss "
        "the smoothest, but calls the min-max angle flat near its minimum."
    )
    return Drawn(figure, caption, facts)


def _rise(name: str) -> float:
    """How much a loss rises on the first tenth of the way from its minimum to the rim, of what it does on the half.

    The mean over all directions.
    """
    ring, degree = torch.as_tensor(RING)[None], torch.tensor([len(RING)])
    least = optimal_position(ring, degree, LOSSES[name]).numpy()
    rim = _grid()[-1] / NEAREST
    places = np.stack([least + share * (rim - least) for share in (0.0, 0.1, 0.5)])
    flat = torch.as_tensor(places.reshape(-1, 2))
    values = LOSSES[name](ring.expand(len(flat), -1, -1), degree.expand(len(flat)), flat).numpy()
    start, near, half = values.reshape(3, -1).mean(axis=1)
    return float((near - start) / (half - start))


def _grid() -> Floats:
    """(RINGS × SECTORS + 1 × 2) positions inside the star: shares of the way from the centre to its rim."""
    corner = np.linspace(0.0, len(RING), SECTORS + 1)
    first = np.floor(corner).astype(int) % len(RING)
    along = (corner - np.floor(corner))[:, None]
    rim = (1.0 - along) * RING[first] + along * RING[(first + 1) % len(RING)]
    share = NEAREST * (1.0 - np.linspace(1.0, 0.0, RINGS) ** 2.5)  # closer together at the rim, where losses are steep
    grid: Floats = share[:, None, None] * rim[None]
    return grid
