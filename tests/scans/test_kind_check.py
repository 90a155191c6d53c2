"""The check of the kind of object: its words, and what the shipped networks tell."""

from __future__ import annotations

import logging

import numpy as np
import pytest

import nrdf
from builders.kinds import Saying, member
from nrdf.field.kind_network import (
    ASKEW,
    KIND_ZOO,
    ORIENTATIONS,
    OTHER,
    TILTED,
    orientation_of,
)
from nrdf.field.zoo import list_models
from nrdf.geometry.canonical import rotation_about_up
from nrdf.geometry.similarity import up_axis, upright
from nrdf.io.cloud import PointCloud
from nrdf.scans.aligned_scan import align
from nrdf.scans.kind_check import CONFIRMED, FITS, MINIMUM_PROBABILITY, check_by_network


def said(answer: int, rotation=None) -> str:
    rotation = np.eye(3) if rotation is None else rotation
    (warning,) = check_by_network(Saying(answer), "chair", np.zeros((5, 3)), rotation).warnings
    return warning


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


def test_a_confirmed_pose_is_not_warned_of_but_another_kind_is():
    quarter = orientation_of(rotation_about_up(np.pi / 2))
    for answer in (quarter, TILTED, ASKEW + 1):
        seen = check_by_network(Saying(answer), "chair", np.zeros((5, 3)), np.eye(3))
        assert not seen.fits and seen.of_confirmed_pose.fits
        assert seen.of_confirmed_pose.taken_for == CONFIRMED
    other = check_by_network(Saying(OTHER), "chair", np.zeros((5, 3)), np.eye(3))
    (warning,) = other.of_confirmed_pose.warnings
    assert "may be no chair" in warning and "--up" not in warning
    fits = check_by_network(Saying(0), "chair", np.zeros((5, 3)), np.eye(3))
    assert fits.of_confirmed_pose is fits


@pytest.mark.parametrize("category", ["chair", "car", "plane"])
def test_what_ships_tells_members_from_turned_ones_and_from_others(category, caplog):
    entries = {entry.name: entry for entry in list_models(KIND_ZOO)}
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
    assert found.kind.fits and found.kind.probability > MINIMUM_PROBABILITY
    car = align(model, PointCloud(member("car") @ turn.T), up="z")
    assert not car.kind.fits and set(car.kind.warnings) <= set(car.warnings)


def test_without_a_network_a_target_is_compared_with_the_reference(monkeypatch):
    monkeypatch.setattr("nrdf.field.cloud_encoder.find_kind_network", lambda category: None)
    taught = nrdf.load_model("chair").set_reference(PointCloud(member("chair")))
    same = taught.check_kind(taught.model.encode(PointCloud(member("chair", 1_000_010))))
    car = taught.check_kind(taught.model.encode(PointCloud(member("car"))))
    lying = taught.check_kind(taught.model.encode(PointCloud(member("chair")[:, [0, 2, 1]])))
    assert same.fits and same.probability is None and not lying.fits
    assert "what is known explains it at a cost of" in car.warnings[0]
    assert "standing with +Z up; give --up z" in lying.warnings[0]
