"""The four cases before and after: the meshes, two networks side by side, and distributions of quality."""

from __future__ import annotations

from gmsnet import plot
from gmsnet.paper.cases import CASES
from gmsnet.paper.contenders import GMSNET, NN, papers_own
from gmsnet.paper.figures.picture import Drawn
from gmsnet.paper.units import Context
from gmsnet.plot import AFTER, BEFORE, View
from gmsnet.topology.topology import Topology

RUN = 0  # is shown
DETAIL = 60  # cells around the worst one


def draw_cases(context: Context) -> Drawn:
    """Each case before and after GMSNet."""
    shown = {case: _views(context, case, GMSNET) for case in CASES}
    figure = plot.new_figure(15.0, 16.0)
    axes = figure.subplots(4, len(shown))
    for column, (case, views) in enumerate(shown.items()):
        window = plot.surroundings(views[0], DETAIL)
        for row, view in enumerate(views):
            whole, detail = axes[row, column], axes[row + 2, column]
            mappable = plot.draw(whole, view, views[0].box)
            whole.set_title(f"{case.capitalize()}, {view.summary}", fontsize=9)
            plot.frame(whole, window)
            plot.draw(detail, view, window)
            detail.set_title(f"{case.capitalize()}, {view.title}: around the worst cell before", fontsize=9)
            detail.spines[:].set_visible(True)
    plot.add_colour_bar(figure, mappable, axes.ravel(), shrink=0.5)
    caption = (
        "The cases before and after smoothing by GMSNet, whole and in detail, cells coloured by 1/q from yellow (bad) "
        "to blue (good). Square and circle have random nodes; airfoil and pipe are good meshes, disturbed. The "
        "paper's figure shows the same pairs in the same colours: yellow cells all over before, and after it blue "
        "meshes, with yellow left where square and circle have a bad connectivity."
    )
    return Drawn(figure, caption)


def draw_networks(context: Context) -> Drawn:
    """Square and pipe before, after NN-Smoothing and after GMSNet."""
    chosen = ("square", "pipe")
    figure = plot.new_figure(13.5, 9.0)
    axes = figure.subplots(len(chosen), 3)
    for row, case in enumerate(chosen):
        before, by_nn = _views(context, case, NN)
        views = (before, by_nn, _views(context, case, GMSNET)[1])
        for column, (view, name) in enumerate(zip(views, ("before", NN, GMSNET), strict=True)):
            mappable = plot.draw(axes[row, column], view, before.box)
            text = view.summary.removeprefix("before:  ").removeprefix("after:  ")
            axes[row, column].set_title(f"{case.capitalize()}, {name}:  {text}", fontsize=9)
    plot.add_colour_bar(figure, mappable, axes.ravel())
    caption = (
        "Square and pipe before smoothing, after NN-Smoothing and after GMSNet; colours as above. The paper finds the "
        "two nearly identical, with a slightly better distribution of mesh density for GMSNet."
    )
    return Drawn(figure, caption)


def draw_distributions(context: Context) -> Drawn:
    """How the cells' 1/q_V are distributed before and after GMSNet."""
    figure = plot.new_figure(12.0, 7.0)
    axes = figure.subplots(2, 2).ravel()
    for each, case in zip(axes, CASES, strict=True):
        plot.histogram(each, _views(context, case, GMSNET), "aspect", "1/q_V")
        each.set_title(case.capitalize())
    caption = (
        "The distribution of 1/q_V over the cells of each case before and after smoothing by GMSNet. The paper's "
        "histograms show the same: the share of good cells grows strongly on all four cases, and hardly a bad one is "
        "left on airfoil and pipe."
    )
    return Drawn(figure, caption)


def _views(context: Context, case: str, printed: str) -> tuple[View, View]:
    """The mesh of a case before and after one of the paper's methods."""
    context.go_on()
    mesh = CASES[case].mesh(RUN, context.plan.seed)
    result = papers_own(printed).smooth(mesh, context.plan.sweeps)
    topology = Topology.of(mesh)
    return View.of(mesh, "before", BEFORE, topology), View.of(result.mesh, "after", AFTER, topology)
