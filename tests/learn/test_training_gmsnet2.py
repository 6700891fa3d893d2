"""Training of GMSNet 2: its two stages, and that an interruption leaves no trace."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
import typer
from typer.testing import CliRunner

import gmsnet
from gmsnet import weights
from gmsnet.cli import train as command
from gmsnet.errors import InputError
from gmsnet.learn import data, train_gmsnet2
from gmsnet.learn import train as training
from gmsnet.learn.backend import torch
from gmsnet.learn.model_gmsnet2 import GMSNet2
from gmsnet.learn.options import GMSNet2Options, options_for
from gmsnet.learn.sweeps import MOST_Q, Meshes, inverse_mean_ratio, proposal, star_loss, sweep
from gmsnet.learn.train import Ending
from gmsnet.learn.train_gmsnet2 import GMSNet2Trainee

SHORT = GMSNet2Options(hidden=4, epochs=14, warm_up=8, nodes_per_mesh=12, seed=3, mesh_seed=1, meshes="mixed")


@pytest.fixture(autouse=True, scope="module")
def _small_meshes():
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(data, "NODES", (15, 40))
        patch.setattr(train_gmsnet2, "SMALL_GROUPS", 2)
        patch.setattr(train_gmsnet2, "SMALL_MESHES", 3)
        patch.setattr(train_gmsnet2, "JUDGE_EVERY", 4)
        patch.setattr(training, "CHECKPOINT_EVERY", 3)
        yield


def contents(folder):
    return {path.name: path.read_bytes() for path in folder.iterdir()}


@pytest.fixture(scope="module")
def whole(tmp_path_factory, _small_meshes):
    """The files of a training with the options SHORT that nobody interrupted."""
    folder = tmp_path_factory.mktemp("whole")
    training.train(SHORT, folder)
    return contents(folder)


def test_the_same_options_make_the_same_bytes(tmp_path, whole):
    result = training.train(SHORT, tmp_path)
    assert result.ending is Ending.FINISHED
    assert contents(tmp_path) == whole
    rows = result.history["gmsnet2"]
    assert [row.learning_rate for row in rows] == pytest.approx([SHORT.rate(epoch) for epoch in range(14)])
    assert [k for k in range(1, 14) if rows[k].validation_loss != rows[k - 1].validation_loss] == [3, 7, 11, 13]


@pytest.mark.parametrize("stop", [5, 10])  # in either stage
def test_stopped_and_resumed_is_as_if_never_stopped(tmp_path, whole, stop):
    seen = []
    stopped = training.train(SHORT, tmp_path, on_epoch=seen.append, should_stop=lambda: len(seen) == stop)
    assert stopped.ending is Ending.STOPPED
    training.train(SHORT, tmp_path, resume=True)
    assert contents(tmp_path) == whole


def test_another_seed_makes_other_weights(tmp_path, whole):
    training.train(replace(SHORT, seed=4), tmp_path)
    assert contents(tmp_path)["gmsnet2.safetensors"] != whole["gmsnet2.safetensors"]


def test_metadata_tells_how_the_weights_were_made(tmp_path, whole):
    (tmp_path / "w.safetensors").write_bytes(whole["gmsnet2.safetensors"])
    loaded = weights.load(tmp_path / "w.safetensors", model="gmsnet2")
    assert (loaded.hidden, loaded.activation, loaded.parameters) == (4, "silu", 111)
    recipe = json.loads(loaded.metadata["recipe"])
    assert options_for(recipe.pop("model"), recipe) == SHORT
    assert (
        loaded.metadata["command"]
        == SHORT.command
        == (
            "gmsnet train --model gmsnet2 --epochs 14 --nodes-per-mesh 12 --seed 3 --mesh-seed 1 "
            "--hidden 4 --meshes mixed --warm-up 8"
        )
    )
    curve = [loss for _, loss in json.loads(loaded.metadata["validation_curve"])["gmsnet2"]]
    assert min(curve) == pytest.approx(float(loaded.metadata["validation_loss"]), rel=1e-4)


@pytest.mark.parametrize("warm_up", [0, 60])
def test_each_stage_learns_by_itself(tmp_path, warm_up):
    options = GMSNet2Options(epochs=60, warm_up=warm_up, nodes_per_mesh=40, sweep_rate=1e-2)
    losses = training.train(options, tmp_path).losses
    trainee = GMSNet2Trainee(options, data.meshes(0))
    laplacian, _ = trainee._judge(trainee.judged["validation"])
    assert losses["validation_loss"] < laplacian < losses["validation_loss_before"]
    mesh = gmsnet.random_mesh(300, seed=7)
    smoothed = gmsnet.smooth(mesh, "gmsnet2", weights=tmp_path / "gmsnet2.safetensors", max_sweeps=5)
    assert smoothed.after.qhat > smoothed.before.qhat


def test_sweeps_in_torch_are_those_of_the_method(tmp_path):
    """Not to the last bit: float32 coordinates here, float64 there."""
    mesh = gmsnet.random_mesh(200, seed=2)
    loaded = weights.load(model="gmsnet2")
    net, meshes = GMSNet2.from_tensors(loaded.tensors, loaded.activation), Meshes.joined([mesh])
    with torch.no_grad():
        points = sweep(net, sweep(net, meshes.start, meshes.colours), meshes.colours).numpy()
    smoothed = gmsnet.smooth(mesh, "gmsnet2", max_sweeps=2, guard="valid")
    np.testing.assert_allclose(points, smoothed.points, rtol=0, atol=1e-4)
    after = meshes.log_power(torch.as_tensor(smoothed.points, dtype=torch.float32), 4)
    assert float(after[0]) == pytest.approx(np.log(np.mean(smoothed.after.shape**-4.0)) / 4, rel=1e-3)


def test_losses_of_stars_are_those_of_their_triangles():
    meshes = Meshes.joined([gmsnet.random_mesh(60, seed=3), gmsnet.random_mesh(40, seed=4)])
    net = GMSNet2(4, "relu")
    for colour in meshes.colours:
        ring, shift = proposal(net, meshes.start, colour)
        losses = star_loss(ring, colour.degree, shift, 2)
        points = meshes.start.index_add(0, colour.centre, shift.detach())
        q = meshes.q(points)
        for node, loss in zip(colour.centre.tolist(), losses.tolist(), strict=True):
            around = q[(meshes.triangles == node).any(dim=1)]
            assert loss == pytest.approx(0.5 * np.log(np.mean(around.numpy() ** 2)), rel=1e-3, abs=1e-5)


def test_inverted_and_flat_triangles_cost_the_most_without_a_gradient():
    a = torch.tensor([[1.0, 0], [1, 0], [1, 0], [0, 0]], requires_grad=True)
    b = torch.tensor([[0.5, 0.75**0.5], [0.5, -1], [0.5, 0], [0, 0]])
    q = inverse_mean_ratio(a, b)
    assert q.tolist() == pytest.approx([1, MOST_Q, MOST_Q, MOST_Q])
    q.sum().backward()
    assert torch.isfinite(a.grad).all()
    assert (a.grad[1:] == 0).all()


app = typer.Typer()
app.command()(command.train)


def test_command(tmp_path, whole):
    result = CliRunner().invoke(app, [*SHORT.command.split()[2:], "--out", str(tmp_path / "run")])
    assert result.exit_code == 0, result.output
    assert contents(tmp_path / "run") == whole
    result = CliRunner().invoke(app, ["--model", "gmsnet2", "--decay", "0.4", "--out", str(tmp_path / "other")])
    assert isinstance(result.exception, InputError)
    assert "--decay does not apply to --model gmsnet2" in str(result.exception)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"hidden": 3}, "--hidden must lie between 4 and 64, got 3"),
        ({"activation": "tanh"}, "--activation must be one of silu, relu; got 'tanh'"),
        ({"meshes": "good"}, "--meshes must be one of uniform, mixed; got 'good'"),
        ({"warm_up": -1}, "--warm-up must be at least 0, got -1"),
        ({"power": 0}, "--power must be at least 1, got 0"),
        ({"sweep_rate": 0.0}, "--sweep-rate must be a positive number, got 0.0"),
    ],
)
def test_bad_options_are_named(options, message):
    with pytest.raises(InputError, match=message):
        GMSNet2Options(**options)
