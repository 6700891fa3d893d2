"""Four meshes of the training set beside the meshes that label them."""

from __future__ import annotations

import numpy as np

from gmsnet import plot
from gmsnet.learn import data
from gmsnet.learn.labels import END, optimised
from gmsnet.paper.figures.picture import Drawn
from gmsnet.paper.units import Context

SHOWN = 4


def draw(context: Context) -> Drawn:
    """Of the twelve training meshes four that differ in density, from few nodes to many."""
    training = sorted(data.meshes(0)[: data.SPLIT[0]], key=lambda mesh: len(mesh.points))
    chosen = [training[k] for k in np.linspace(0, len(training) - 1, SHOWN).round().astype(int)]
    figure = plot.new_figure(13.0, 7.0)
    axes = figure.subplots(2, SHOWN)
    for column, mesh in enumerate(chosen):
        context.go_on()
        (label,) = optimised(mesh, (END,))
        side = float(np.ptp(mesh.points[:, 0]))
        before, after = plot.View.of(mesh), plot.View.of(label)
        top, bottom = axes[:, column]
        mappable = plot.draw(top, before)
        plot.draw(bottom, after)
        top.set_title(f"{len(mesh.points):,} nodes, side {side:.2g}\n{before.summary}", fontsize=9)
        bottom.set_title(f"label: {after.summary}", fontsize=9)
    plot.add_colour_bar(figure, mappable, axes.ravel())
    caption = (
        f"Above: {SHOWN} of the {data.SPLIT[0]} meshes that the networks are trained on, random Delaunay squares that "
        f"differ in size and density. Below: the same meshes after {END} sweeps of OptimSmoothing; these positions are "
        "the labels of NN-Smoothing, and GMSNet needs none. The paper's figure shows four such pairs, input to the "
        "left and label to the right."
    )
    return Drawn(figure, caption)
