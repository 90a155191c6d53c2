"""Every format is read back by a stranger, and compared with the job and with a golden file.

After an intended change: python tests/test_export.py writes the golden files anew; read the diff.
"""

from __future__ import annotations

import csv
import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import yaml
from scipy.spatial.transform import Rotation

from builders.export_jobs import small_job, wild_job
from builders.read_programs import (
    Read,
    read_apt,
    read_gcode,
    read_krl,
    read_lines,
    read_rapid,
    read_urscript,
)
from nrdf.export.options import Options
from nrdf.export.registry import FORMATS, export_job
from nrdf.toolpath.types import Job

GOLDEN = Path(__file__).parent / "golden"
POSITION_M, TURN_RAD = 1e-7, 2e-7
HALF_TURN_ABOUT_X = np.diag([1.0, -1.0, -1.0])


def written(job: Job, name: str, folder: Path, options: Options | None = None) -> Path:
    """The file, not the .dat beside a .src, that a format makes of `job`."""
    (files,) = export_job(job, [name], folder, options).values()
    return folder / next(file for file in files if not file.endswith(".dat"))


def angle_between(a, b):
    """Angle of vectors (3,), or of rotations (3, 3): sine and cosine, exact for small ones."""
    if np.ndim(a) == 1:
        return np.arctan2(np.linalg.norm(np.cross(a, b)), np.dot(a, b))
    return Rotation.from_matrix(np.asarray(a).T @ b).magnitude()


def compare(job, paths: list[list[Read]], force=False, dwell=True, turn=None, within=POSITION_M):
    """What was read against `job`: poses, kinds, feeds on lines, and force where it is carried."""
    assert len(paths) == len(job.paths)
    for path, reads in zip(job.paths, paths, strict=True):
        rows = [(segment, n) for segment in path.segments for n in range(len(segment.positions))]
        assert len(rows) == len(reads)
        for i, ((segment, n), read) in enumerate(zip(rows, reads, strict=True)):
            assert np.linalg.norm(read.position - segment.positions[n]) <= within
            expected = Rotation.from_quat(segment.quaternions_xyzw[n]).as_matrix()
            expected = expected if turn is None else expected @ turn
            expected = -expected[:, 2] if read.orientation.ndim == 1 else expected
            assert angle_between(expected, read.orientation) <= TURN_RAD
            assert read.kind == segment.kind
            assert (read.feed_m_s is None) == (i == 0)
            if read.feed_m_s is not None:
                assert read.feed_m_s == pytest.approx(segment.feed_m_s, rel=1e-3)
            if force:
                assert read.force_n == segment.force_n
            last = n == len(segment.positions) - 1
            if dwell:
                assert read.dwell_s == pytest.approx(segment.dwell_s if last else 0.0)


def with_first_feed_unknown(paths: list[list[Read]]) -> list[list[Read]]:
    """Formats that are no programs give every waypoint a feed."""
    return [[replace(path[0], feed_m_s=None), *path[1:]] for path in paths]


@pytest.fixture(scope="module")
def wild():
    return wild_job()


def test_apt(wild, tmp_path):
    compare(wild, read_apt(written(wild, "apt", tmp_path)))


@pytest.mark.parametrize("rotary", ["AC", "BC"])
@pytest.mark.parametrize("tilt", ["positive", "negative"])
@pytest.mark.parametrize("without", [False, True])
def test_gcode(wild, tmp_path, rotary, tilt, without):
    options = Options(rotary=rotary, tilt=tilt, without_tcp_control=without, frame_number=3)
    path = written(wild, "gcode", tmp_path, options)
    # On the tables, the rounding of an angle moves a point that is metres away.
    within = 1e-6 if without else POSITION_M
    compare(wild, read_gcode(path, rotary, not without), within=within)
    assert "G56" in read_lines(path)


def test_urscript_presses_exactly_where_the_job_does(wild, tmp_path):
    path = written(wild, "urscript", tmp_path)
    compare(wild, read_urscript(path), force=True)
    text = path.read_text()
    assert text.count("end_force_mode()") == 3
    assert text.index("zero_ftsensor()") < text.index("run nrdf_press()")


