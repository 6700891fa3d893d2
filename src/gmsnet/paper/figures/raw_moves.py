"""What the network does to meshes without truncation: after 1 and 10 epochs, and after its full training."""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from gmsnet import plot, weights
from gmsnet.learn import checkpoint, data, raw
from gmsnet.learn.checkpoint import Member
from gmsnet.learn.model import GMSNet
from gmsnet.learn.options import TrainOptions
from gmsnet.learn.train import train
from gmsnet.mesh.mesh import Mesh
from gmsnet.paper.figures.picture import Drawn
from gmsnet.paper.units import Context
from gmsnet.topology.topology import Topology

EPOCHS = (1, 10)
QUICK = 2  # meshes of each kind that are counted in a quick run, the smallest ones


@dataclass(frozen=True)
class Snapshot:
    """The network at some point of its training."""

    title: str
    net: GMSNet


def draw(context: Context) -> Drawn:
    """A training mesh and a test mesh, raw and truncated, at each snapshot; counts over all meshes of each kind."""
    meshes = data.meshes(0)
    first, second, _ = data.SPLIT
    kinds = {"training": meshes[:first], "test": meshes[first + second :]}
    if context.plan.quick:
        kinds = {kind: sorted(those, key=lambda each: len(each.points))[:QUICK] for kind, those in kinds.items()}
    snapshots = [Snapshot(f"after {n} epoch{'s' * (n > 1)}", _after(n, context.plan.seed)) for n in EPOCHS]
    snapshots.append(Snapshot("after the full training", GMSNet.from_tensors(weights.load().tensors)))
    figure = plot.new_figure(12.0, 16.5)
    axes = figure.subplots(4, len(snapshots))
    facts: dict[str, Any] = {}
    for row, (kind, those) in enumerate(kinds.items()):
        mesh = min(those, key=lambda each: len(each.points))
        topology = Topology.of(mesh)
        for column, snapshot in enumerate(snapshots):
            context.go_on()
            for below, truncate in enumerate((False, True)):
                moved = raw.sweep(snapshot.net, mesh, truncate=truncate, topology=topology)
                view = plot.View.of(moved.mesh, topology=topology)
                where = axes[2 * row + below, column]
                mappable = plot.draw(where, view)
                how = "truncated" if truncate else "raw"
                cells = f"{view.report.inverted:,} of {len(view.corners):,} cells inverted"
                where.set_title(f"{kind} mesh {snapshot.title}, {how}:\n{cells}", fontsize=9)
            facts.setdefault(kind, {})[snapshot.title] = _count(snapshot.net, those)
    plot.add_colour_bar(figure, mappable, axes.ravel(), shrink=0.5)
    counts = "; ".join(_sentence(kind, facts[kind], snapshots) for kind in kinds)
    caption = (
        "One sweep of GMSNet over a mesh of the training set and one of the test set, with raw shifts and with "
        "truncated ones, after 1 and 10 epochs and after the full training; inverted cells are red. Shifts that "
        f"would leave a negative triangle, in one truncated sweep over all meshes of each kind: {counts}. The paper's "
        "figure shows raw shifts after 1 and 10 epochs: a large part of the shifts invert after the first, some highly "
        "distorted cells after the tenth."
    )
    return Drawn(figure, caption, facts)


def _count(net: GMSNet, meshes: Sequence[Mesh]) -> dict[str, int]:
    """Over all meshes: visits, shifts that would invert, and cells that raw shifts invert."""
    total = {"visits": 0, "inverting": 0, "cells": 0, "inverted": 0}
    for mesh in meshes:
        topology = Topology.of(mesh)
        held = raw.sweep(net, mesh, truncate=True, topology=topology)
        view = plot.View.of(raw.sweep(net, mesh, truncate=False, topology=topology).mesh, topology=topology)
        total["visits"] += held.visits
        total["inverting"] += held.inverting
        total["cells"] += len(view.corners)
        total["inverted"] += view.report.inverted
    return total


def _sentence(kind: str, facts: dict[str, dict[str, int]], snapshots: Sequence[Snapshot]) -> str:
    parts = [f"{facts[s.title]['inverting']:,} {s.title}" for s in snapshots]
    return f"of {facts[snapshots[0].title]['visits']:,} on the {kind} meshes {', '.join(parts)}"


def _after(epochs: int, seed: int) -> GMSNet:
    """The network as it is after so many epochs (not the best of them)."""
    options = TrainOptions(epochs=epochs, seed=seed)
    with tempfile.TemporaryDirectory() as folder:
        train(options, Path(folder))
        member = Member.of(GMSNet(options.hidden), options)
        checkpoint.restore(Path(folder), {"gmsnet": member})
    assert isinstance(member.net, GMSNet)
    return member.net
