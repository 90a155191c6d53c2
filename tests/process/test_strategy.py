from __future__ import annotations

import numpy as np

from builders.taught_box import SAND
from nrdf.process.knowledge import Process
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


def test_a_tool_path_has_the_strategy_that_made_it():
    segment = Segment("process", 0, np.zeros((1, 3)), np.eye(4)[:1], 0.1)
    path = tool_path("top", process(), [segment])
    assert (path.region, path.process, path.tool) == ("top", "sand", process().tool.name)
    assert path.strategy is not None and path.strategy.passes == 2
    assert path.segments == (segment,)
