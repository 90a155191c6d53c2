from __future__ import annotations

import json
from dataclasses import fields

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from nrdf.errors import OutputError, ProcessError
from nrdf.geometry.similarity import Similarity
from nrdf.toolpath.file import FILE, read_toolpaths, write_toolpaths
from nrdf.toolpath.strategy import Strategy
from nrdf.toolpath.types import Job, Segment, ToolPath

POSE = Similarity(
    Rotation.from_euler("xyz", [0.3, -1.2, 2.0]).as_matrix(), np.array([1.0, -0.5, 0.25]), 0.9
)
STRATEGY = Strategy("spiral", np.array([0.0, 0.6, 0.8]), 0.03, tilt_rad=0.1, force_n=12.5)


def random_segment(rng, kind="process", count=7):
    quaternions = rng.normal(size=(count, 4))
    quaternions /= np.linalg.norm(quaternions, axis=1, keepdims=True)
    force = 12.5 if kind == "process" else None
    feeds = rng.uniform(0.01, 0.3, count) if kind == "process" else None
    return Segment(kind, 1, rng.normal(size=(count, 3)), quaternions, 0.05, force, 0.25, feeds)


def random_job():
    rng = np.random.default_rng(0)
    segments = tuple(
        random_segment(rng, kind) for kind in ("approach", "process", "retract", "transition")
    )
    paths = (
        ToolPath(
            "Sitzfläche",
            "sand",
            "disc 125",
            np.float64(0.0625),
            segments,
            300.0,
            {"a": [1]},
            strategy=STRATEGY,
        ),
        ToolPath("back", "inspect", "camera", 0.01, segments[:1]),
        ToolPath("legs", "oil", "pad", 0.01, (), None, {}, (0.1, 0.0, 0.2), (0.6, 0.8, 0, 0), 2.5),
    )
    return Job("chair", "cell", paths, POSE)


def changed(tmp_path, change):
    """The file of a good job after `change` of its content."""
    path = write_toolpaths(tmp_path, random_job())
    content = json.loads(path.read_text("utf-8"))
    change(content)
    path.write_text(json.dumps(content), "utf-8")
    return path


def test_a_job_comes_back_exactly(tmp_path):
    job = random_job()
    assert write_toolpaths(tmp_path, job) == tmp_path / FILE
    for place in (tmp_path, tmp_path / FILE):
        read = read_toolpaths(place)
        assert (read.category, read.frame) == ("chair", "cell")
        np.testing.assert_allclose(read.pose.rotation, POSE.rotation, atol=1e-14)
        np.testing.assert_array_equal(read.pose.translation, POSE.translation)
        assert read.pose.scale == POSE.scale
        np.testing.assert_allclose(read.up, POSE.rotation @ [0, 1, 0], atol=1e-14)
        np.testing.assert_allclose(read.forward, POSE.rotation @ [1, 0, 0], atol=1e-14)
        for path, again in zip(job.paths, read.paths, strict=True):
            for name in (
                "region", "process", "tool", "tool_radius_m", "spindle_rad_s", "parameters",
                "tcp_m", "tcp_quaternion_xyzw", "force_tolerance_n",
            ):  # fmt: skip
                assert getattr(again, name) == getattr(path, name)
            assert (again.strategy is None) == (path.strategy is None)
            for segment, same in zip(path.segments, again.segments, strict=True):
                for name in ("kind", "line", "feed_m_s", "force_n", "dwell_s"):
                    assert getattr(same, name) == getattr(segment, name)
                np.testing.assert_array_equal(same.positions, segment.positions)
                np.testing.assert_array_equal(same.quaternions_xyzw, segment.quaternions_xyzw)
    strategy = read.paths[0].strategy
    for name in (item.name for item in fields(Strategy)):
        np.testing.assert_array_equal(getattr(strategy, name), getattr(STRATEGY, name))
    write_toolpaths(tmp_path, read_toolpaths(tmp_path))
    assert read_toolpaths(tmp_path).paths[0].tool_radius_m == 0.0625


def test_an_early_job_has_no_pose_and_is_taken_to_be_canonical(tmp_path):
    def early(content):
        content.pop("pose")
        content["version"] = 1

    job = read_toolpaths(changed(tmp_path, early))
    assert job.pose is None
    assert (job.up.tolist(), job.forward.tolist()) == ([0, 1, 0], [1, 0, 0])
    assert read_toolpaths(write_toolpaths(tmp_path, job)).pose is None


@pytest.mark.parametrize("version", [1, 2])
def test_early_files_have_no_strategy_and_call_a_retract_departure(tmp_path, version):
    def early(content):
        content["version"] = version
        for path in content["paths"]:
            path.pop("strategy")
        content["paths"][0]["segments"][2]["kind"] = "departure"

    path = read_toolpaths(changed(tmp_path, early)).paths[0]
    assert path.strategy is None
    assert path.segments[2].kind == "retract"


