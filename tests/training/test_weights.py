"""What a run starts with, and the moving average of its weights."""

from __future__ import annotations

import pytest
import torch

from nrdf.errors import ConfigError
from nrdf.field import build_field
from nrdf.field.weights import load_weights
from nrdf.training.weights import averaged, start_parts, start_with, to_device, update_average


def test_a_field_starts_with_a_models_weights(untrained, caplog):
    caplog.set_level("INFO", "nrdf.training.weights")
    field = build_field("default")
    start_with(field, untrained)
    assert f"start as those of {untrained}, of chair" in caplog.text
    wanted = load_weights(untrained)[0].state_dict()
    assert all(torch.equal(value, wanted[name]) for name, value in field.state_dict().items())


def test_a_model_of_other_sizes_is_refused(untrained):
    with pytest.raises(ConfigError, match=r"cannot start with .*: it is of preset 'default', or"):
        start_with(build_field("default", {"latent": 64}), untrained)
    with pytest.raises(ConfigError, match="configuration's 'paper'"):
        start_with(build_field("paper"), untrained)


def test_a_part_starts_as_that_of_another_model(untrained):
    field = build_field("default")
    start_parts(field, {"local_occupancy": untrained})
    wanted = load_weights(untrained)[0].state_dict()
    for name, value in field.state_dict().items():
        if name.startswith("local_occupancy."):
            assert torch.equal(value, wanted[name])
    with pytest.raises(ConfigError, match=r"no part 'local' in both .*; in both: encoder, decoder"):
        start_parts(field, {"local": untrained})
    other = build_field("default", {"occupancy_width": 32})
    with pytest.raises(ConfigError, match=r"'local_occupancy' of .* is of other sizes"):
        start_parts(other, {"local_occupancy": untrained})


def test_the_average_follows_the_weights_and_stands_in_for_a_while():
    layer = torch.nn.Linear(2, 1)
    average = to_device(layer.state_dict(), None)
    before = average["weight"].clone()
    with torch.no_grad():
        layer.weight += 1.0
    update_average(average, layer, 0.9, step=10_000)
    assert torch.allclose(average["weight"], before + 0.1)
    with averaged(layer, average):
        assert torch.equal(layer.weight, average["weight"])
    assert torch.allclose(layer.weight, before + 1.0)


def test_the_average_of_a_frozen_part_stays():
    field = torch.nn.ModuleDict({"a": torch.nn.Linear(2, 1), "b": torch.nn.Linear(2, 1)})
    average = to_device(field.state_dict(), None)
    before = to_device(average, None)
    field["a"].eval()
    with torch.no_grad():
        for parameter in field.parameters():
            parameter += 1.0
    update_average(average, field, 0.9, step=10_000)
    assert torch.equal(average["a.weight"], before["a.weight"])
    assert torch.allclose(average["b.weight"], before["b.weight"] + 0.1)
