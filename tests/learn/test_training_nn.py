"""NN-Smoothing through the loop that trains GMSNet."""

from __future__ import annotations

import csv
import json

import numpy as np
import pytest
import typer
from typer.testing import CliRunner

from gmsnet import weights
from gmsnet.cli import train as command
from gmsnet.errors import InputError
from gmsnet.learn import data
from gmsnet.learn import train as training
from gmsnet.learn.backend import torch
from gmsnet.learn.checkpoint import NAME
from gmsnet.learn.labels import labelled
from gmsnet.learn.losses import metric_loss
from gmsnet.learn.model_nn import NNSmoothing
from gmsnet.learn.options import NNOptions, options_for
from gmsnet.learn.train import Ending
from gmsnet.learn.train_nn import NNTrainee, Rings

FILES = {"nn.safetensors", "history.csv", "curves.png", NAME}
NETWORKS = [f"degree{n}" for n in range(3, 10)]
SHORT = NNOptions(epochs=12, nodes_per_mesh=8, patience=2, seed=3)


@pytest.fixture(autouse=True, scope="module")
def _small_meshes():
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(data, "NODES", (150, 300))  # fewer have no node of degree 3 or 9
        patch.setattr(training, "CHECKPOINT_EVERY", 3)
        yield


def contents(folder):
    return {path.name: path.read_bytes() for path in folder.iterdir()}


@pytest.fixture(scope="module")
def whole(tmp_path_factory, _small_meshes):
    """The files of a training with the options SHORT that nobody interrupted."""
    folder = tmp_path_factory.mktemp("whole")
    result = training.train(SHORT, folder)
    assert result.ending is Ending.FINISHED
    assert result.files[0].name == "nn.safetensors"
    return contents(folder)


@pytest.fixture(scope="module")
def trainee(_small_meshes):
    return NNTrainee(SHORT, data.meshes(0))


def test_files_and_history_of_seven_networks(tmp_path, whole):
    assert whole.keys() == FILES
    (tmp_path / "history.csv").write_bytes(whole["history.csv"])
    rows = list(csv.DictReader((tmp_path / "history.csv").read_text().splitlines()))
    assert [(int(row["epoch"]), row["network"]) for row in rows] == [(e, n) for e in range(1, 13) for n in NETWORKS]
    assert len({row["learning_rate"] for row in rows if row["epoch"] == "12"}) > 1  # each has a schedule of its own


def test_stopped_and_resumed_is_as_if_never_stopped(tmp_path, whole):
    epochs = []
    stopped = training.train(SHORT, tmp_path, on_epoch=epochs.append, should_stop=lambda: len(epochs) == 5)
    assert stopped.ending is Ending.STOPPED
    assert list(epochs[-1].rows) == NETWORKS
    training.train(SHORT, tmp_path, resume=True)
    assert contents(tmp_path) == whole


def test_the_best_of_each_network_is_kept(tmp_path, whole):
    (tmp_path / "nn.safetensors").write_bytes(whole["nn.safetensors"])
    loaded = weights.load(tmp_path / "nn.safetensors", model="nn")
    assert loaded.parameters == 4864 == int(loaded.metadata["parameters"])
    recipe = json.loads(loaded.metadata["recipe"])
    assert options_for(recipe.pop("model"), recipe) == SHORT
    assert loaded.metadata["command"] == (
        "gmsnet train --model nn --epochs 12 --nodes-per-mesh 8 --seed 3 --patience 2"
    )
    best = json.loads(loaded.metadata["validation_best_loss"])
    curves = json.loads(loaded.metadata["validation_curve"])
    parts = [labelled(mesh, "mesh") for mesh in data.meshes(0)[12:16]]
    model = NNSmoothing.from_tensors(loaded.tensors)
    total, count = 0.0, 0
    for name, degree in zip(NETWORKS, range(3, 10), strict=True):
        rings = Rings.of(degree, parts)
        with torch.no_grad():
            loss = float(rings.loss(model.of_degree(degree)(rings.ring)))
        assert loss == pytest.approx(best[name], rel=1e-5)
        assert loss == pytest.approx(min(value for _, value in curves[name]), rel=1e-4)
        total, count = total + loss * len(rings.ring), count + len(rings.ring)
    assert float(loaded.metadata["validation_loss"]) == pytest.approx(total / count, rel=1e-5)


