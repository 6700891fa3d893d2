from __future__ import annotations

import csv
import json
import math
import re
import signal
from contextlib import contextmanager
from dataclasses import replace

import numpy as np
import pytest
import typer
from safetensors import safe_open
from safetensors.numpy import save
from typer.testing import CliRunner

from gmsnet import weights
from gmsnet.cli import train as command
from gmsnet.errors import InputError
from gmsnet.learn import data, train_gmsnet
from gmsnet.learn import train as training
from gmsnet.learn.backend import torch
from gmsnet.learn.checkpoint import NAME, saved_options
from gmsnet.learn.losses import LOSSES, truncation
from gmsnet.learn.model import GMSNet, wheels
from gmsnet.learn.options import TrainOptions, options_for
from gmsnet.learn.train import Ending
from gmsnet.learn.train_gmsnet import Batch

FILES = {"gmsnet-h4.safetensors", "history.csv", "curves.png", NAME}
SHORT = TrainOptions(hidden=4, epochs=12, nodes_per_mesh=8, patience=2, seed=3, mesh_seed=1)


@pytest.fixture(autouse=True, scope="module")
def _small_meshes():
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(data, "NODES", (15, 40))
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
    seen = []
    first = training.train(SHORT, tmp_path / "a", on_epoch=seen.append)
    assert contents(tmp_path / "a") == whole
    assert whole.keys() == FILES
    assert [p.epoch for p in seen] == list(range(1, 13))
    assert first.ending is Ending.FINISHED
    assert first.files[0].name == "gmsnet-h4.safetensors"
    assert {path.name for path in first.files} == FILES
    rows = [p.rows["gmsnet"] for p in seen]
    assert first.history == {"gmsnet": rows}
    assert first.losses["validation_loss"] == min(row.validation_loss for row in rows)
    assert rows[-1].learning_rate < SHORT.learning_rate  # the plateau schedule has worked


def test_another_seed_makes_other_weights_on_the_same_meshes(tmp_path):
    options = [TrainOptions(hidden=4, epochs=1, seed=seed) for seed in (0, 1)]
    a, b = (training.train(o, tmp_path / str(o.seed)) for o in options)
    assert a.losses["validation_loss"] != b.losses["validation_loss"]
    assert a.losses["validation_loss_before"] == b.losses["validation_loss_before"]


def test_stopped_and_resumed_is_as_if_never_stopped(tmp_path, whole):
    epochs = []
    stopped = training.train(SHORT, tmp_path / "parts", on_epoch=epochs.append, should_stop=lambda: len(epochs) == 5)
    assert stopped.ending is Ending.STOPPED
    assert stopped.epochs == 5
    assert contents(tmp_path / "parts").keys() == {NAME}
    training.train(SHORT, tmp_path / "parts", resume=True)
    assert contents(tmp_path / "parts") == whole


def test_killed_and_resumed_is_as_if_never_killed(tmp_path, whole):
    def die(progress):
        if progress.epoch == 8:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        training.train(SHORT, tmp_path / "parts", on_epoch=die)
    again = []
    training.train(SHORT, tmp_path / "parts", resume=True, on_epoch=again.append)
    assert again[0].epoch == 7  # after the last checkpoint
    assert contents(tmp_path / "parts") == whole


def test_a_finished_training_can_be_prolonged(tmp_path, whole):
    short = replace(SHORT, epochs=4)
    training.train(short, tmp_path / "parts")
    training.train(SHORT, tmp_path / "parts", resume=True)
    assert contents(tmp_path / "parts") == whole


@pytest.mark.parametrize("loss", ["metric", "cosine", "min-max-angle"])
def test_it_learns_and_keeps_the_best(tmp_path, loss):
    options = TrainOptions(epochs=60, loss=loss)
    result = training.train(options, tmp_path)
    losses = result.losses
    assert losses["validation_loss_optimum"] < losses["validation_loss"] < losses["validation_loss_before"]
    for kind in ("validation_loss", "validation_metric_loss", "test_loss", "test_metric_loss"):
        assert losses[kind] < losses[f"{kind}_before"]
    rows = list(csv.DictReader((tmp_path / "history.csv").read_text().splitlines()))
    assert [int(row["epoch"]) for row in rows] == list(range(1, 61))
    best = min(rows, key=lambda row: float(row["validation_loss"]))
    for kind in ("validation_loss", "validation_metric_loss"):
        assert float(best[kind]) == pytest.approx(losses[kind], rel=1e-7)
    assert (best["validation_loss"] == best["validation_metric_loss"]) == (loss == "metric")

    loaded = weights.load(tmp_path / f"gmsnet-h8{'' if loss == 'metric' else '-' + loss}.safetensors")
    net = GMSNet.from_tensors(loaded.tensors)
    stars = data.joined([data.Stars.of_mesh(mesh) for mesh in data.meshes(0)[12:16]])
    ring, degree = torch.as_tensor(stars.ring, dtype=torch.float32), torch.as_tensor(stars.degree)
    with torch.no_grad():
        shift = net(wheels(ring, degree))
        moved = truncation(ring, degree, shift)[:, None] * shift
        assert float(LOSSES[loss](ring, degree, moved).mean()) == pytest.approx(losses["validation_loss"], abs=1e-4)
        assert float(LOSSES["metric"](ring, degree, moved).mean()) == pytest.approx(
            losses["validation_metric_loss"], abs=1e-5
        )


