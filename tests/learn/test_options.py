"""The options of a training, of all models."""

from __future__ import annotations

import pytest

from gmsnet.errors import InputError
from gmsnet.learn.losses import LOSSES
from gmsnet.learn.options import LOSS_TITLES, MODELS, GMSNet2Options, NNOptions, TrainOptions, changed, options_for


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"hidden": 3}, "--hidden must lie between 4 and 64, got 3"),
        ({"hidden": 65}, "--hidden must lie between 4 and 64, got 65"),
        ({"epochs": 0}, "--epochs must be at least 1"),
        ({"nodes_per_mesh": 0}, "--nodes-per-mesh must be at least 1"),
        ({"seed": -1}, "--seed must be at least 0"),
        ({"mesh_seed": -1}, "--mesh-seed must be at least 0"),
        ({"patience": 0}, "--patience must be at least 1"),
        ({"learning_rate": 0.0}, "--learning-rate must be a positive number"),
        ({"learning_rate": float("nan")}, "--learning-rate must be a positive number"),
        ({"decay": 1.0}, "--decay must lie between 0 and 1"),
        ({"loss": "angle"}, "--loss must be one of metric, q, cosine, min-max-angle; got 'angle'"),
    ],
)
def test_bad_options_are_named(options, message):
    with pytest.raises(InputError, match=message):
        TrainOptions(**options)


def test_every_loss_can_be_chosen():
    assert tuple(LOSS_TITLES) == tuple(LOSSES)


def test_options_of_other_models_are_refused():
    with pytest.raises(InputError, match=r"--model must be one of gmsnet.*; got 'resnet'"):
        options_for("resnet", {})
    with pytest.raises(InputError, match="--depth does not apply to --model gmsnet; leave it out"):
        options_for("gmsnet", {"depth": 3})


def test_options_of_nn_smoothing():
    with pytest.raises(InputError, match="--labels must be one of mesh, star; got 'node'"):
        NNOptions(labels="node")
    with pytest.raises(InputError, match="--hidden does not apply to --model nn; leave it out"):
        options_for("nn", {"hidden": 8})


@pytest.mark.parametrize(
    "options",
    [TrainOptions(loss="q", hidden=9), NNOptions(labels="star", decay=0.4), NNOptions(), GMSNet2Options(power=8)],
)
def test_options_survive_as_values(options):
    values = options.as_dict()
    assert options_for(values.pop("model"), values) == options
    assert changed(MODELS[options.model](), values) == options


def test_each_kind_of_weights_has_a_name_of_its_own():
    kinds = [
        *(TrainOptions(loss=loss) for loss in LOSSES),
        TrainOptions(hidden=16),
        NNOptions(),
        NNOptions(labels="star"),
    ]
    assert len({options.file_name for options in kinds}) == len(kinds)
    assert TrainOptions().file_name == "gmsnet-h8.safetensors"
    assert NNOptions().file_name == "nn.safetensors"