def test_a_tcp_that_is_known_is_set_and_said(tmp_path):
    half = np.sqrt(0.5)
    first, second = (
        replace(path, tcp_m=(0.0, 0.01, 0.12), tcp_quaternion_xyzw=(half, 0.0, 0.0, half),
                force_tolerance_n=2.5)
        for path in wild_job().paths
    )  # fmt: skip
    job = replace(wild_job(), paths=(first, second))
    formats = ["urscript", "rapid", "json"]
    export_job(job, formats, tmp_path)
    (script,) = (tmp_path / "urscript").iterdir()
    text = script.read_text()
    assert text.count(f"set_tcp(p[0.0000000, 0.0100000, 0.1200000, {np.pi / 2:.8f}, ") == 2
    assert "and its TCP set?" not in text and "force within 2.500 N" in text
    (module,) = (tmp_path / "rapid").glob("*.mod")
    assert "TCP 0.000 10.000 120.000 mm" in " ".join(module.read_text().split())
    (content,) = (tmp_path / "json").iterdir()
    assert json.loads(content.read_text())["paths"][0]["tcp_m"] == [0.0, 0.01, 0.12]
    export_job(job, ["urscript"], tmp_path / "out", Options(tool_z="out"))
    (script,) = (tmp_path / "out" / "urscript").iterdir()
    assert f"{-np.pi / 2:.8f}" in script.read_text().split("set_tcp", 1)[1].split("\n")[0]


def test_urscript_pushes_the_other_way_when_tool_z_points_out(wild, tmp_path):
    paths = read_urscript(written(wild, "urscript", tmp_path, Options(tool_z="out")))
    compare(wild, paths, turn=HALF_TURN_ABOUT_X)
    assert {read.force_n for read in paths[0]} == {None, -12.5, -20.0}


@pytest.mark.parametrize("tool_z", [None, "into", "out"])
@pytest.mark.parametrize("name, read", [("rapid", read_rapid), ("krl", read_krl)])
def test_rapid_and_krl(wild, tmp_path, name, read, tool_z):
    paths = read(written(wild, name, tmp_path, Options(tool_z=tool_z)))
    compare(wild, paths, turn=HALF_TURN_ABOUT_X if tool_z == "out" else None)


def test_csv(wild, tmp_path):
    rows = read_lines(written(wild, "csv", tmp_path))
    rows = list(csv.DictReader(row for row in rows if not row.startswith("#")))
    paths: dict[str, list[Read]] = {}
    for row in rows:
        pose = [float(row[key]) for key in ["x_m", "y_m", "z_m", "qx", "qy", "qz", "qw"]]
        matrix = Rotation.from_quat(pose[3:]).as_matrix()
        force = float(row["force_n"]) if row["force_n"] else None
        feed, dwell = float(row["feed_m_s"]), float(row["dwell_s"])
        read = Read(row["kind"], np.array(pose[:3]), matrix, feed, force, dwell)
        paths.setdefault(row["path"], []).append(read)
    compare(wild, with_first_feed_unknown(list(paths.values())), force=True)
    assert {row["region"] for row in rows} == {"seat_ left _old_", "Rucken_ _x"}
    assert {row["spindle_rad_s"] for row in rows} == {"314.0", ""}


def test_json(wild, tmp_path):
    content = json.loads(written(wild, "json", tmp_path).read_bytes())
    assert content["waypoint"] == ["x_m", "y_m", "z_m", "qx", "qy", "qz", "qw"]
    paths = []
    for path in content["paths"]:
        reads = []
        for segment in path["segments"]:
            for pose in segment["waypoints"]:
                turn = Rotation.from_quat(pose[3:]).as_matrix()
                known = segment["kind"], np.array(pose[:3]), turn
                reads.append(Read(*known, segment["feed_m_s"], segment["force_n"]))
            reads[-1].dwell_s = segment["dwell_s"]
        paths.append(reads)
    compare(wild, with_first_feed_unknown(paths), force=True)
    assert [p["region"] for p in content["paths"]] == ["seat, left (old)", "Rücken; %x"]
    assert content["paths"][0]["parameters"] == {"grit": 120}


def test_json_keeps_parameters_as_they_are(tmp_path):
    job = small_job()
    given = {"note": "[ 1,   2 ]", "list": [1, "a,   b", [2.5, 3]], "none": []}
    job = replace(job, paths=(replace(job.paths[0], parameters=given),))
    content = json.loads(written(job, "json", tmp_path).read_bytes())
    assert content["paths"][0]["parameters"] == given


@pytest.mark.parametrize("tool_z", [None, "into"])
def test_noether_has_a_tool_path_for_each_line_and_a_segment_for_each_contact(
    wild, tmp_path, tool_z
):
    path = written(wild, "noether", tmp_path, Options(tool_z=tool_z))
    of_paths = yaml.safe_load("\n".join(read_lines(path)))
    # Line 1 has two process segments, so two contacts.
    assert [[len(line) for line in lines] for lines in of_paths] == [[1, 2], [1]]
    segments = [segment for lines in of_paths for line in lines for segment in line]
    assert [len(segment) for segment in segments] == [30, 27, 8, 9]
    kinds = iter([s.kind for p in wild.paths for s in p.segments for _ in s.positions])
    feeds = iter([s.feed_m_s for p in wild.paths for s in p.segments for _ in s.positions])
    reads = []
    for pose in (pose for segment in segments for pose in segment):
        assert set(pose) == {"x", "y", "z", "qx", "qy", "qz", "qw"}
        x, y, z, qx, qy, qz, qw = (pose[key] for key in ["x", "y", "z", "qx", "qy", "qz", "qw"])
        turn = Rotation.from_quat([qx, qy, qz, qw]).as_matrix()
        reads.append(Read(next(kinds), np.array([x, y, z]), turn, next(feeds)))
    paths = with_first_feed_unknown([reads[:65], reads[65:]])
    compare(wild, paths, dwell=False, turn=HALF_TURN_ABOUT_X if tool_z is None else None)


