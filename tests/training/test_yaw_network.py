"""What tells yaw: alike in every turn, left for right; its training; its place in the zoo."""

from __future__ import annotations

import math
from dataclasses import asdict

import numpy as np
import pytest
import torch

from builders.step_shape import step_shape
from nrdf.errors import DataError, ModelError, OutputError
from nrdf.field import yaw_network as yaws
from nrdf.field.weights import load_tensors
from nrdf.field.yaw_network import YawNetwork, load_yaw_network, log_probability_at, turn
from nrdf.field.zoo import add_to_zoo, list_models
from nrdf.geometry.canonical import MIRROR, rotation_about_up
from nrdf.io.locks import write_lock
from nrdf.shapes.dataset import IndexRow, write_index, write_shape
from nrdf.training.camera_views import CAMERAS, load_views, split
from nrdf.training.provenance import Entry, list_shapes
from nrdf.training.yaw_network import YawSettings, draw, loss_of, train_yaw

FEW = YawSettings(steps=12, batch=8)
MORE = YawSettings(steps=100, batch=16, rate=5e-3)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("steps")
    rows = []
    for number in range(12):
        name = f"step-{number:02d}"
        write_shape(folder / f"{name}.npz", step_shape(name, number))
        rows.append(IndexRow(name, "blocks", "test" if number == 11 else "train", "MIT"))
    write_index(folder, rows)
    return folder


@pytest.fixture(scope="module")
def trained(folder, tmp_path_factory):
    out = tmp_path_factory.mktemp("runs") / "yaw"
    return train_yaw("step", [folder], out, MORE)


def network() -> YawNetwork:
    torch.manual_seed(3)
    return YawNetwork().eval()


def cloud() -> tuple[np.ndarray, np.ndarray]:
    shape = step_shape("", 0)
    order = np.random.default_rng(0).permutation(4096)
    return shape.surface_points[order], shape.surface_normals[order]


def test_a_turned_cloud_has_turned_yaws_and_a_mirrored_one_mirrored_ones():
    points, normals = cloud()
    asked = network()
    told = asked.log_probability(points, normals)
    assert np.exp(told).sum() == pytest.approx(1, abs=1e-5)
    turned = rotation_about_up(np.radians(60))
    again = asked.log_probability(7 * points @ turned.T + 3, normals @ turned.T)
    np.testing.assert_allclose(again, np.roll(told, 6), atol=1e-4)
    mirrored = asked.log_probability(points * MIRROR, normals * MIRROR)
    np.testing.assert_allclose(mirrored, np.roll(told[::-1], 1), atol=1e-4)


def test_few_points_are_enough():
    points, normals = cloud()
    assert network().log_probability(points[:100], normals[:100]).shape == (36,)


def test_between_its_bins_a_distribution_is_interpolated():
    told = np.full(36, -5.0)
    told[[0, 35]] = -1.0, -2.0
    found = log_probability_at(told, np.radians([0.0, -5.0, 355.0, 10.0, 365.0]))
    np.testing.assert_allclose(found, [0, -0.5, -0.5, -4, -2])


def test_turning_is_about_up_as_elsewhere():
    np.testing.assert_allclose(turn(torch.tensor(0.7)), rotation_about_up(0.7), atol=1e-6)


def test_drawn_clouds_are_what_cameras_see_turned_by_their_yaw(folder):
    views = load_views(list_shapes([folder])[:2], "step")
    assert len(CAMERAS) < 63 and views.bits.shape == (2, 4096)
    below = views.normals[0, :, 1] < -0.9
    assert (views.bits[0][below] == 0).all(), "no camera sees the underside"
    generator = torch.Generator().manual_seed(0)
    points, normals, yaw = draw(views, torch.zeros(32, dtype=torch.long), 200, 0.0, generator)
    back = torch.einsum("bij,bni->bnj", turn(yaw), points)
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


def test_the_test_split_and_every_tenth_shape_are_left_out(folder):
    kept, held = split(list_shapes([folder]))
    assert [e.path.stem for e in held] == ["step-09"]
    assert len(kept) == 10 and all(e.split == "train" for e in kept)
    rows = [Entry(folder / "a.npz", "s", split, "") for split in ("val", "test", "train")]
    assert [[e.split for e in part] for part in split(rows)] == [["train"], ["val"]]


def test_training_goes_on_where_it_was_killed(folder, tmp_path, monkeypatch):
    monkeypatch.setattr("nrdf.training.small_networks.CHECKPOINT_EVERY", 5)

    def kill(done: int, total: int) -> None:
        if done == 8:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        train_yaw("step", [folder], tmp_path / "run", FEW, progress=kill)
    again = train_yaw("step", [folder], tmp_path / "run", FEW)
    whole = train_yaw("step", [folder], tmp_path / "whole", FEW)
    one, two = load_tensors(whole)[1], load_tensors(again)[1]
    assert all(torch.equal(one[name], two[name]) for name in one)
    with pytest.raises(OutputError, match=r"holds another run: its yaw\.steps is 12, not 30"):
        train_yaw("step", [folder], tmp_path / "run", YawSettings(steps=30, batch=8))


def test_a_second_training_in_the_same_folder_is_refused(folder, tmp_path):
    with write_lock(tmp_path / "run"), pytest.raises(OutputError, match="another run is writing"):
        train_yaw("step", [folder], tmp_path / "run", FEW)
    assert list(tmp_path.iterdir()) == []


def test_what_was_trained_says_what_it_is_and_tells_yaw(trained):
    found, metadata = load_yaw_network(trained)
    assert metadata["category"] == "step" and metadata["train"] == asdict(MORE)
    assert metadata["shapes"] == {"blocks": {"count": 10, "licences": {"MIT": 10}}}
    assert metadata["scores"]["wrong-yaws"] < 0.5, "chance is 0.83"
    assert trained.stat().st_size < 500_000
    points, normals = cloud()
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
    monkeypatch.setattr(yaws, "YAW_ZOO", tmp_path / "yaw")
    assert yaws.find_yaw_network("teapot") is None
    with pytest.raises(ModelError, match="holds a field of preset 'default', not yaws"):
        load_yaw_network(untrained)


def test_what_ships_is_whole_and_small():
    shipped = list_models(yaws.YAW_ZOO)
    assert {"car", "plane"} <= {entry.name for entry in shipped}
    for entry in shipped:
        found = yaws.find_yaw_network(entry.category)
        assert found is not None and found.config.bins % 12 == 0
        assert entry.bytes < 500_000 and entry.scores["wrong-yaws"] < 0.1
