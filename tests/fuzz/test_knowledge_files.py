"""Knowledge files, damaged and hostile: read, bound to the reference and planned, or refused."""

from __future__ import annotations

import json

import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

from builders.fuzzing import altered, damaged, message_of, outcome_of, tries
from builders.taught_box import SAND, cloud, faces
from nrdf.errors import NrdfError
from nrdf.io.cloud import write_cloud
from nrdf.process.bound_knowledge import BoundKnowledge, resolve
from nrdf.process.check import CheckedProcess, check_knowledge
from nrdf.process.knowledge import Knowledge
from nrdf.process.knowledge_file import read_knowledge, write_knowledge
from nrdf.toolpath import size_limits

BOX = cloud(count=600)
TOP = faces(BOX)["top"]
TAUGHT = {
    "kind": "custom", "name": "scribe", "trajectory": "taught", "feed_mm_s": 20,
    "tool": {"radius_mm": 5, "tcp_mm": [0, 0, 100], "tcp_quaternion_xyzw": [0, 0, 0, 1]},
    "waypoints": [{"positions_m": BOX.points[TOP[:3]].tolist()}],
}  # fmt: skip
PAINT = {
    "kind": "paint", "trajectory": "spiral", "overlap": 0.5, "standoff_mm": 200, "order": 2,
    "direction": [1, 0, 0], "tool": {"name": "gun", "radius_mm": 60, "clearance_mm": 20},
    "feed_mm_s": 300, "approach": {"distance_mm": 50, "angle_deg": 10}, "passes": 2, "dwell_s": 1,
    "parameters": {"colour": "red", "fan": [1, 2.5, True, None]}, "edge_margin_mm": 5,
}  # fmt: skip
CONTENT = {
    "version": 1,
    "category": "chair",
    "reference": {"cloud": "box.ply", "unit": "m"},
    "allow_overlap": True,
    "regions": [
        {"name": "top", "indices": TOP[:60].tolist(), "processes": [SAND, PAINT]},
        {"name": "all", "file": "top.ply", "processes": [TAUGHT]},
    ],
}
TEXT = yaml.safe_dump(CONTENT, sort_keys=False, default_flow_style=None).encode()
NUMBERS = (
    "stepover_mm",
    "spacing_m",
    "edge_margin_m",
    "feed_m_s",
    "standoff_m",
    "passes",
    "lead_rad",
)
NUMBER = st.one_of(
    st.sampled_from([0, 1, -1, 1e-9, 1e-6, 1e-3, 0.02, 0.5, 1e3, 1e6, 1e9, 1e300, 10**40, -0.0]),
    st.floats(allow_nan=True, allow_infinity=True),
    st.integers(-(10**20), 10**20),
)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("knowledge")
    write_cloud(folder / "box.ply", BOX)
    write_cloud(folder / "top.ply", BOX.select(TOP))
    return folder


def read(folder, content: bytes, name: str = "k.yaml"):
    (folder / name).write_bytes(content)
    return outcome_of(lambda: read_knowledge(folder / name))


def use(folder, knowledge):
    """Write it, read it, resolve it on its reference, plan every process."""
    write_knowledge(folder / "again.yaml", knowledge)
    written = (folder / "again.yaml").read_bytes()
    write_knowledge(folder / "again.yaml", read_knowledge(folder / "again.yaml"))
    assert (folder / "again.yaml").read_bytes() == written  # but for a number's last digits
    bound_knowledge = outcome_of(lambda: resolve(knowledge, folder))
    if isinstance(bound_knowledge, BoundKnowledge):
        for row in outcome_of(lambda: check_knowledge(bound_knowledge)):
            assert isinstance(row, CheckedProcess) and (row.fault == "") == (
                row.metrics is not None
            )


def test_the_seed_is_good(folder):
    knowledge = read(folder, TEXT)
    assert isinstance(knowledge, Knowledge)
    rows = check_knowledge(resolve(knowledge, folder))
    assert [row.fault for row in rows] == ["", "", ""]