def test_it_learns(tmp_path):
    result = training.train(NNOptions(labels="star", epochs=150), tmp_path)
    for rows in result.history.values():
        assert min(row.validation_loss for row in rows) < 0.3 * rows[0].validation_loss
    losses = result.losses
    for kind in ("validation", "test"):
        of_labels, after, before = (losses[f"{kind}_metric_loss{name}"] for name in ("_of_labels", "", "_before"))
        assert of_labels < after < before - 0.03


def test_rings_are_in_their_own_frame(trainee):
    parts = [labelled(mesh, "mesh") for mesh in data.meshes(0)[:12]]
    for degree, rings in trainee.rings["training"].items():
        assert sum(rings.sizes) == len(rings.ring) == sum((part.stars.degree == degree).sum() for part in parts)
        assert rings.ring.shape[1:] == (degree, 2)
        low, high = rings.ring.amin(dim=1), rings.ring.amax(dim=1)
        assert (low == 0).all()
        assert high.amax(dim=1).tolist() == pytest.approx([1.0] * len(high))
        assert (rings.centre > 0).all()  # a valid star has its node in the box of its ring
        assert (rings.centre < high).all()
    star = Rings.of(6, [labelled(mesh, "star") for mesh in data.meshes(0)[:12]])
    assert (star.label > 0).all()  # and its own optimum too; in a smoothed mesh the node may have gone further
    assert (star.label < star.ring.amax(dim=1)).all()


def test_metric_is_the_loss_of_the_star(trainee):
    part = labelled(data.meshes(0)[0], "mesh")
    rings = Rings.of(5, [part])
    chosen = part.stars.degree == 5
    ring, degree = torch.as_tensor(part.stars.ring[chosen]), torch.as_tensor(part.stars.degree[chosen])
    still = metric_loss(ring, degree, torch.zeros(len(ring), 2, dtype=torch.float64)).mean()
    assert float(rings.metric(rings.centre)) == pytest.approx(float(still), abs=1e-5)


def test_drawn_rings_are_turned_and_no_more(trainee):
    rings = trainee.rings["training"][6]
    drawn = rings.drawn(np.random.default_rng(0), 5)
    assert drawn.sizes == [min(5, size) for size in rings.sizes]
    assert len(drawn.ring) == sum(drawn.sizes)
    begins = []
    for ring, centre, label in zip(drawn.ring, drawn.centre, drawn.label, strict=True):
        (at,) = np.flatnonzero((rings.centre == centre).all(dim=1) & (rings.label == label).all(dim=1)).tolist()
        (begin,) = [k for k in range(6) if torch.equal(torch.roll(rings.ring[at], -k, dims=0), ring)]
        begins.append(begin)
    assert set(begins) == set(range(6))


def test_each_network_draws_from_every_mesh(trainee):
    losses = trainee.training_losses(0)
    assert list(losses) == NETWORKS
    other = trainee.training_losses(1)
    assert all(losses[name].item() != other[name].item() for name in NETWORKS)
    assert all(losses[name].item() == trainee.training_losses(0)[name].item() for name in NETWORKS)


def test_meshes_without_a_degree_are_refused(tmp_path, monkeypatch):
    monkeypatch.setattr(data, "NODES", (4, 6))
    with pytest.raises(InputError, match=r"the training meshes of --mesh-seed 0 have no node of degree \d;"):
        training.train(SHORT, tmp_path)


app = typer.Typer()
app.command()(command.train)


def test_command(tmp_path, whole):
    folder = ["--out", str(tmp_path / "run")]
    result = CliRunner().invoke(app, [*SHORT.command.split()[2:], *folder])
    assert result.exit_code == 0, result.output
    assert result.stdout.startswith("mean squared distance to the label")
    assert "MetricLoss of the test meshes: 0." in result.stdout
    assert contents(tmp_path / "run") == whole
    for wrong, message in (
        (["--loss", "q"], "--loss does not apply to --model nn"),
        (["--model", "gmsnet"], "the training there is of --model nn, not gmsnet"),
    ):
        result = CliRunner().invoke(app, ["--resume", *wrong, *folder])
        assert isinstance(result.exception, InputError)
        assert message in str(result.exception)