def read_bag(folder: Path):
    """Messages of a bag as (topic, nanoseconds, message)."""
    reader_module = pytest.importorskip("rosbags.rosbag2", reason="pip install 'nrdf[ros]'")
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS2_HUMBLE)
    with reader_module.Reader(folder) as reader:
        return [
            (connection.topic, time, store.deserialize_cdr(data, connection.msgtype))
            for connection, time, data in reader.messages()
        ]


def test_ros2_bag(wild, tmp_path):
    pytest.importorskip("rosbags.rosbag2", reason="pip install 'nrdf[ros]'")
    export_job(wild, ["ros2-bag"], tmp_path)
    messages = read_bag(tmp_path / "ros2-bag" / "bag")
    assert messages[0][0] == "/nrdf/job"
    about = json.loads(messages[0][2].data)
    assert any("force" in line and "not carried" in line for line in about["conventions"])
    assert about["paths"][0]["segments"][1]["force_n"] == 12.5
    segments = [(path, s) for path in wild.paths for s in path.segments]
    topics = ("/nrdf/p1_seat_left_old/", "/nrdf/p2_Rucken_x/")
    for ending in ("path", "poses"):
        found = [m for m in messages if m[0].endswith(f"/{ending}")]
        reads: dict[str, list[Read]] = {}
        assert len(found) == len(segments)
        for (topic, time, message), (_, segment) in zip(found, segments, strict=True):
            assert topic.startswith(topics) and message.header.frame_id == "cell_A"
            kind = topic.split("/")[3]
            poses = [getattr(p, "pose", p) for p in message.poses]
            if ending == "path":
                stamps = [p.header.stamp for p in message.poses]
                seconds = np.array([stamp.sec + 1e-9 * stamp.nanosec for stamp in stamps])
                assert seconds[0] == pytest.approx(1e-9 * time, abs=2e-9)
                ways = np.linalg.norm(np.diff(segment.positions, axis=0), axis=1)
                np.testing.assert_allclose(np.diff(seconds) * segment.feed_m_s, ways, atol=1e-8)
            for p in poses:
                q = [getattr(p.orientation, key) for key in "xyzw"]
                at = np.array([getattr(p.position, key) for key in "xyz"])
                read = Read(kind, at, Rotation.from_quat(q).as_matrix(), segment.feed_m_s)
                reads.setdefault(topic.split("/")[2], []).append(read)
        compare(wild, with_first_feed_unknown(list(reads.values())), dwell=False)


def summary_of_bag(folder: Path) -> str:
    """A bag as text: its database is not the same from version to version of SQLite."""
    lines = []
    for topic, time, message in read_bag(folder):
        poses = [getattr(p, "pose", p) for p in getattr(message, "poses", [])]
        points = [[p.position.x, p.position.y, p.position.z] for p in poses]
        lines.append(f"{time} {topic} {points}" + getattr(message, "data", ""))
    return "\n".join(lines) + "\n"


def golden(name: str, folder: Path) -> dict[str, bytes]:
    """Golden file's name to content, as they would be now."""
    files = export_job(small_job(), [name], folder)[name]
    if name == "ros2-bag":
        return {"ros2-bag.txt": summary_of_bag(folder / name / "bag").encode()}
    return {Path(file).name: (folder / file).read_bytes() for file in files}


@pytest.mark.parametrize("name", FORMATS)
def test_golden(name, tmp_path):
    if name == "ros2-bag":
        pytest.importorskip("rosbags.rosbag2", reason="pip install 'nrdf[ros]'")
    for file, content in golden(name, tmp_path).items():
        expected = (GOLDEN / file).read_bytes()
        assert content.decode().split("\n") == expected.decode().split("\n"), file


if __name__ == "__main__":
    import tempfile

    GOLDEN.mkdir(exist_ok=True)
    for known in FORMATS:
        with tempfile.TemporaryDirectory() as place:
            for file, content in golden(known, Path(place)).items():
                (GOLDEN / file).write_bytes(content)