@tries(100)
@given(damaged(TEXT))
def test_damaged_yaml(folder, content):
    assert isinstance(read(folder, content), (Knowledge, NrdfError))


@tries(60)
@given(damaged(json.dumps(CONTENT).encode()))
def test_damaged_json(folder, content):
    assert isinstance(read(folder, content, "k.json"), (Knowledge, NrdfError))


@tries(60)
@given(altered(CONTENT))
def test_altered_content_is_read_bound_and_planned_or_refused(folder, content):
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(size_limits, "MOST_WAYPOINTS", 3000)
        knowledge = read(folder, yaml.dump(content, Dumper=yaml.SafeDumper).encode())
        if isinstance(knowledge, Knowledge):
            use(folder, knowledge)


@tries(30)
@given(
    st.dictionaries(st.sampled_from(NUMBERS), NUMBER, min_size=1, max_size=2),
    st.one_of(st.none(), NUMBER),
    st.sampled_from(["raster", "cross-hatch", "spiral", "contour"]),
)
def test_numbers_that_are_meant_are_planned_or_refused(folder, numbers, radius, trajectory):
    """With `allow_unusual`, so that the planner sees all of them."""
    sand = {k: v for k, v in SAND.items() if k not in ("spacing_mm", "feed_mm_s", "force_n")}
    tool = {"radius_m": 0.025 if radius is None else radius}
    process = {"feed_m_s": 0.1, **sand, **numbers, "tool": tool, "trajectory": trajectory}
    region = {"name": "top", "indices": TOP.tolist()}
    process["allow_unusual"] = True
    content = {**CONTENT, "regions": [{**region, "processes": [process]}]}
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(size_limits, "MOST_WAYPOINTS", 3000)
        knowledge = read(folder, yaml.safe_dump(content).encode())
        if isinstance(knowledge, Knowledge):
            use(folder, knowledge)


@pytest.mark.parametrize(
    ("place", "by"),
    [
        ("version: 1", "version: &a [" + "[" * 100_000),
        ("version: 1", "version: !!bool foo"),
        ("version: 1", "version: !!int ''"),
        ("version: 1", "version: !!timestamp foo"),
        ("version: 1", "version: 0x" + "f" * 5000),
        ("version: 1", "version: " + "9" * 5000),
        ("version: 1", "version: 1:" + ":".join(["59"] * 5000)),
        ("version: 1", "version: 1e999"),
        ("cloud: box.ply", 'cloud: "box\\0.ply"'),
        ("cloud: box.ply", "cloud: ."),
        ("cloud: box.ply", "cloud: /dev/zero"),
        ("file: top.ply", 'file: "\\0"'),
        ("file: top.ply", "file: /dev/null"),
        ("file: top.ply", "file: ../../../../../../../../dev/zero"),
        ("stepover_mm: 40", "stepover_m: 1e-6"),
        ("spacing_mm: 20", "spacing_m: 1e-6"),
        ("radius_mm: 25", "radius_m: 1e-9"),
        ("overlap: 0.5", "overlap: 0.999999"),
    ],
)
def test_what_was_found_once_is_refused(folder, place, by):
    text = TEXT.decode()
    assert place in text
    (folder / "k.yaml").write_text(text.replace(place, by, 1))

    def use_it():
        check_knowledge(resolve(read_knowledge(folder / "k.yaml"), folder))

    assert len(message_of(use_it)) < 2000


def test_a_pipe_in_any_place_is_refused_at_once(folder):
    import os

    pipe = folder / "pipe.ply"
    if not hasattr(os, "mkfifo"):
        pytest.skip("no pipes here")
    os.mkfifo(pipe)
    assert "pipe" in message_of(lambda: read_knowledge(pipe))
    for place in ("cloud: box.ply", "file: top.ply"):
        text = TEXT.decode().replace(place, f"{place.split()[0]} pipe.ply", 1)
        (folder / "k.yaml").write_text(text)
        assert "pipe" in message_of(lambda: resolve(read_knowledge(folder / "k.yaml"), folder))
