from __future__ import annotations

import json
import tracemalloc

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from safetensors.numpy import save

import gmsnet
from gmsnet import weights
from gmsnet.cli import main
from gmsnet.errors import InputError


def random_tensors(hidden=8):
    rng = np.random.default_rng(0)
    return {name: rng.normal(size=shape).astype(np.float32) for name, shape in weights.shapes.gmsnet(hidden).items()}


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


SHIPPED = [
    (model, variant) for model in ("gmsnet", "nn") for variant in weights.SHIPPED[model]
]  # the paper's, all trained alike


@pytest.mark.parametrize(("model", "variant"), SHIPPED)
def test_shipped_weights_tell_their_recipe(model, variant):
    shipped = weights.load(model=model, variant=variant)
    metadata = shipped.metadata
    first = variant == next(iter(weights.SHIPPED[model]))
    assert shipped.parameters == {"gmsnet": 210, "nn": 4864}[model] == int(metadata["parameters"])
    recipe = json.loads(metadata["recipe"])
    kind = {"gmsnet": "loss", "nn": "labels"}[model]
    assert (recipe["model"], recipe[kind]) == (model, variant)
    assert metadata["command"] == (
        "gmsnet train" + (" --model nn" if model == "nn" else "") + ("" if first else f" --{kind} {variant}")
    )
    assert recipe["epochs"] == 4000
    assert recipe["seed"] == int(metadata["seed"])
    networks = ["gmsnet"] if model == "gmsnet" else [f"degree{n}" for n in range(3, 10)]
    curves, best = (json.loads(metadata[f"validation_{name}"]) for name in ("curve", "best_loss"))
    for name in networks:
        assert curves[name][-1][0] == 4000
        assert best[name] <= 1.001 * min(loss for _, loss in curves[name])
        half = min(loss for epoch, loss in curves[name] if epoch <= 2000)
        assert curves[name][0][1] - half > 0.95 * (curves[name][0][1] - best[name])  # the curve has settled
    assert {"gmsnet", "torch", "torch_geometric", "numpy"} <= json.loads(metadata["versions"]).keys()
    assert float(metadata["validation_metric_loss"]) < float(metadata["validation_metric_loss_before"])


def test_shipped_weights_of_gmsnet2_tell_their_recipe():
    shipped = weights.load(model="gmsnet2")
    metadata = shipped.metadata
    assert shipped.parameters == 4 * shipped.hidden**2 + 11 * shipped.hidden + 3 == int(metadata["parameters"])
    recipe = json.loads(metadata["recipe"])
    assert (recipe["model"], recipe["hidden"], recipe["activation"]) == ("gmsnet2", shipped.hidden, shipped.activation)
    assert metadata["command"].startswith("gmsnet train --model gmsnet2")
    curve = json.loads(metadata["validation_curve"])["gmsnet2"]
    assert curve[-1][0] == recipe["epochs"]
    best = json.loads(metadata["validation_best_loss"])["gmsnet2"]
    assert best == pytest.approx(float(metadata["validation_loss"]), abs=1e-5)
    assert best < 0.2 * float(metadata["validation_loss_before"])
    assert float(metadata["test_loss"]) == pytest.approx(best, rel=0.1)  # it has learned more than its meshes
    assert float(metadata["test_metric_loss"]) < 0.11


def test_shipped_gmsnet_comes_near_the_optimum_of_its_loss():
    metadata = weights.load().metadata
    assert weights.load().hidden == 8
    assert 0.30 < float(metadata["validation_loss_before"]) < 0.33
    assert float(metadata["validation_loss_optimum"]) < float(metadata["validation_loss"]) <= 0.245


def test_variants_that_do_not_exist():
    with pytest.raises(InputError, match="no weights of gmsnet for 'q'; there are some for metric, cosine"):
        weights.load(variant="q")