def test_metadata_tells_how_the_weights_were_made(tmp_path, whole):
    (tmp_path / "w.safetensors").write_bytes(whole["gmsnet-h4.safetensors"])
    metadata = weights.load(tmp_path / "w.safetensors").metadata
    recipe = json.loads(metadata["recipe"])
    assert options_for(recipe.pop("model"), recipe) == SHORT
    assert recipe["loss"] == "metric"
    assert metadata["command"] == SHORT.command
    assert metadata["command"] == (
        "gmsnet train --epochs 12 --nodes-per-mesh 8 --seed 3 --mesh-seed 1 --patience 2 --hidden 4"
    )
    assert metadata["parameters"] == "74"
    assert metadata["seed"] == "3"
    assert json.loads(metadata["versions"])["torch"] == torch.__version__
    curve = json.loads(metadata["validation_curve"])["gmsnet"]
    assert [epoch for epoch, _ in curve] == list(range(1, 13))
    assert min(loss for _, loss in curve) == pytest.approx(float(metadata["validation_loss"]), rel=1e-4)
    best = json.loads(metadata["validation_best_epoch"])["gmsnet"]
    assert curve[best - 1][1] == min(loss for _, loss in curve)
    assert "20 random Delaunay squares" in metadata["data"]


def test_settings_of_torch_are_as_before(tmp_path):
    torch.manual_seed(5)
    expected = torch.rand(3).tolist()
    torch.manual_seed(5)
    before = torch.get_num_threads(), torch.are_deterministic_algorithms_enabled()
    training.train(TrainOptions(hidden=4, epochs=1), tmp_path)
    assert (torch.get_num_threads(), torch.are_deterministic_algorithms_enabled()) == before
    assert torch.rand(3).tolist() == expected


def test_meshes_with_fewer_nodes_than_asked_for_give_all(tmp_path):
    losses = []
    options = TrainOptions(hidden=4, epochs=2, nodes_per_mesh=1000)
    training.train(options, tmp_path, on_epoch=losses.append, should_stop=lambda: True)
    stars = Batch.of_stars(data.joined([data.Stars.of_mesh(mesh) for mesh in data.meshes(0)[:12]]))
    torch.manual_seed(0)
    expected = stars.mean(LOSSES["metric"], stars.moved(GMSNet(4))).item()
    assert losses[0].rows["gmsnet"].train_loss == pytest.approx(expected, abs=1e-6)


def test_folder_rules(tmp_path):
    stop = {"should_stop": lambda: True}
    training.train(SHORT, tmp_path / "a", **stop)
    assert saved_options(tmp_path / "a") == SHORT
    with pytest.raises(InputError, match="holds a training already"):
        training.train(SHORT, tmp_path / "a", **stop)
    with pytest.raises(InputError, match=r"other options: gmsnet train .* --seed 3 .* --hidden 4"):
        training.train(TrainOptions(), tmp_path / "a", resume=True, **stop)
    with pytest.raises(InputError, match="nothing to resume"):
        training.train(SHORT, tmp_path / "b", resume=True, **stop)
    assert not (tmp_path / "b").exists()
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match="file: this folder cannot be made: file exists"):
        training.train(SHORT, tmp_path / "file", **stop)


@pytest.mark.parametrize("damage", [lambda b: b[:-9], lambda b: b[:5], lambda b: b"", lambda b: b"\x00" * len(b)])
def test_a_damaged_checkpoint_is_refused(tmp_path, damage):
    training.train(SHORT, tmp_path, should_stop=lambda: True)
    (tmp_path / NAME).write_bytes(damage((tmp_path / NAME).read_bytes()))
    with pytest.raises(InputError, match=f"{NAME}: this checkpoint cannot be read"):
        training.train(SHORT, tmp_path, resume=True)


def without(key):
    def dropped(tensors, metadata):
        names = [name for name in tensors if key in name]
        assert names
        return {name: value for name, value in tensors.items() if name != names[0]}, metadata

    return dropped


def with_shape(key, shape):
    def reshaped(tensors, metadata):
        names = [name for name in tensors if key in name]
        return {**tensors, names[0]: np.zeros(shape, np.float32)}, metadata

    return reshaped


