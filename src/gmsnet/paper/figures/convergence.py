"""How fast each method improves a case: by sweeps and by time."""

from __future__ import annotations

from gmsnet import plot
from gmsnet.paper import convergence
from gmsnet.paper.contenders import papers
from gmsnet.paper.figures.picture import Drawn
from gmsnet.paper.units import Context

COLOURS = ("#e69f00", "#56b4e9", "#009e73", "#999999", "#d55e00", "#cc79a7", "#0b3d91")  # told apart by all eyes
MEASURES = {"qhat": "weighted metric q̂ (with 1/q_V)", "mean_shape": "mean 1/q"}
FIRST = 30  # sweeps are shown; little happens later


def draw(context: Context) -> Drawn:
    """For each case two measures by sweeps and by time."""
    figure = plot.new_figure(15.0, 7.6)
    axes = figure.subplots(len(convergence.SHOWN), 4)
    for row, case in zip(axes, convergence.SHOWN, strict=True):
        found = context.store.load(convergence.name(case))["records"]
        for place, (measure, label) in enumerate(MEASURES.items()):
            by_sweep, by_time = row[2 * place : 2 * place + 2]
            for contender, colour in zip(papers(), COLOURS, strict=True):
                record = found[contender.key]
                style = {"color": colour, "lw": 1.6, "label": contender.label}
                by_sweep.plot(range(len(record[measure])), record[measure], **style)
                by_time.plot([1e3 * s for s in record["seconds"][1:]], record[measure][1:], marker=".", ms=3, **style)
            values = [value for record in found.values() for value in record[measure][1:]]
            low, high = min(values), max(values)
            for each in (by_sweep, by_time):
                each.set_ylim(low - 0.05 * (high - low), high + 0.05 * (high - low))
            by_sweep.set_xlim(0, min(FIRST, context.plan.sweeps))
            by_time.set_xscale("log")
            by_sweep.set_ylabel(f"{case.capitalize()}: {label}")
            by_sweep.set_xlabel("sweeps")
            by_time.set_xlabel("milliseconds (compiled, one thread)")
            for each in (by_sweep, by_time):
                each.spines[["top", "right"]].set_visible(False)
    handles, labels = axes[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper center", ncols=len(labels), frameon=False)
    caption = (
        "The mesh after each sweep (not the best so far), by sweeps and by time of the processor, for the compiled "
        "methods on one thread; the time includes measuring the mesh after each sweep, which is the same for all. "
        "All lines come from the mesh before, which lies below the pictures. A sweep of GETMe is as many "
        "element steps as move about as many nodes as there are. The paper has no such figure."
    )
    return Drawn(figure, caption)