def test_weights_of_gmsnet2(tmp_path):
    rng = np.random.default_rng(1)
    tensors = {name: rng.normal(size=shape).astype(np.float32) for name, shape in weights.shapes.gmsnet2(5).items()}
    metadata = {**METADATA, "model": "gmsnet2", "activation": "relu"}
    loaded = weights.load(written(tmp_path / "w.safetensors", tensors, metadata), model="gmsnet2")
    assert (loaded.hidden, loaded.activation, loaded.parameters) == (5, "relu", 4 * 25 + 11 * 5 + 3)
    path = written(tmp_path / "w.safetensors", tensors, {**metadata, "activation": "tanh"})
    with pytest.raises(InputError, match="the activation must be one of silu, relu, here it is 'tanh'"):
        weights.load(path, model="gmsnet2")
    path = written(tmp_path / "w.safetensors", {**tensors, "encode.bias": np.zeros(3, np.float32)}, metadata)
    with pytest.raises(InputError, match="hidden width must lie between 4 and 64, here it is 3"):
        weights.load(path, model="gmsnet2")


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


def test_weights_of_nn_smoothing(tmp_path):
    rng = np.random.default_rng(0)
    tensors = {name: rng.normal(size=shape).astype(np.float32) for name, shape in weights.shapes.nn().items()}
    metadata = {**METADATA, "model": "nn"}
    loaded = weights.load(written(tmp_path / "w.safetensors", tensors, metadata), model="nn")
    assert loaded.parameters == 4864
    assert all(np.array_equal(loaded.tensors[name], tensors[name]) for name in tensors)
    wrong = {**tensors, "degree5.1.weight": np.zeros((20, 10), np.float32)}
    with pytest.raises(InputError, match=r"degree5.1.weight must have the shape \(10, 20\), here it is \(20, 10\)"):
        weights.load(written(tmp_path / "w.safetensors", wrong, metadata), model="nn")
    del wrong["degree5.1.weight"]
    with pytest.raises(InputError, match=r"not the tensors of 'nn'; missing or unknown: degree5.1.weight"):
        weights.load(written(tmp_path / "w.safetensors", wrong, metadata), model="nn")


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


def header(length, text=b"{}"):
    return length.to_bytes(8, "little") + text


@pytest.mark.parametrize(
    "data",
    [
        b"", b"\0" * 7, header(0, b""), header(2**63), header(2**64 - 1), header(10**9, b"{" * 100),
        header(100_000, b"[" * 100_000),  # nested deeply
        header(77, b'{"a":{"dtype":"F32","shape":[4294967295,4294967295],"data_offsets":[0,4]}}   ') + bytes(4),
        header(72, b'{"a":{"dtype":"F32","shape":[1000000000],"data_offsets":[0,4000000000]}}'),
        b"PK\x03\x04" + b"\0" * 100,  # an archive, as torch.save makes it
        b"\x80\x04\x95" + b"cos\nsystem\n(S'exit 3'\ntR.",  # a pickle
    ],
)  # fmt: skip
def test_headers_that_promise_what_is_not_there_are_refused_at_once(tmp_path, data):
    (tmp_path / "w.safetensors").write_bytes(data)
    tracemalloc.start()
    with pytest.raises(InputError, match="cannot be read as safetensors weights"):
        weights.load(tmp_path / "w.safetensors")
    assert tracemalloc.get_traced_memory()[1] < 10_000_000
    tracemalloc.stop()


def test_a_file_that_is_too_large_is_not_read(tmp_path, monkeypatch):
    path = written(tmp_path / "w.safetensors", random_tensors())
    with path.open("r+b") as file:
        file.truncate(10**12)  # which takes no room on the disk
    monkeypatch.setattr(weights, "safe_open", None)
    with pytest.raises(InputError, match=r"w\.safetensors: too large for weights, which take at most 16 MiB"):
        weights.load(path)


@pytest.mark.parametrize("value", ["", "."])
def test_the_command_says_what_is_wrong_with_the_name(tmp_path, capsys, value):
    (tmp_path / "in.su2").write_text("")
    gmsnet.write(gmsnet.random_mesh(20, seed=0), tmp_path / "in.su2")
    given = [str(tmp_path / "in.su2"), str(tmp_path / "out.su2"), "--method", "gmsnet", "--weights", value]
    assert main(["smooth", *given]) == 2
    said = {"": "the path of the weights is empty: name a safetensors file, or leave it out", ".": ".: is no file"}
    assert capsys.readouterr().err == f"gmsnet: error: {said[value]}\n"
    assert not (tmp_path / "out.su2").exists()


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
