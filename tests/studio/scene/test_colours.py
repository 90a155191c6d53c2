"""Colours of points: by region, by confidence, by similarity."""

from __future__ import annotations

import numpy as np

from nrdf.studio.scene.colours import confidence_colours, painted_colours, similarity_colours
from nrdf.viz.palette import SEVERAL_REGIONS


def test_a_region_is_paler_where_the_confidence_is_lower():
    red = (200, 0, 0)
    drawn = painted_colours(4, [(red, np.array([0, 1]), np.array([1.0, 0.2]))])
    assert tuple(drawn[0]) == red and (drawn[1] > drawn[0]).all()
    assert (drawn[2] == drawn[3]).all(), "points of no region"


def test_points_of_two_regions_have_a_colour_of_their_own():
    one, other = (np.array([0, 1]), np.array([1, 2]))
    drawn = painted_colours(3, [((200, 0, 0), one, None), ((0, 200, 0), other, None)])
    assert (drawn[1] == np.array(SEVERAL_REGIONS).astype(np.uint8)).all()
    assert (drawn[0] == (200, 0, 0)).all() and (drawn[2] == (0, 200, 0)).all()


def test_confidence_goes_from_red_to_green():
    drawn = confidence_colours(3, [(np.array([0, 1]), np.array([0.0, 1.0]))]).astype(int)
    assert drawn[0, 0] > drawn[0, 1] and drawn[1, 1] > drawn[1, 0]


def test_similarity_fades_with_the_descriptor_distance():
    near = similarity_colours(np.array([0.0, 0.1, 9.0]), 0.1).astype(int)
    wide = similarity_colours(np.array([0.0, 0.1, 9.0]), 1.0).astype(int)
    assert (near[0] == wide[0]).all() and (near[2] == wide[2]).all()
    assert near[0, 0] > wide[1, 0] > near[1, 0] > near[2, 0]
