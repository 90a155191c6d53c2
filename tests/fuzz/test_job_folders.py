"""Damaged job folders: what simulation and export read of them is a job or a refusal.

The object's cloud is damaged where clouds are (`test_readers`); a job's report is read by nothing.
"""

from __future__ import annotations

import json
import shutil
from importlib.util import find_spec

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import nrdf
from builders.fuzzing import altered, damaged, outcome_of, tries
from nrdf.errors import NrdfError
from nrdf.export.registry import export_job
from nrdf.geometry.similarity import Similarity, up_axis, upright
from nrdf.process.knowledge import Knowledge, Reference, Region
from nrdf.process.knowledge_file import write_knowledge
from nrdf.process.process import Process
from nrdf.process.strategy import tool_path
from nrdf.process.tool_keys import Tool
from nrdf.toolpath.file import read_toolpaths, write_toolpaths
from nrdf.toolpath.types import Job, Segment

WRITTEN = ("csv", "json", "urscript", "krl")


@pytest.fixture(scope="module")
def job(tmp_path_factory):
    """A plate of 0.3 m, z up, sanded twice along one line."""
    folder = tmp_path_factory.mktemp("job")
    flat = np.random.default_rng(0).uniform(-0.15, 0.15, (400, 2))
    top, up = np.insert(flat, 2, 0.42, axis=1), np.tile([0.0, 0.0, 1.0], (400, 1))
    points, normals = np.r_[top, top - [0, 0, 0.03]], np.r_[up, -up]
    nrdf.write_cloud(folder / "target.ply", nrdf.PointCloud(points, normals, unit="m"))
    tool = Tool(name="disc", radius_m=0.025)
    processes = [
        Process(kind="sand", name=name, stepover_m=0.03, feed_m_s=0.1, force_n=10.0, tool=tool)
        for name in ("sand", "sand 2")
    ]
    region = Region(name="top", indices=list(range(400)), processes=processes)
    reference = Reference(cloud="target.ply")
    knowledge = Knowledge(category="chair", reference=reference, regions=[region])
    write_knowledge(folder / "knowledge.yaml", knowledge)
    line = np.c_[np.linspace(-0.1, 0.1, 5), np.zeros(5), np.full(5, 0.42)]
    held = np.tile([1.0, 0.0, 0.0, 0.0], (5, 1))
    segment = Segment("process", 0, line, held, 0.1, 10.0)
    paths = tuple(tool_path("top", process, (segment,)) for process in processes)
    pose = Similarity(upright(up_axis("z")), np.array([0.0, 0.0, 0.42]), 0.3)
    write_toolpaths(folder, Job("chair", "target", paths, pose))
    return folder


def changed(job, tmp_path, name, content):
    """A copy of the job with one file changed."""
    folder = tmp_path / "job"
    shutil.rmtree(folder, ignore_errors=True)
    shutil.copytree(job, folder)
    (folder / name).write_bytes(content)
    return folder


def use(folder):
    """What export and simulation do first with a job's folder."""
    whole = read_toolpaths(folder)
    out = folder.parent / "programs"
    shutil.rmtree(out, ignore_errors=True)
    export_job(whole, WRITTEN, out)
    if find_spec("mujoco") is None:
        return whole, None
    from nrdf.robot.simulation.job import read_simulation_job

    return whole, read_simulation_job(folder)


def check(folder):
    found = outcome_of(lambda: use(folder))
    if isinstance(found, NrdfError):
        return
    whole, work = found
    for segment in (s for path in whole.paths for s in path.segments):
        assert np.isfinite(segment.positions).all() and segment.feed_m_s > 0
        np.testing.assert_allclose(np.linalg.norm(segment.quaternions_xyzw, axis=1), 1, atol=1e-5)
    if whole.pose is not None:
        assert np.isfinite(whole.pose.translation).all() and whole.pose.scale > 0
        np.testing.assert_allclose(
            whole.pose.rotation @ whole.pose.rotation.T, np.eye(3), atol=1e-9
        )
    if work is not None:
        np.testing.assert_allclose(work.upright @ work.upright.T, np.eye(3), atol=1e-9)
        for path, strategy in zip(whole.paths, work.strategies, strict=True):
            assert strategy.standoff_m == path.strategy.standoff_m >= 0


def test_the_job_itself_is_good(job):
    whole, work = use(job)
    assert len(whole.paths) == 2
    if work is not None:
        assert [path.process for path in whole.paths] == ["sand", "sand 2"]
        assert len(work.strategies) == 2


@tries(60)
@given(data=st.data())
def test_altered_tool_paths(job, tmp_path, data):
    tree = json.loads((job / "toolpaths.json").read_text())
    # Not the waypoints alone, which are most of the file.
    part = data.draw(st.sampled_from(["pose", "paths", None]))
    made = data.draw(altered(tree if part is None else {part: tree[part]}))
    if part is not None and isinstance(made, dict):
        made = {**{k: v for k, v in tree.items() if k != part}, **made}
    text = json.dumps(made)  # NaN and Infinity too, as other programs write them
    check(changed(job, tmp_path, "toolpaths.json", text.encode()))


@tries(60)
@given(data=st.data())
@pytest.mark.parametrize("name", ["toolpaths.json", "knowledge.yaml"])
def test_damaged_files(job, tmp_path, name, data):
    content = data.draw(damaged((job / name).read_bytes()))
    check(changed(job, tmp_path, name, content))
