"""What tells the kind of object: alike in every turn; its words; its training; what ships."""

from __future__ import annotations

import logging
from dataclasses import asdict, replace
from functools import cache

import numpy as np
import pytest
import torch

import nrdf
from builders.step_shape import step_shape
from nrdf.errors import DataError, ModelError
from nrdf.field import kind_network as kinds
from nrdf.field.kind_network import (
    ANSWERS,
    ASKEW,
    ORIENTATIONS,
    OTHER,
    TILTED,
    UPS,
    KindNetwork,
    load_kind_network,
    orientation_of,
    up_of,
)
from nrdf.field.zoo import add_to_zoo, list_models
from nrdf.geometry.canonical import rotation_about_up
from nrdf.geometry.similarity import up_axis, upright
from nrdf.io.cloud import PointCloud
from nrdf.scans.aligned_scan import align
from nrdf.scans.kind_check import FITS, LEAST, check_by_network
from nrdf.shapes.dataset import IndexRow, write_index, write_shape
from nrdf.shapes.families import get_family
from nrdf.training.camera_views import load_views
from nrdf.training.kind_network import KindSettings, draw, is_held_out, train_kind
from nrdf.training.provenance import list_shapes
from nrdf_benchmark import kind as benchmark

TETRAHEDRON = """
v 0 0 0
v 1 0 0
v 0 1 0
v 0 0 1
f 1 3 2
f 1 2 4
f 2 3 4
f 1 4 3
"""
FEW = KindSettings(steps=12, batch=8)
MORE = KindSettings(steps=150, batch=24, rate=4e-3)


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
    out = tmp_path_factory.mktemp("runs") / "kind"
    return train_kind("step", [folders[0]], [folders[1]], out, settings=MORE)


@cache
def member(category: str, seed: int = 1_000_003) -> np.ndarray:
    surface = get_family(category).member(seed).sample_surface(6000, np.random.default_rng(0))
    return np.asarray(surface.points)


class Saying:
    """A network that answers one thing."""

    def __init__(self, answer: int, sure: float = 0.9) -> None:
        self.told = np.full(ANSWERS, (1 - sure) / (ANSWERS - 1))
        self.told[answer] = sure

    def probabilities(self, points):
        return self.told


def said(answer: int, rotation=None) -> str:
    rotation = np.eye(3) if rotation is None else rotation
    (warning,) = check_by_network(Saying(answer), "chair", np.zeros((5, 3)), rotation).warnings
    return warning


def test_the_orientations_are_the_rotations_of_a_cube():
    assert len({tuple(o.ravel()) for o in ORIENTATIONS}) == 24
    assert np.allclose(np.linalg.det(ORIENTATIONS), 1) and np.allclose(ORIENTATIONS[0], np.eye(3))
    assert [orientation_of(o) for o in ORIENTATIONS] == list(range(24))
    assert np.allclose(up_of(ASKEW + 5), [0, 0, -1])
    assert up_of(TILTED) is None and up_of(OTHER) is None and np.allclose(up_of(0), [0, 1, 0])


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_turned_or_mirrored_cloud_is_told_alike(side):
    torch.manual_seed(3)
    network = KindNetwork().eval()
    shape = step_shape("", 0)
    points = np.random.default_rng(0).permutation(shape.surface_points)[:384]
    told = network.probabilities(points)
    assert told.sum() == pytest.approx(1, abs=1e-5)
    mirror = np.diag([1.0, 1.0, side])
    moved = rotation_about_up(np.pi / 2) @ mirror
    again = network.probabilities(7 * points @ moved.T + 3)
    for answer, rotation in enumerate(ORIENTATIONS):
        there = orientation_of(moved @ rotation @ mirror)
        assert again[there] == pytest.approx(told[answer], abs=1e-4)
    for answer, up in enumerate(UPS):
        there = int((UPS @ (moved @ up)).argmax())
        assert again[ASKEW + there] == pytest.approx(told[ASKEW + answer], abs=1e-4)
    assert again[OTHER] == pytest.approx(told[OTHER], abs=1e-4)


def test_few_points_are_enough():
    assert KindNetwork().eval().probabilities(np.random.default_rng(0).normal(size=(100, 3))).shape


def test_it_says_what_it_sees_and_what_to_do():
    quarter = orientation_of(rotation_about_up(np.pi / 2))
    assert "it looks like one facing -Z; give --up y to have it aligned" in said(quarter)
    over = orientation_of(np.diag([1.0, -1.0, -1.0]))
    assert "upside down; give --up -y to have it aligned" in said(over)
    back = next(
        i for i, o in enumerate(ORIENTATIONS)
        if np.allclose(o[:, 0], [0, 1, 0]) and np.allclose(o[:, 1], [0, 0, 1])
    )  # fmt: skip
    assert "standing upright and facing +X" in said(back)
    assert "lying on its back; give --up z to have it aligned" in said(back)
    assert "another kind of object" in said(OTHER) and "give a whole chair" in said(OTHER)
    assert "tilted" in said(TILTED)
    assert "turned by an odd angle; give --up y" in said(ASKEW + 1)
    assert "lying; give --up -x" in said(ASKEW + 3)
    # Of a scan that was aligned by --up z, directions are told in the scan's frame.
    turned = upright(up_axis("z"))
    assert "upside down; give --up -z" in said(over, turned)
    assert "look at the picture, or scan more sides" in said(quarter, turned)
    fits = check_by_network(Saying(0), "chair", np.zeros((5, 3)), np.eye(3))
    assert fits.fits and fits.taken_for == FITS and fits.describe()["probability"] == 0.9


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
    assert trained.stat().st_size < 500_000
    points = np.random.default_rng(0).permutation(step_shape("", 0).surface_points)
    upside = points * [1, -1, -1]
    ball = np.random.default_rng(0).normal(size=(4000, 3))
    ball /= np.linalg.norm(ball, axis=1, keepdims=True)
    sure = [network.probabilities(p)[0] for p in (points, upside, points * [-1, 1, -1], ball)]
    assert sure[0] > LEAST > max(sure[1:])


