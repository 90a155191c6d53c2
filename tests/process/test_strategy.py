from __future__ import annotations

import numpy as np

from builders.taught_box import SAND
from nrdf.process.process import Process
from nrdf.process.strategy import strategy_of, tool_path
from nrdf.toolpath.types import Segment


def process(**changes):
    return Process.model_validate({**SAND, "direction": [0, 0, 1], "passes": 2, **changes})


def test_the_strategy_is_what_the_process_says():
    made = strategy_of(process(edge_margin_m=0.01, lead_rad=0.1))
    assert (made.trajectory, made.passes, made.edge_margin_m) == ("raster", 2, 0.01)
    assert (made.lead_rad, made.tool_radius_m) == (0.1, process().tool.radius_m)
    np.testing.assert_array_equal(made.direction, [0.0, 0.0, 1.0])
    np.testing.assert_array_equal(strategy_of(process(), np.ones(3)).direction, np.ones(3))


def test_an_overlap_gives_the_stepover():
    content = {key: value for key, value in SAND.items() if not key.startswith("stepover")}
    half = Process.model_validate({**content, "overlap": 0.5})
    assert strategy_of(half).stepover_m == half.tool.radius_m


def test_what_touches_stays_on_the_surface_between_lines_and_what_sprays_does_not():
    order = {kind: strategy_of(process(kind=kind)).line_order for kind in ("sand", "oil", "clean")}
    assert set(order.values()) == {"zigzag"}
    for kind in ("paint", "inspect"):
        assert strategy_of(process(kind=kind, force_n=None)).line_order == "snake"
    one_way = process(kind="paint", force_n=None, line_order="one-way")
    assert strategy_of(one_way).line_order == "one-way"


def test_settings_of_modifiers_are_handed_on():
    given = {
        "start": "far-left", "run_off_mm": 40, "run_off_height_mm": 10, "lead_in_radius_mm": 20,
        "lead_out_radius_mm": 30, "offset_mm": -1, "drag_mm": 5, "edge_contact_mm": 25,
        "lead_deg": 5, "largest_turn_deg_mm": 2, "chord_error_mm": 0.1, "minimum_length_mm": 12,
        "origin_mm": [100, 0, -200], "resample_step_mm": 60, "resample_turn_deg": 10,
        "join_gap_mm": 8, "heading": "fixed", "constant_speed": True, "direction_mode": "fixed",
    }  # fmt: skip
    made = strategy_of(process(**given))
    assert (made.start, made.heading, made.direction_mode) == ("far-left", "fixed", "fixed")
    lengths = made.run_off_m, made.run_off_height_m, made.lead_in_radius_m, made.lead_out_radius_m
    assert lengths == (0.04, 0.01, 0.02, 0.03)
    assert (made.offset_m, made.drag_m, made.edge_contact_m) == (-0.001, 0.005, 0.025)
    assert (made.chord_error_m, made.least_line_m, made.joined_gap_m) == (0.0001, 0.012, 0.008)
    assert made.constant_speed
    assert made.origin_m.tolist() == [0.1, 0.0, -0.2] and made.resample_step_m == 0.06
    assert np.isclose(made.resample_turn_rad, np.radians(10.0))
    assert np.isclose(made.largest_turn_rad_m, np.radians(2.0) * 1e3)
    assert np.isclose(strategy_of(process()).largest_turn_rad_m, np.radians(3.0) * 1e3)


def test_a_tool_path_has_the_strategy_that_made_it():
    segment = Segment("process", 0, np.zeros((1, 3)), np.eye(4)[:1], 0.1)
    path = tool_path("top", process(), [segment])
    assert (path.region, path.process, path.tool) == ("top", "sand", process().tool.name)
    assert path.strategy is not None and path.strategy.passes == 2
    assert path.segments == (segment,)
