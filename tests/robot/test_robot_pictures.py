"""Pictures of the arm, where this machine can draw."""

from __future__ import annotations

from importlib.util import find_spec

import pytest

# Not by importing it: nrdf must be first, to choose what MuJoCo draws with.
if find_spec("mujoco") is None:
    pytest.skip("pip install 'nrdf[robot]'", allow_module_level=True)

from nrdf.robot.model.cell import Placement
from nrdf.robot.report.pictures import COVERAGE, STILL, draw_pictures
from nrdf.robot.simulation.job import read_simulation_job
from nrdf.robot.simulation.simulate import simulate


def test_pictures_show_arm_and_object(plate_job, arm, tmp_path):
    import numpy as np
    from matplotlib.image import imread

    place = Placement((0.75, 0.0, 0.3), np.pi, 0.0, (0.0,))
    done = simulate(read_simulation_job(plate_job), arm, placement=place)
    missing = draw_pictures(tmp_path, done, film=False)
    if missing:
        pytest.skip(missing)
    still, coverage = imread(tmp_path / STILL)[..., :3], imread(tmp_path / COVERAGE)[..., :3]
    # The bundled arm's joints are blue; what was worked is green.
    assert ((still[..., 2] > 1.3 * still[..., 0]) & (still[..., 2] > 0.25)).mean() > 0.003
    assert ((coverage[..., 1] > 1.5 * coverage[..., 0]) & (coverage[..., 1] > 0.2)).mean() > 0.01
