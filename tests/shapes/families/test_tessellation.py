"""Members as triangles that know their surface coordinates."""

from __future__ import annotations

import numpy as np
import pytest

from nrdf.shapes.families.base import Part, Window
from nrdf.shapes.families.member import Member
from nrdf.shapes.families.sections import Superellipse
from nrdf.shapes.families.tessellation import tessellate


@pytest.fixture(scope="module")
def member() -> Member:
    plate = Superellipse(0.5, 0.05, 20.0)
    return Member(
        ("plate",), [Part("plate", 1, 0.0, 1.0, plate, windows=(Window(0, 0.5, 0.4, 0.4),))]
    )


def test_vertices_lie_where_their_coordinates_say(member: Member) -> None:
    made = tessellate(member)
    used = np.unique(made.faces)
    located = member.locate(made.coordinates[used])
    np.testing.assert_allclose(
        located.points[located.exists], made.vertices[used][located.exists], atol=1e-9
    )


def test_a_window_is_left_open(member: Member) -> None:
    made = tessellate(member)
    middle = made.vertices[made.faces].mean(axis=1)
    through = (np.abs(middle[:, 2]) < 0.1) & (np.abs(middle[:, 1]) < 0.1)
    assert not through.any()


def test_a_place_on_a_triangle_has_the_mean_of_its_corners(member: Member) -> None:
    made = tessellate(member)
    face = np.array([0, 100])
    third = np.full(2, 1 / 3)
    corners = made.faces[face]
    at = made.at(face, third, third)
    np.testing.assert_allclose(at.u, made.coordinates.u[corners].mean(axis=1))
    np.testing.assert_array_equal(at.slot, made.coordinates.slot[corners[:, 0]])
