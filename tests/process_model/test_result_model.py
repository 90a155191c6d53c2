"""What a path leaves at any feeds."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from builders.plate_passes import FEED, passes
from nrdf.process_model.cells import plate
from nrdf.process_model.removal import Pad
from nrdf.process_model.result import Target
from nrdf.process_model.result_model import ResultModel, with_feeds
from nrdf.process_model.spray_profile import SprayProfile
from nrdf.surface.region_mesh import RegionMesh

GUN = SprayProfile(0.04, 0.03, 4e-7, 0.2)


def half_a_plate():
    mesh = plate(0.4, 0.3, 0.02)
    return RegionMesh.from_faces(mesh, mesh.vertices[mesh.faces].mean(axis=1)[:, 0] < 0.0)


def test_what_leaves_the_gun_is_on_the_region_beside_it_or_in_the_air():
    model = ResultModel.of(half_a_plate(), passes([0.0], 0.2), GUN)
    found = model.measure(Target(60e-6, 6e-6))
    assert found.seconds == pytest.approx(0.2 / FEED)
    assert found.overspray == pytest.approx(0.5, abs=0.02)
    assert found.beside == pytest.approx(0.5, abs=0.02)
    spilt = float(model.spill_m3() @ model.moves.slowness)
    assert spilt == pytest.approx(found.overspray * GUN.flow_m3_s * found.seconds)


def test_slower_leaves_more_and_a_dwell_its_share():
    segments = passes([-0.1], 0.2)
    model = ResultModel.of(half_a_plate(), segments, GUN)
    slow = model.values(0.5 * model.moves.feeds_m_s)
    assert slow == pytest.approx(2.0 * model.values())
    waiting = ResultModel.of(half_a_plate(), [replace(segments[0], dwell_s=1.0)], GUN)
    more = waiting.cells.areas_m2 @ (waiting.values() - model.values())
    assert more == pytest.approx(GUN.flow_m3_s, rel=0.02)


def test_a_pad_takes_off_and_wastes_nothing():
    pad = Pad(0.04, 2e7, 5e-9, 20.0, 1000.0, 0.0025)
    model = ResultModel.of(half_a_plate(), passes([-0.1], 0.2, 0.0), pad)
    assert model.spill_m3().sum() == 0.0
    assert model.measure(Target(60e-6, 6e-6)).overspray == 0.0


def test_a_pad_presses_nothing_where_it_runs_off_but_a_gun_sprays_there():
    """The whole pad's force would otherwise lie on the part of it that is over the edge."""
    pad = Pad(0.04, 2e7, 5e-9, 20.0, 1000.0, 0.0025)
    line = passes([-0.1], 0.3, 0.0)[0]
    off = np.abs(line.positions[:, 1]) > 0.13
    over = replace(line, on_surface=~off, dwell_s=1.0)
    assert off[-1] and not off.all()
    short = replace(
        line, positions=line.positions[~off], quaternions_xyzw=line.quaternions_xyzw[~off]
    )
    pressed = ResultModel.of(half_a_plate(), [over], pad)
    assert pressed.values() == pytest.approx(
        ResultModel.of(half_a_plate(), [short], pad).values(), rel=1e-9
    )
    gun, sprayed = (
        ResultModel.of(half_a_plate(), [one], GUN).values()
        for one in (replace(line, dwell_s=1.0), over)
    )
    assert sprayed == pytest.approx(gun)


def test_segments_take_the_feeds_of_their_moves():
    segments = passes([-0.1, -0.05], 0.02)
    model = ResultModel.of(half_a_plate(), segments, GUN)
    driven = with_feeds(segments, model.moves, np.array([0.1, 0.2, 0.3, 0.4]))
    assert [s.feeds_m_s.tolist() for s in driven] == [[0.1, 0.1, 0.2], [0.3, 0.3, 0.4]]
    assert driven[0].feed_m_s == pytest.approx(0.02 / (0.01 / 0.1 + 0.01 / 0.2))
    again = ResultModel.of(half_a_plate(), driven, GUN)
    assert again.values() == pytest.approx(model.values(np.array([0.1, 0.2, 0.3, 0.4])))
