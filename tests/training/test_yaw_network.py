"""Training of the networks that tell yaw, and their place in the zoo."""

from __future__ import annotations

import math
from dataclasses import asdict

import numpy as np
import pytest
import torch

from builders.step_shape import step_cloud
from nrdf.errors import DataError, ModelError
from nrdf.field import yaw_network
from nrdf.field.yaw_network import load_yaw_network, yaw_rotations
from nrdf.field.zoo import add_to_zoo, list_models
from nrdf.geometry.canonical import rotation_about_up
from nrdf.shapes.dataset import IndexRow, write_index
from nrdf.training.camera_views import CAMERAS, load_views
from nrdf.training.provenance import list_shapes
from nrdf.training.yaw_network import YawSettings, draw, loss_of, train_yaw

FEW = YawSettings(steps=12, batch=8)
MORE = YawSettings(steps=100, batch=16, rate=5e-3)


@pytest.fixture(scope="module")
def trained(folder, tmp_path_factory):
    out = tmp_path_factory.mktemp("runs") / "yaw"
    return train_yaw("step", [folder], out, MORE)


def test_drawn_clouds_are_what_cameras_see_turned_by_their_yaw(folder):
    views = load_views(list_shapes([folder])[:2], "step")
    assert len(CAMERAS) < 63 and views.bits.shape == (2, 4096)
    below = views.normals[0, :, 1] < -0.9
    assert (views.bits[0][below] == 0).all(), "no camera sees the underside"
    generator = torch.Generator().manual_seed(0)
    points, normals, yaw = draw(views, torch.zeros(32, dtype=torch.long), 200, 0.0, generator)
    back = torch.einsum("bij,bni->bnj", yaw_rotations(yaw), points)
    # The higher block is behind, whatever was seen, and in all that were turned back.
    high = back[..., 1] > 0.17
    assert high.any(1).sum() > 28 and (back[..., 0][high] < 0.05).all()
    assert torch.allclose(normals.norm(dim=-1), torch.ones(32, 200), atol=1e-5)


def test_bins_beside_the_right_one_are_nearly_right():
    def loss(place: int) -> float:
        logits = torch.full((1, 36), -9.0)
        logits[0, place] = 9.0
        return float(loss_of(logits, torch.tensor([math.radians(352)])))

    assert loss(35) < loss(0) < loss(1) < loss(18)


def test_what_was_trained_says_what_it_is_and_tells_yaw(trained):
    found, metadata = load_yaw_network(trained)
    assert metadata["category"] == "step" and metadata["train"] == asdict(MORE)
    assert metadata["shapes"] == {"blocks": {"count": 10, "licences": {"MIT": 10}}}
    assert metadata["scores"]["wrong-yaws"] < 0.5, "chance is 0.83"
    assert trained.stat().st_size < 500_000
    points, normals = step_cloud()
    told = found.log_probability(
        points @ rotation_about_up(2.0).T, normals @ rotation_about_up(2.0).T
    )
    off = told.argmax() * 2 * np.pi / 36 - 2.0
    assert np.cos(off) > 0.9


def test_data_that_do_not_serve_are_refused(folder, tmp_path):
    with pytest.raises(DataError, match="is of the category 'step', not 'chair'"):
        train_yaw("chair", [folder], tmp_path / "run", FEW)
    few = tmp_path / "few"
    few.mkdir()
    write_index(few, [IndexRow("step-00", "blocks", "train", "MIT")])
    with pytest.raises(DataError, match="1 training shapes and 0 to validate with"):
        train_yaw("step", [few], tmp_path / "other", FEW)


def test_the_zoo_keeps_it_apart_from_the_fields(trained, untrained, tmp_path, monkeypatch):
    entry = add_to_zoo(trained, zoo=tmp_path)
    assert entry.name == "step" and list_models(tmp_path) == []
    assert [e.name for e in list_models(tmp_path / "yaw")] == ["step"]
    monkeypatch.setattr(yaw_network, "YAW_ZOO", tmp_path / "yaw")
    assert yaw_network.find_yaw_network("teapot") is None
    with pytest.raises(ModelError, match="holds a field of preset 'default', not yaws"):
        load_yaw_network(untrained)
