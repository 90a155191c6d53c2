"""Training of the networks that tell the kind of object."""

from __future__ import annotations

from dataclasses import asdict, replace

import numpy as np
import pytest
import torch
import trimesh

from builders.step_shape import step_shape
from nrdf.errors import DataError, ModelError
from nrdf.field import kind_network
from nrdf.field.kind_network import ASKEW, ORIENTATIONS, OTHER, TILTED, load_kind_network
from nrdf.field.zoo import add_to_zoo, list_models
from nrdf.scans.kind_check import MINIMUM_PROBABILITY
from nrdf.shapes.dataset import IndexRow, write_index, write_shape
from nrdf.training.camera_views import load_views
from nrdf.training.kind_network import KindSettings, draw, is_held_out, train_kind
from nrdf.training.provenance import list_shapes

FEW = KindSettings(steps=12, batch=8)
MORE = KindSettings(steps=150, batch=24, rate=4e-3, others_licence="CC-BY-4.0")


@pytest.fixture(scope="module")
def folders(tmp_path_factory):
    """Steps, and balls of another category."""
    steps, balls = tmp_path_factory.mktemp("steps"), tmp_path_factory.mktemp("balls")
    rows, others = [], []
    for number in range(12):
        shape = step_shape(f"step-{number:02d}", number)
        write_shape(steps / f"{shape.name}.npz", shape)
        rows.append(IndexRow(shape.name, "blocks", "test" if number == 11 else "train", "MIT"))
        line = np.random.default_rng(number).normal(size=shape.surface_points.shape)
        line /= np.linalg.norm(line, axis=1, keepdims=True)
        ball = replace(shape, name=f"ball-{number:02d}", category="ball", surface_points=line / 2,
                       surface_normals=line)  # fmt: skip
        write_shape(balls / f"{ball.name}.npz", ball)
        others.append(IndexRow(ball.name, "balls", "train", "CC0"))
    write_index(steps, rows)
    write_index(balls, others)
    return steps, balls


@pytest.fixture(scope="module", autouse=True)
def few_heaps():
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("nrdf.training.kind_network._BOXES", 6)
        yield


@pytest.fixture(scope="module")
def trained(folders, tmp_path_factory):
    meshes = tmp_path_factory.mktemp("meshes")
    for word in ("vase", "bowl", "cup", "plate"):
        trimesh.creation.icosphere(2).export(meshes / f"{word}.ply")
    out = tmp_path_factory.mktemp("runs") / "kind"
    return train_kind("step", [folders[0]], [folders[1], meshes], out, settings=MORE)


def test_what_is_drawn_is_turned_as_its_answer_says(folders):
    members, balls = (load_views(list_shapes([f])) for f in folders)
    generator = torch.Generator().manual_seed(0)
    own = torch.zeros(256, dtype=torch.long)
    points, answers = draw(members, own, balls, 300, 0.0, generator)
    assert points.shape == (256, 300, 3)
    shares = {a: int((answers == a).sum()) for a in (0, OTHER, TILTED)}
    assert shares[0] > 30 and shares[OTHER] > 60 and shares[TILTED] > 5
    for cloud, answer in zip(points.numpy(), answers.tolist(), strict=True):
        if answer >= ASKEW:
            continue
        back = cloud @ ORIENTATIONS[answer]
        high = back[:, 1] > back[:, 1].min() + 0.3
        if high.sum() > 10:  # the higher block is behind
            assert back[high, 0].mean() < back[:, 0].mean() + 0.02


def test_half_of_the_names_of_others_are_never_shown():
    assert is_held_out("greek_vase_01") == is_held_out("flower_vase_02") == is_held_out("vase")
    words = [f"{a}{b}" for a in "abcdefgh" for b in "klmnopqr"]
    assert 0.3 < np.mean([is_held_out(word) for word in words]) < 0.7


def test_training_goes_on_where_it_was_killed(folders, tmp_path, monkeypatch):
    monkeypatch.setattr("nrdf.training.small_networks.CHECKPOINT_EVERY", 5)

    def kill(done: int, total: int) -> None:
        if done == 8:
            raise KeyboardInterrupt

    def train(name: str, progress=None):
        data = [folders[0]], [folders[1]], tmp_path / name
        return train_kind("step", *data, settings=FEW, progress=progress)

    with pytest.raises(KeyboardInterrupt):
        train("run", kill)
    one, two = load_kind_network(train("run"))[0], load_kind_network(train("whole"))[0]
    whole = two.state_dict()
    assert all(torch.equal(value, whole[name]) for name, value in one.state_dict().items())


def test_what_was_trained_tells_steps_from_balls_and_which_way_they_stand(trained):
    network, metadata = load_kind_network(trained)
    assert metadata["category"] == "step" and metadata["train"] == asdict(MORE)
    assert metadata["shapes"]["blocks"]["count"] == 10
    assert metadata["shapes"]["balls"]["licences"] == {"CC0": 11}
    (meshes,) = (s for name, s in metadata["shapes"].items() if name.startswith("meshes of other"))
    assert 0 < meshes["count"] < 4 and meshes["licences"] == {"CC-BY-4.0": meshes["count"]}
    assert trained.stat().st_size < 500_000
    points = np.random.default_rng(0).permutation(step_shape("", 0).surface_points)
    upside = points * [1, -1, -1]
    ball = np.random.default_rng(0).normal(size=(4000, 3))
    ball /= np.linalg.norm(ball, axis=1, keepdims=True)
    sure = [network.probabilities(p)[0] for p in (points, upside, points * [-1, 1, -1], ball)]
    assert sure[0] > MINIMUM_PROBABILITY > max(sure[1:])


def test_data_that_do_not_serve_are_refused(folders, tmp_path, untrained):
    with pytest.raises(DataError, match="is of the category 'step', not 'chair'"):
        train_kind("chair", [folders[0]], [], tmp_path / "run", settings=FEW)
    with pytest.raises(ModelError, match="holds weights of preset 'default', not of a network"):
        load_kind_network(untrained)


def test_the_zoo_keeps_it_apart_from_the_fields(trained, tmp_path, monkeypatch):
    assert add_to_zoo(trained, zoo=tmp_path).name == "step" and list_models(tmp_path) == []
    monkeypatch.setattr(kind_network, "KIND_ZOO", tmp_path / "kind")
    assert [e.name for e in list_models(tmp_path / "kind")] == ["step"]
    assert kind_network.find_kind_network("teapot") is None
