from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from builders.taught_box import SAND, SIZE, solid
from nrdf.errors import ProcessError
from nrdf.process.process import Process
from nrdf.process.taught_paths import (
    normals_under,
    taught_segments,
)
from nrdf.surface.target_mesh import TargetMesh

TOP = SIZE[1] / 2


@pytest.fixture(scope="module")
def mesh():
    return TargetMesh.from_mesh(solid().mesh)


def process(*lines, **changes):
    waypoints = [line if isinstance(line, dict) else {"positions_m": line} for line in lines]
    content = {"kind": "sand", "trajectory": "taught", "waypoints": waypoints, "dwell_s": 0.5}
    tool = SAND["tool"]
    return Process.model_validate({**content, "tool": tool, "feed_m_s": 0.07, **changes})


def test_each_taught_line_is_a_process_segment(mesh):
    lines = [[[-0.1, TOP, z], [0.1, TOP, z]] for z in (-0.1, 0.1)]
    segments = taught_segments(process(*lines, force_n=8.0), mesh)
    assert [(s.kind, s.line) for s in segments] == [("process", 0), ("process", 1)]
    assert {(s.feed_m_s, s.force_n, s.dwell_s) for s in segments} == {(0.07, 8.0, 0.5)}
    np.testing.assert_array_equal(segments[1].positions, lines[1])
    # Without orientations, the tool stands on the surface and points along the travel.
    np.testing.assert_allclose(segments[0].axes, [[0.0, -1.0, 0.0]] * 2, atol=1e-6)
    for normals in normals_under(mesh, segments, 0.025):
        np.testing.assert_allclose(normals, [[0.0, 1.0, 0.0]] * 2, atol=1e-6)


def test_given_orientations_stay(mesh):
    held = Rotation.from_euler("x", [[1.4], [1.5]]).as_quat().tolist()
    line = {"positions_m": [[-0.1, TOP, 0.0], [0.1, TOP, 0.0]], "quaternions_xyzw": held}
    (segment,) = taught_segments(process(line), mesh)
    np.testing.assert_allclose(segment.quaternions_xyzw, held)


def test_a_waypoint_off_the_reference_is_named(mesh):
    line = [[0.0, TOP, 0.0], [0.0, TOP + 0.2, 0.0]]
    with pytest.raises(ProcessError, match=r"number 2 of line 1 is .* from the reference"):
        taught_segments(process(line), mesh)
    assert taught_segments(process(line, standoff_m=0.25), mesh)
