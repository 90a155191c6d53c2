"""The interface of fields, and how a preset's name becomes one."""

from __future__ import annotations

from importlib.metadata import EntryPoint

import pytest
import torch

import nrdf.field
from builders.tiny_field import TinyConfig, TinyField
from nrdf.errors import ConfigError
from nrdf.field import build_field, field_class
from nrdf.field.paper import PaperField


def points_by(*entries):
    """A stand-in for the installed packages' entry points."""
    found = [EntryPoint(name, value, "nrdf.presets") for name, value in entries]
    return lambda group: found


def test_presets_of_other_packages_come_after_our_own(monkeypatch):
    entries = points_by(("tiny", "builders.tiny_field:TinyField"), ("paper", "nowhere:Nothing"))
    monkeypatch.setattr(nrdf.field, "entry_points", entries)
    assert field_class("tiny") is TinyField and field_class("paper") is PaperField
    assert build_field("tiny", {"width": 8}).config.width == 8


def test_an_unknown_preset_names_those_that_exist(monkeypatch):
    monkeypatch.setattr(nrdf.field, "entry_points", points_by(("rival", "nowhere:Nothing")))
    with pytest.raises(
        ConfigError, match=r"no preset 'papr'.*default, general, paper, registration, rival"
    ):
        field_class("papr")
    with pytest.raises(ConfigError, match="'rival' cannot be loaded from nowhere:Nothing"):
        field_class("rival")


def test_sizes_are_checked():
    with pytest.raises(ConfigError, match=r"cannot be built with 'octavs'.*octaves"):
        build_field("default", {"octavs": 2})
    with pytest.raises(ValueError, match="width must be 0 to"):
        TinyConfig(width=-1)
    with pytest.raises(ValueError, match="encoder_points must be at least 1"):
        TinyConfig(encoder_points=0)


def test_transfer_is_describing_and_inverting():
    torch.manual_seed(0)
    field, points = TinyField().eval(), torch.rand(2, 5, 3)
    z = field.embed(points, points)
    found = field.transfer(z, points, points, z.flip(0))
    expected = field.invert(z.flip(0), field.describe(z, points, points))
    assert torch.equal(found.points, expected.points)
    assert list(field.parts()) == ["encoder", "norm", "decoder", "logit", "inverse"]
