"""A painted session, its results, and a studio without a browser."""

from __future__ import annotations

from importlib.util import find_spec

import numpy as np
import pytest

import nrdf
from builders.studio_page import Page, box_editor, small_box


@pytest.fixture
def painted(tmp_path):
    """An editor with the region 'top' on a box."""
    return box_editor(tmp_path / "session", top="sand")


@pytest.fixture
def results(tmp_path, untrained):
    """A result cache of two regions on a box, and a target."""
    from nrdf.studio.model.computing import LocalComputing
    from nrdf.studio.model.result_cache import ResultCache

    editor = box_editor(tmp_path / "session", top="sand", front="oil")
    editor.add_target("new.ply", small_box(1.1, seed=1))
    return ResultCache(editor, LocalComputing(lambda category: nrdf.load_model(untrained)))


@pytest.fixture
def page(tmp_path, untrained):
    """A studio whose inputs are called without a browser."""
    pytest.importorskip("viser", reason="pip install 'nrdf[studio]'")
    page = Page(tmp_path / "session", untrained)
    yield page
    page.end()


@pytest.fixture(scope="session")
def playback(plate_job, arm):
    """The simulated job on a plate, with the turntable at 0.4 rad."""
    # Not by importing it: nrdf must be first, to choose what MuJoCo draws with.
    if find_spec("mujoco") is None:
        pytest.skip("pip install 'nrdf[robot]'")
    from nrdf.robot.model.cell import Placement
    from nrdf.robot.simulation.job import read_simulation_job
    from nrdf.robot.simulation.simulate import simulate
    from nrdf.studio.model.playback import playback_of

    place = Placement((0.75, 0.1, 0.3), np.pi + 0.1, 0.2, (0.4,))
    return playback_of(simulate(read_simulation_job(plate_job), arm, placement=place))


@pytest.fixture
def scene_view():
    """An empty scene, without a browser."""
    pytest.importorskip("viser", reason="pip install 'nrdf[studio]'")
    from nrdf.studio.scene.scene_view import SceneView
    from nrdf.studio.serving import open_server

    server = open_server("127.0.0.1", 8465)
    scene_view = SceneView(server)
    scene_view.clear(2.5)
    yield scene_view
    server.stop()


@pytest.fixture
def plate_cloud(plate_job):
    """The plate of that job as it is shown."""
    from nrdf.io.cloud import read_cloud
    from nrdf.studio.model.paintable_cloud import PaintableCloud

    return PaintableCloud(read_cloud(plate_job / "target.ply"))