def strategy_with(**changes):
    return lambda content: content["paths"][0]["strategy"].update(changes)


def pose_with(**changes):
    return lambda content: content["pose"].update(changes)


def segment_with(**changes):
    return lambda content: content["paths"][0]["segments"][1].update(changes)


@pytest.mark.parametrize(
    "change, message",
    [
        (
            lambda c: c.update(version=7),
            "version 7; this nrdf reads versions up to 6: update nrdf",
        ),
        (lambda c: c.pop("version"), "version: is missing"),
        (lambda c: c.update(speed=1), "unknown key 'speed'"),
        (lambda c: c.update(frame="a\nb"), r"frame: a name with line breaks.*'a\\nb'"),
        (
            lambda c: c["paths"][1].update(tool_radius_m=0),
            r"paths\[1\].tool_radius_m: must be above 0",
        ),
        (lambda c: c["paths"][1].pop("region"), r"paths\[1\].region: is missing"),
        (segment_with(feed_m_s=-1), r"segments\[1\].feed_m_s: must be above 0.0, not -1"),
        (segment_with(feed_m_s=float("nan")), "feed_m_s: .*finite"),
        (
            segment_with(kind="fly"),
            "must be 'approach', 'process', 'transition' or 'retract', not 'fly'",
        ),
        (segment_with(positions_m=[]), "positions_m: .*at least 1"),
        (segment_with(positions_m=[[0, 0]]), r"positions_m\[0\]\[2\]: is missing"),
        (segment_with(quaternions_xyzw=[[0, 0, 0, 2]]), "a quaternion of length 2, not 1"),
        (pose_with(quaternion_xyzw=[0, 0, 0, 2]), "a quaternion of length 2, not 1"),
        (pose_with(scale_m=0), "pose.scale_m: must be above 0"),
        (pose_with(translation_m=[0, float("nan"), 0]), "pose.translation_m.*finite"),
        (pose_with(up=[0, 0, 1]), "pose contradicts itself: up is 0 0 1, but its quaternion takes"),
        (strategy_with(passes=0), r"paths\[0\].strategy: passes is 0; give a value above 0"),
        (strategy_with(trajectory="zigzag"), "strategy.trajectory: must be 'raster'.*'zigzag'"),
        (strategy_with(speed=1), r"unknown key 'paths\[0\].strategy.speed'"),
        (lambda c: c["paths"][0]["strategy"].pop("passes"), "strategy.passes: is missing"),
        (lambda c: c["pose"].pop("up"), "pose.up: is missing"),
        (segment_with(positions_m=[[0, 0, 0]]), "has 1 positions_m, but 7 quaternions_xyzw"),
        (segment_with(feeds_m_s=[0.1] * 6), "has 7 positions_m, but 6 feeds_m_s"),
        (segment_with(feeds_m_s=[0.1, 0.0]), r"feeds_m_s\[1\]: must be above 0"),
    ],
)
def test_what_is_wrong_in_a_file_is_named_by_field(tmp_path, change, message):
    with pytest.raises(ProcessError, match=message):
        read_toolpaths(changed(tmp_path, change))


def test_files_that_are_no_tool_paths_are_told(tmp_path, monkeypatch):
    with pytest.raises(ProcessError, match=r"cannot read .*toolpaths.json.*nrdf transfer"):
        read_toolpaths(tmp_path)
    for text in ("", "[" * 100_000, "{}", "[]", "no JSON", b"\xff\xfe"):
        (tmp_path / FILE).write_bytes(text if isinstance(text, bytes) else text.encode())
        with pytest.raises(ProcessError, match=r"toolpaths\.json: "):
            read_toolpaths(tmp_path)
    monkeypatch.setattr("nrdf.toolpath.file._LARGEST_FILE", 1 << 20)
    (tmp_path / FILE).write_bytes(b" " * (1 << 20) + b" ")
    with pytest.raises(ProcessError, match="larger than 1 MiB"):
        read_toolpaths(tmp_path)


def test_what_could_not_be_read_is_not_written(tmp_path):
    segment = Segment("process", 0, np.zeros((1, 3)), np.zeros((1, 4)), 0.1)
    path = ToolPath("seat", "sand", "disc", 0.1, (segment,))
    with pytest.raises(ProcessError, match=r"the job: .*a quaternion of length 0, not 1"):
        write_toolpaths(tmp_path, Job("chair", "cell", (path,)))
    path = ToolPath("seat", "sand", "disc", 0.1, (), parameters={"when": object()})
    with pytest.raises(ProcessError, match="no JSON file can hold"):
        write_toolpaths(tmp_path, Job("chair", "cell", (path,)))
    assert list(tmp_path.iterdir()) == []
    with pytest.raises(OutputError, match="cannot write"):
        write_toolpaths(tmp_path / "missing", random_job())
