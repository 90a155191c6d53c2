"""Paths on the reference: as taught, or planned on its mesh."""

from __future__ import annotations

import numpy as np
import pytest

from builders.taught_box import SAND, SIZE, bound_knowledge, cloud, solid
from nrdf.errors import ProcessError
from nrdf.io.cloud import PointCloud
from nrdf.process.reference_paths import ReferencePaths

LINE = [[0.25, 0.1, z] for z in np.linspace(-0.3, 0.3, 13).tolist()]
TAUGHT = {**SAND, "trajectory": "taught", "waypoints": [{"positions_m": LINE}]}


def test_strategies_are_planned_once_on_the_references_mesh():
    spray = {**SAND, "force_n": None, "passes": 3, "standoff_mm": 100}
    paths = ReferencePaths(bound_knowledge({"top": [spray]}, solid()))
    segments = paths.segments("top", 0)
    assert {segment.kind for segment in segments} == {"process"}
    assert paths.segments("top", 0) is segments
    # One pass, whatever the process asks for; contacts are on the mesh, the tool above it.
    contacts = np.concatenate(paths.contacts("top", 0))
    np.testing.assert_allclose(contacts[:, 1], SIZE[1] / 2, atol=1e-9)
    heights = np.concatenate([segment.positions[:, 1] for segment in segments])
    np.testing.assert_allclose(heights, SIZE[1] / 2 + 0.1, atol=1e-9)
    assert sum(len(s.positions) for s in segments) < 1.5 * 0.5 * 0.9 / (0.04 * 0.02)


def test_taught_lines_are_as_they_were_taught():
    paths = ReferencePaths(bound_knowledge({"front": [TAUGHT]}))
    (segment,) = paths.segments("front", 0)
    np.testing.assert_allclose(segment.positions, LINE)
    np.testing.assert_allclose(segment.axes, np.tile([-1.0, 0.0, 0.0], (13, 1)), atol=0.05)


def test_a_reference_without_normals_gets_some():
    taught = bound_knowledge({"top": [SAND]})
    bare = type(taught)(taught.knowledge, PointCloud(cloud().points, unit="m"), taught.regions)
    paths = ReferencePaths(bare)
    assert paths.cloud.normals.shape == bare.cloud.points.shape
    assert paths.region("top").area_m2 == pytest.approx(SIZE[0] * SIZE[2], rel=0.3)


def test_a_region_smaller_than_its_tool_has_none():
    paths = ReferencePaths(bound_knowledge({"top": [{**SAND, "tool": {"radius_mm": 400}}]}))
    with pytest.raises(ProcessError, match="smaller than the tool's footprint"):
        paths.region("top")
