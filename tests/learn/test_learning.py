"""From a folder to a model, judged and resumable."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from builders.desk_lamps import lamp, write_lamps
from nrdf.errors import DataError
from nrdf.field.general import GENERAL
from nrdf.learn import judge, learning
from nrdf.learn.judge import Errors
from nrdf.learn.learning import LEARNED, choose, learn
from nrdf.regions.model import load_model
from nrdf.training.general_field import FineTuneSettings

SHORT = FineTuneSettings(steps=2, batch=2, kinds=1)


@pytest.fixture(scope="module", autouse=True)
def quickly_judged():
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(judge, "COPIES", 1)
        patch.setattr(judge, "REFERENCES", 1)
        yield


@pytest.fixture(scope="module")
def learned(tmp_path_factory):
    folder = tmp_path_factory.mktemp("learned")
    write_lamps(folder / "in", 4)
    lamp(2).export(folder / "in" / "twin.stl")
    told = []
    found = learn(
        folder / "in", "lamp", folder / "out", settings=SHORT,
        progress=lambda *said: told.append(said),
    )  # fmt: skip
    return folder, found, told


def test_learning_gives_a_model_of_the_category(learned):
    _, found, told = learned
    assert list(dict.fromkeys(step for step, _, _ in told)) == list(learning.STEPS)
    model = load_model(found.weights)
    assert model.category == "lamp"
    assert set(found.used).isdisjoint(found.errors.names)
    assert len(found.used) + len(found.errors.names) == 4
    assert "not used: twin.stl is nearly the same as lamp2.ply" in found.notes
    scores = model.metadata["scores"]
    assert scores["held-out exact registration"] > 0
    assert found.models[LEARNED].metadata["shapes"]["in"]["count"] == 3
    assert found.describe()["winner"] == found.winner
    points = found.held_out[0].surface_points.astype(float)
    taught = model.set_reference(points)
    assert len(taught.retrieve(np.arange(2000), points, "points").indices) > 0


def test_started_again_it_goes_on_to_the_same(learned):
    folder, found, _ = learned
    told = []
    again = learn(
        folder / "in", "lamp", folder / "out", settings=SHORT,
        progress=lambda *said: told.append(said),
    )  # fmt: skip
    assert "reading" not in {step for step, _, _ in told}
    assert np.array_equal(again.errors.exact, found.errors.exact)
    assert again.winner == found.winner


@pytest.mark.parametrize(
    ("exact", "doubt", "winner", "said"),
    [
        ((0.01, 0.03, 0.02), (0.03, 0.03, 0.03), LEARNED, "learned model is 50% less far off"),
        ((0.03, 0.01, 0.02), (0.05, 0.03, 0.03), GENERAL, "general model is 50% less"),
        ((0.01, 0.015, 0.02), (0.05, 0.03, 0.03), GENERAL, "25% less far off"),
        ((0.03, 0.025, 0.02), (0.01, 0.01, 0.03), "registration", "25% farther off"),
        ((0.01, 0.03, 0.02), (0.04, 0.03, 0.03), "registration", "33% more in doubt"),
    ],
)
def test_the_best_model_is_chosen_by_both_measures(exact, doubt, winner, said):
    models = LEARNED, GENERAL, "registration"
    errors = Errors(("a",), models, np.array([exact]), np.array([doubt]))
    chosen, why = choose(errors)
    assert chosen == winner and said in why


def test_a_category_that_the_general_model_serves_has_it_under_its_name(learned, monkeypatch):
    folder, found, _ = learned
    monkeypatch.setattr(learning, "measure", lambda *_: found.errors)
    monkeypatch.setattr(learning, "choose", lambda errors: (GENERAL, "it is best"))
    served = learn(folder / "in", "lamp", folder / "out", settings=SHORT)
    model = load_model(served.weights)
    assert (model.preset, model.category) == (GENERAL, "lamp")
    assert GENERAL in found.errors.models and served.shown == (GENERAL, "registration")


def test_copies_of_one_object_are_no_kind(tmp_path):
    for n in range(4):
        lamp(0).export(tmp_path / f"{n}.ply")
    with pytest.raises(DataError, match="1 object is different from each other"):
        learn(tmp_path, "lamp", tmp_path / "out", settings=SHORT)


def test_several_kinds_are_not_learned_as_one(tmp_path):
    write_lamps(tmp_path, 2)
    trimesh.creation.cylinder(0.05, 2).export(tmp_path / "pole.ply")
    trimesh.creation.icosphere().export(tmp_path / "ball.ply")
    trimesh.creation.box((0.1, 1, 2)).export(tmp_path / "wall.ply")
    with pytest.raises(DataError, match="several kinds of objects, or --up is wrong"):
        learn(tmp_path, "lamp", tmp_path / "out", settings=SHORT)


def test_an_unknown_file_for_the_heading_is_refused(tmp_path):
    write_lamps(tmp_path, 3)
    with pytest.raises(DataError, match=r"--forward names 'lamp9\.ply', which is none"):
        learn(tmp_path, "lamp", tmp_path / "out", forward="lamp9.ply", settings=SHORT)
