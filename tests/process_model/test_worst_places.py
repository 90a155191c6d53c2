"""The worst places, named."""

from __future__ import annotations

import numpy as np
import pytest

from nrdf.process_model.cells import plate
from nrdf.process_model.result import Target
from nrdf.process_model.worst_places import place_in_words, worst_places

TARGET = Target(60e-6, 6e-6)
Y, X = np.array([0.0, 1.0, 0.0]), np.array([1.0, 0.0, 0.0])


def test_the_worst_are_told_first_each_once_and_none_within_the_tolerance():
    mesh = plate(1.0, 1.0, 0.02)
    at = mesh.vertices[mesh.faces].mean(axis=1)
    film = np.full(len(at), 60e-6)
    film[np.hypot(at[:, 0] - 0.4, at[:, 1]) < 0.05] = 90e-6
    film[np.hypot(at[:, 0] + 0.4, at[:, 1] + 0.45) < 0.05] = 20e-6
    found = worst_places(at, mesh.face_areas, film, TARGET, Y, X)
    assert [round(1e6 * place.value_m) for place in found] == [20, 90]
    assert [place.where for place in found] == ["rear bottom, at the edge", "front"]
    assert worst_places(at, mesh.face_areas, 0 * film + 60e-6, TARGET, Y, X) == []


def test_a_flat_seat_has_no_top_or_bottom():
    seat = plate(0.4, 0.4, 0.05).vertices[:, [0, 2, 1]]
    assert place_in_words(np.zeros(3), seat, Y, X) == "middle"
    assert place_in_words(np.array([0.0, 0.0, 0.2]), seat, Y, X) == "right, at the edge"


def test_a_speck_is_no_place():
    mesh = plate(1.0, 1.0, 0.01)
    film = np.full(len(mesh.faces), 60e-6)
    film[7] = 0.0
    at = mesh.vertices[mesh.faces].mean(axis=1)
    assert worst_places(at, mesh.face_areas, film, TARGET, Y, X) == pytest.approx([])