def test_data_that_do_not_serve_are_refused(folders, tmp_path, untrained):
    with pytest.raises(DataError, match="is of the category 'step', not 'chair'"):
        train_kind("chair", [folders[0]], [], tmp_path / "run", settings=FEW)
    with pytest.raises(ModelError, match="holds weights of preset 'default', not what tells"):
        load_kind_network(untrained)


def test_the_zoo_keeps_it_apart_from_the_fields(trained, tmp_path, monkeypatch):
    assert add_to_zoo(trained, zoo=tmp_path).name == "step" and list_models(tmp_path) == []
    monkeypatch.setattr(kinds, "KIND_ZOO", tmp_path / "kind")
    assert [e.name for e in list_models(tmp_path / "kind")] == ["step"]
    assert kinds.find_kind_network("teapot") is None


@pytest.mark.parametrize("category", ["chair", "car", "plane"])
def test_what_ships_tells_members_from_turned_ones_and_from_others(category, caplog):
    entries = {entry.name: entry for entry in list_models(kinds.KIND_ZOO)}
    assert entries[category].bytes < 500_000
    taught = nrdf.load_model(category).set_reference(PointCloud(member(category)))
    with caplog.at_level(logging.WARNING):
        taught.retrieve(np.arange(2000), PointCloud(member(category, 1_000_010)))
    assert not caplog.records
    points = member(category)
    over, backwards = points * [1, -1, -1], points * [-1, 1, -1]
    lying = points[:, [0, 2, 1]] * [1, -1, 1]
    other = member("table" if category == "chair" else "chair")
    pair = np.concatenate([points, points + np.array([0, 0, 1.2])])
    for wrong, word in (
        (over, "upside down"), (backwards, "facing -X; give --up y"), (lying, "give --up z"),
        (other, "another kind of object"), (pair, "2 objects of comparable size"),
    ):  # fmt: skip
        caplog.clear()
        with caplog.at_level(logging.WARNING):
            taught.retrieve(np.arange(2000), PointCloud(wrong))
        assert [word in record.message for record in caplog.records] == [True], word


def test_an_aligned_scan_is_checked_in_its_pose():
    model = nrdf.load_model("chair")
    turn = upright(up_axis("z")) @ rotation_about_up(1.0)
    found = align(model, PointCloud(member("chair") @ turn.T), up="z")
    assert found.kind.fits and found.kind.probability > LEAST
    car = align(model, PointCloud(member("car") @ turn.T), up="z")
    assert not car.kind.fits and set(car.kind.warnings) <= set(car.warnings)


def test_without_a_network_a_target_is_compared_with_the_reference(monkeypatch):
    monkeypatch.setattr("nrdf.field.cloud_encoder.find_kind_network", lambda category: None)
    taught = nrdf.load_model("chair").set_reference(PointCloud(member("chair")))
    same = taught.check_kind(taught.model.encode(PointCloud(member("chair", 1_000_010))))
    car = taught.check_kind(taught.model.encode(PointCloud(member("car"))))
    lying = taught.check_kind(taught.model.encode(PointCloud(member("chair")[:, [0, 2, 1]])))
    assert same.fits and same.probability is None and not lying.fits
    assert "the field explains it at a cost of" in car.warnings[0]


def test_the_measurement_counts_what_is_doubted_and_leaves_out_what_is_of_the_kind(tmp_path):
    right = [("made", str(seed), member("chair", seed)) for seed in (1_000_003, 1_000_010)]
    for name in ("vase", "red_vase", "park_bench", "jar", "tin", "oar", "lid", "box", "rod"):
        (tmp_path / f"{name}.obj").write_text(TETRAHEDRON)
    with pytest.raises(DataError, match=r"holds \d meshes of other kinds, not 20"):
        benchmark.other_objects(tmp_path, "chair", 20)
    held = [p for p in tmp_path.iterdir() if is_held_out(p.stem) and p.stem != "park_bench"]
    others = benchmark.other_objects(tmp_path, "chair", len(held))
    assert {p.stem for p in others} == {p.stem for p in held} and 0 < len(held) < 8
    figures = benchmark.evaluate_kind(Saying(0), "chair", right, others)
    rows = {what: (doubted, of) for what, doubted, of, _ in benchmark.summary(figures)}
    assert rows["made"] == (0, 2) and rows["all turned objects"] == (0, 18)
    assert rows[benchmark.OTHERS] == (0, len(held)) and rows[benchmark.PAIRS] == (2, 2)
    figures = benchmark.evaluate_kind(Saying(OTHER), "chair", right, others)
    rows = {what: (doubted, of) for what, doubted, of, _ in benchmark.summary(figures)}
    assert rows["made"] == (2, 2) and rows["all turned objects"] == (18, 18)


def test_the_rotations_measured_are_a_quarter_or_a_half_turn():
    for rotations in benchmark.turns().values():
        assert all(0 < orientation_of(r) < 24 and np.allclose(r, np.round(r)) for r in rotations)
    (back,) = benchmark.turns()[benchmark.BACKWARDS]
    np.testing.assert_allclose(back, np.diag([-1.0, 1.0, -1.0]), atol=1e-9)