@pytest.mark.parametrize(
    "change",
    [
        without("history"), without("/net/"), with_shape("/net/", (3,)), with_shape("history", (2,)),
        with_shape("history", (0, 5)), with_shape("history", (2, 9)),
        lambda tensors, metadata: (tensors, {"options": metadata["options"]}),
        lambda tensors, metadata: (tensors, {**metadata, "schedules": "no JSON"}),
        lambda tensors, metadata: (tensors, {**metadata, "schedules": "[]"}),
        lambda tensors, metadata: ({**tensors, "gmsnet/adam/x": np.zeros(1, np.float32)}, metadata),
    ],
)  # fmt: skip
def test_a_checkpoint_of_something_else_is_refused(tmp_path, change):
    training.train(SHORT, tmp_path, should_stop=lambda: True)
    with safe_open(tmp_path / NAME, framework="numpy") as file:
        tensors = {name: file.get_tensor(name) for name in file.keys()}  # noqa: SIM118 (not a dict)
        tensors, metadata = change(tensors, file.metadata())
    (tmp_path / NAME).write_bytes(save(tensors, metadata=metadata))
    with pytest.raises(InputError, match=f"{NAME}: not the state of this training; delete it to start anew"):
        training.train(SHORT, tmp_path, resume=True)


def test_another_file_of_the_name_is_refused(tmp_path, whole):
    (tmp_path / NAME).write_bytes(whole["gmsnet-h4.safetensors"])
    with pytest.raises(InputError, match="no checkpoint of this version of gmsnet"):
        training.train(SHORT, tmp_path, resume=True)


WILD = TrainOptions(hidden=4, learning_rate=1e20)


def test_a_training_that_diverges_keeps_its_curves(tmp_path):
    seen = []
    result = training.train(WILD, tmp_path, on_epoch=seen.append)
    assert result.ending is Ending.DIVERGED
    assert result.losses == {}
    assert result.epochs == len(seen) < WILD.epochs
    assert {path.name for path in result.files} == {"history.csv", "curves.png"} <= contents(tmp_path).keys()
    rows = list(csv.DictReader((tmp_path / "history.csv").read_text().splitlines()))
    assert [int(row["epoch"]) for row in rows] == list(range(1, len(seen) + 1))
    assert rows[-1]["validation_loss"] == "nan"
    assert all(row["validation_loss"] != "nan" for row in rows[:-1])
    assert not any(name.startswith("gmsnet") for name in contents(tmp_path))


def test_an_infinite_loss_is_no_divergence(tmp_path, monkeypatch):
    """A star that cannot be truncated has an infinite aspect ratio loss; it may come right again."""
    true = LOSSES["q"]
    calls = []

    def loss(*star):
        calls.append(1)
        return true(*star) * (math.inf if len(calls) in (2, 4) else 1.0)  # the validation of two epochs

    monkeypatch.setattr(train_gmsnet, "LOSSES", {"q": loss})
    result = training.train(TrainOptions(hidden=4, epochs=3, loss="q"), tmp_path)
    assert result.ending is Ending.FINISHED
    assert [row.validation_loss < math.inf for row in result.history["gmsnet"]] == [False, False, True]
    assert result.losses["validation_loss"] == pytest.approx(result.history["gmsnet"][2].validation_loss)
    assert (tmp_path / "gmsnet-h4-q.safetensors").exists()


app = typer.Typer()
app.command()(command.train)
ARGUMENTS = SHORT.command.split()[2:]


def test_command_trains_and_reports(tmp_path, whole):
    result = CliRunner().invoke(app, [*ARGUMENTS, "--out", str(tmp_path / "run")])
    assert result.exit_code == 0, result.output
    assert result.stdout.startswith("MetricLoss: validation 0.")
    assert all(f"wrote {tmp_path / 'run' / name}" in result.stdout for name in FILES)
    assert "\x1b" not in result.output  # no progress bar where there is no terminal
    assert contents(tmp_path / "run") == whole


def test_command_stops_with_a_checkpoint_and_resumes_with_its_options(tmp_path, whole, monkeypatch):
    @contextmanager
    def stop_at_once():
        yield lambda: True

    folder = ["--out", str(tmp_path / "run")]
    with monkeypatch.context() as patch:
        patch.setattr(command, "_stop_on_signal", stop_at_once)
        result = CliRunner().invoke(app, [*ARGUMENTS, *folder])
    assert result.exit_code == 130
    assert "stopped after 1 of 12 epochs" in result.stderr
    assert f"go on with: gmsnet train --resume --out {tmp_path / 'run'}" in result.stderr
    result = CliRunner().invoke(app, ["--resume", *folder])
    assert result.exit_code == 0, result.output
    assert contents(tmp_path / "run") == whole
    result = CliRunner().invoke(app, ["--resume", "--hidden", "8", *folder])
    assert isinstance(result.exception, InputError)


def test_command_tells_where_the_curves_of_a_divergence_are(tmp_path):
    result = CliRunner().invoke(app, [*WILD.command.split()[2:], "--out", str(tmp_path)])
    assert isinstance(result.exception, InputError)
    assert re.search(rf"diverged in epoch \d+; its curves so far are {tmp_path}/curves.png", str(result.exception))


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_first_signal_asks_to_stop_and_the_second_interrupts(number):
    before = signal.getsignal(number)
    with command._stop_on_signal() as should_stop:
        assert not should_stop()
        signal.raise_signal(number)
        assert should_stop()
        with pytest.raises(KeyboardInterrupt):
            signal.raise_signal(number)
    assert signal.getsignal(number) is before
