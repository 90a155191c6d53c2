"""Which model serves a category: its own, a named one, or the general one; slips are asked back."""

from __future__ import annotations

import logging

import pytest

from nrdf.errors import ModelError, ProcessError
from nrdf.process.knowledge import Knowledge
from nrdf.process.model_choice import (
    check_new_category,
    choose_model,
    model_name_for,
    nearly_called,
)


def test_a_known_category_has_its_own_model():
    assert choose_model("chair").name == "chair" and choose_model("chair").note == ""


@pytest.mark.parametrize("category", ["helmet", "bathtub", "sofa", "stool", "vase", "worktable"])
def test_a_new_category_is_served_by_the_general_model_and_it_is_said(category):
    chosen = choose_model(category)
    assert chosen.name == "general"
    assert f"no model for the category '{category}'" in chosen.note


@pytest.mark.parametrize(
    ("slip", "meant"),
    [
        ("chiar", "chair"),
        ("Chair", "chair"),
        ("palne", "plane"),
        ("cra", "car"),
    ],
)
def test_a_slip_of_the_pen_is_asked_back_unless_it_is_meant(slip, meant):
    with pytest.raises(ProcessError, match=f"did you mean '{meant}'.*--model general"):
        choose_model(slip)
    assert choose_model(slip, "registration").name == "registration"
    assert choose_model(slip, allow_unusual=True).name == "general"


def test_a_model_that_is_given_must_be_for_the_category(untrained):
    assert choose_model("chair", untrained).name == str(untrained)
    assert choose_model("helmet", "general").name == "general"
    with pytest.raises(ProcessError, match="but the model car is for car; give another"):
        choose_model("chair", "car")
    with pytest.raises(ModelError, match="no model 'nothing'"):
        choose_model("chair", "nothing")


def test_the_model_that_a_knowledge_names_is_taken(caplog):
    region = {
        "name": "top",
        "indices": [0],
        "processes": [{"kind": "clean", "feed_m_s": 0.1, "overlap": 0.3}],
    }
    region["processes"][0]["tool"] = {"name": "brush", "radius_m": 0.02}
    content = {"reference": {"cloud": "a.ply"}, "regions": [region]}
    with caplog.at_level(logging.INFO):
        assert model_name_for(Knowledge(category="car", **content)) == "car"
        named = Knowledge(category="car", model="registration", **content)
        assert model_name_for(named) == "registration"
        assert not caplog.records
        assert model_name_for(Knowledge(category="helmet", **content)) == "general"
    assert "found by the general model" in caplog.text


def test_a_category_to_be_learned_must_be_a_name_and_may_be_nearly_called_like_another(caplog):
    check_new_category("bath tub")
    assert not caplog.records and nearly_called("chair") == ""
    check_new_category("chairs")
    assert "'chairs' is nearly called like 'chair'" in caplog.text
    for wrong in ("", "a/b", "con", "registration", "general"):
        with pytest.raises(ProcessError, match=r"is no name|is the name"):
            check_new_category(wrong)
