"""Tools off their contact: along the normal, along the travel, on the edge of a tilted disc."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from builders.surface_paths import over_an_edge, rows, straight
from nrdf.toolpath.modifiers import drag, edge_contact, offset
from nrdf.toolpath.strategy import Strategy
from nrdf.toolpath.tool_segments import tool_segments

RADIUS = 0.025


def test_an_offset_is_along_the_normal():
    given = over_an_edge(0.5)
    (made,) = offset([given], 0.002)
    assert made.contacts - given.contacts == pytest.approx(0.002 * given.normals)
    (pressed,) = offset([given], -0.001)
    assert (pressed.contacts[0] - given.contacts[0]) == pytest.approx([0, 0, -0.001])
    assert offset([given], 0.0)[0] is given


def test_what_trails_behind_the_centre_touches_where_the_path_was():
    forth, back = rows([0.0, 0.02])[0], rows([0.0, 0.02])[1].reversed()
    made = drag([forth, back], 0.005)
    assert made[0].contacts - forth.contacts == pytest.approx(np.tile([0.005, 0, 0], (21, 1)))
    assert made[1].contacts - back.contacts == pytest.approx(np.tile([-0.005, 0, 0], (21, 1)))
    assert drag([forth], 0.0)[0] is forth


def test_the_centre_goes_around_a_corner_in_an_arc():
    one, two = straight((0, 0, 0), (0.1, 0, 0)), straight((0.1, 0.01, 0), (0.1, 0.1, 0))
    whole = type(one)(
        np.concatenate([one.contacts, two.contacts]), np.concatenate([one.normals, two.normals])
    )
    (made,) = drag([whole], 0.01, smooth_m=0.02)
    assert np.linalg.norm(made.contacts - whole.contacts, axis=1) == pytest.approx(0.01)
    ahead = (made.contacts - whole.contacts)[8:13] / 0.01
    assert (np.diff(ahead[:, 1]) > 0).all() and (np.diff(ahead[:, 0]) < 0).all()


def held(lead: float, tilt: float):
    path = straight((0, 0, 0), (0.1, 0, 0))
    strategy = Strategy(lead_rad=lead, tilt_rad=tilt)
    return tool_segments([path.contacts], [path.normals], strategy)


@pytest.mark.parametrize(("lead", "tilt"), [(0.2, 0.0), (-0.2, 0.0), (0.0, 0.3), (0.2, -0.3)])
def test_the_disc_lies_on_the_surface_with_its_lowest_point_on_the_contact(lead, tilt):
    (before,) = held(lead, tilt)
    (after,) = edge_contact([before], RADIUS, lead, tilt)
    rim = np.linspace(0.0, 2.0 * np.pi, 721)
    circle = RADIUS * np.stack([np.cos(rim), np.sin(rim), 0 * rim], axis=1)
    turned = Rotation.from_quat(after.quaternions_xyzw[3]).apply(circle) + after.positions[3]
    lowest = turned[np.argmin(turned[:, 2])]
    assert lowest == pytest.approx(before.positions[3], abs=3e-4)
    assert lowest[2] == pytest.approx(0.0, abs=1e-6)


def test_with_its_tail_forward_it_touches_with_its_front():
    (before,) = held(0.2, 0.0)
    (after,) = edge_contact([before], RADIUS, 0.2, 0.0)
    assert (after.positions - before.positions)[:, 0] == pytest.approx(-RADIUS * np.cos(0.2))
    np.testing.assert_array_equal(after.quaternions_xyzw, before.quaternions_xyzw)


def test_an_upright_disc_stays():
    (before,) = held(0.0, 0.0)
    assert edge_contact([before], RADIUS, 0.0, 0.0)[0] is before
