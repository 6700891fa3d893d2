from __future__ import annotations

import json

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from safetensors.numpy import save

from gmsnet import weights
from gmsnet.errors import InputError


def random_tensors(hidden=8):
    rng = np.random.default_rng(0)
    return {name: rng.normal(size=shape).astype(np.float32) for name, shape in weights.shapes(hidden).items()}


METADATA = {"model": "gmsnet", "format_version": "1"}


def written(path, tensors, metadata=METADATA):
    path.write_bytes(save(tensors, metadata=metadata))
    return path


@pytest.mark.parametrize("hidden", [4, 8, 64])
def test_reads_what_was_written(tmp_path, hidden):
    tensors = random_tensors(hidden)
    loaded = weights.load(written(tmp_path / "w.safetensors", tensors, {**METADATA, "note": "ü"}))
    assert loaded.model == "gmsnet"
    assert loaded.hidden == hidden
    assert loaded.parameters == 2 * hidden**2 + 10 * hidden + 2
    assert loaded.metadata["note"] == "ü"
    assert loaded.tensors.keys() == tensors.keys()
    for name, tensor in loaded.tensors.items():
        assert np.array_equal(tensor, tensors[name])
        with pytest.raises(ValueError, match="read-only"):
            tensor[0] = 0


def test_shipped_weights_tell_their_recipe():
    shipped = weights.load()
    metadata = shipped.metadata
    assert shipped.hidden == 8
    assert shipped.parameters == 210 == int(metadata["parameters"])
    assert metadata["command"] == "gmsnet train"
    assert 0.30 < float(metadata["validation_loss_before"]) < 0.33
    assert float(metadata["validation_loss_optimum"]) < float(metadata["validation_loss"]) <= 0.245
    curve = json.loads(metadata["validation_curve"])
    recipe = json.loads(metadata["recipe"])
    assert curve[-1][0] == recipe["epochs"] == 4000
    assert recipe["seed"] == int(metadata["seed"])
    assert {"gmsnet", "torch", "torch_geometric", "numpy"} <= json.loads(metadata["versions"]).keys()


def changed(**other):
    return {**random_tensors(), **other}


BAD = np.full(8, np.nan, np.float32)


@pytest.mark.parametrize(
    ("tensors", "metadata", "message"),
    [
        (changed(), {}, "weights without the name of a model"),
        (changed(), {**METADATA, "model": "nn"}, "weights of the model 'nn', where those of 'gmsnet' are needed"),
        (changed(), {**METADATA, "format_version": "2"}, "format version '2', but this gmsnet reads version '1'"),
        (random_tensors(3), METADATA, "hidden width must lie between 4 and 64, here it is 3"),
        (random_tensors(65), METADATA, "hidden width must lie between 4 and 64, here it is 65"),
        ({"other": BAD}, METADATA, "hidden width .* here it is 0"),
        (changed(extra=BAD), METADATA, "missing or unknown: extra"),
        ({k: v for k, v in changed().items() if k != "gcn.bias"}, METADATA, "missing or unknown: gcn.bias"),
        (changed(**{"norm.bias": np.zeros(7, np.float32)}), METADATA, r"norm.bias must have the shape \(8,\), here"),
        (changed(**{"norm.bias": BAD}), METADATA, "norm.bias holds values that are not finite"),
        (changed(**{"norm.bias": BAD * np.inf}), METADATA, "norm.bias holds values that are not finite"),
        (changed(**{"norm.bias": np.zeros(8)}), METADATA, "norm.bias must be of type float32, here it is float64"),
    ],
)
def test_weights_that_do_not_fit_are_named(tmp_path, tensors, metadata, message):
    path = written(tmp_path / "w.safetensors", tensors, metadata)
    with pytest.raises(InputError, match=message) as caught:
        weights.load(path)
    assert str(caught.value).startswith(f"{path}: ")
    assert "\n" not in str(caught.value)


def test_files_that_are_none(tmp_path):
    with pytest.raises(InputError, match=r"gone\.safetensors: there is no such file of weights"):
        weights.load(tmp_path / "gone.safetensors")
    with pytest.raises(InputError, match="is no file"):
        weights.load(tmp_path)
    with pytest.raises(InputError, match="no weights for a model 'resnet'"):
        weights.load(model="resnet")
    (tmp_path / "text").write_text("these are no weights, only a sentence of some length")
    with pytest.raises(InputError, match="cannot be read as safetensors weights"):
        weights.load(tmp_path / "text")


@settings(max_examples=100, deadline=None)
@given(st.data())
def test_cut_and_damaged_files_are_refused_or_read_never_a_crash(tmp_path_factory, data):
    path = tmp_path_factory.mktemp("damaged") / "w.safetensors"
    whole = save(random_tensors(4), metadata=METADATA)
    cut = data.draw(st.integers(0, len(whole) - 1))
    path.write_bytes(whole[:cut])
    with pytest.raises(InputError):
        weights.load(path)
    header = 8 + int.from_bytes(whole[:8], "little")
    at, value = data.draw(st.integers(0, header - 1)), data.draw(st.integers(0, 255))
    path.write_bytes(whole[:at] + bytes([value]) + whole[at + 1 :])
    try:
        hidden = weights.load(path).hidden
    except InputError as error:
        told = str(error)
    else:
        told = f"{path}: H = {hidden}"
    assert told.startswith(f"{path}: ")
    assert "\n" not in told
