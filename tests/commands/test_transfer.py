"""`nrdf teach`, `nrdf transfer` and what follows, as a user types them."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest
import trimesh

from builders.taught_box import SIZE, cloud, faces
from nrdf import cli
from nrdf.commands.transfer import job_folders, listed_targets
from nrdf.errors import CloudError, ConfigError, LimitError, NothingFoundError
from nrdf.io.cloud import PointCloud, write_cloud
from nrdf.serve.many import TransferOutcome
from nrdf.serve.object_transfer import ObjectTransfer
from nrdf.toolpath.file import read_toolpaths


def transfer(files, model, *more, kind="--any-kind", target=None):
    words = (
        f"transfer {files}/box.yaml {target or files / 'new.ply'} --model {model} --out {files}/job"
    )
    return cli.run([*words.split(), *([kind] if kind else []), *more])


def test_from_a_reference_to_robot_programs(taught, untrained, capsys):
    assert cli.run(["check", str(taught / "box.yaml")]) == 0
    said = capsys.readouterr().out
    assert "2 processes on 2 regions: nothing is wrong" in said and "30 mm" in said
    assert transfer(taught, untrained, "--min-coverage", "0.5", "--require-all") == 0
    said = capsys.readouterr().out
    assert "2 tool paths" in said and "top" in said and "oil" in said
    report = json.loads((taught / "job" / "report.json").read_text())
    assert report["limits"]["set"] == {
        "min_coverage": 0.5, "require_all": True, "any_kind": True,
    }  # fmt: skip
    assert report["model"]["category"] == "chair" and report["versions"]["nrdf"]
    job = read_toolpaths(taught / "job")
    assert job.frame == "cell" and [path.process for path in job.paths] == ["sand", "oil"]
    assert max(abs(s.positions).max() for path in job.paths for s in path.segments) < 1.0
    assert cli.run(["export", str(taught / "job"), "--format", "urscript", "csv"]) == 0
    assert cli.run(["check", str(taught / "job" / "knowledge.yaml")]) == 0


def test_a_scan_in_any_pose_gets_tool_paths_where_it_stands(taught, untrained, capsys):
    turned = cloud(SIZE, seed=1)
    points = 1000 * turned.points[:, [2, 0, 1]] + [3000.0, 0.0, 300.0]
    scan = PointCloud(points, turned.normals[:, [2, 0, 1]], None, "cell")
    write_cloud(taught / "new.ply", scan)
    assert transfer(taught, untrained, "--up", "z", "--skip", "floor") == 0
    assert "does not say its unit; taken to be mm" in " ".join(capsys.readouterr().err.split())
    report = json.loads((taught / "job" / "report.json").read_text())
    assert report["alignment"]["unit"] == {"name": "mm", "origin": "guessed"}
    sand = next(path for path in read_toolpaths(taught / "job").paths if path.process == "sand")
    heights = [s.positions[:, 2] for s in sand.segments if s.kind == "process"]
    assert np.abs(np.concatenate(heights) - 0.6).max() < 0.01
    # How it stands there goes along in the job, for whoever drives or draws it.
    job = read_toolpaths(taught / "job")
    np.testing.assert_allclose(job.up, [0, 0, 1], atol=0.02)
    assert report["pose"]["up"] == pytest.approx(job.up.tolist())
    corner = job.pose.to_scan(np.zeros((1, 3)))[0]
    np.testing.assert_allclose(corner, [3.0, 0.0, 0.3], atol=0.02)
    assert cli.run(["export", str(taught / "job"), "--format", "csv"]) == 0
    head = (taught / "job" / "export" / "csv" / "nrdf_chair.csv").read_text()[:2000]
    assert re.search(r"up for the object is -?0\.0\d+ -?0\.0\d+ (1\.0|0\.9)", head)


def test_loose_triangles_are_refused_before_anything_is_done(
    taught, untrained, capsys, monkeypatch
):
    monkeypatch.setattr("nrdf.io.formats.meshes.outer_skin", None)  # the first that would be
    rng = np.random.default_rng(0)
    corners = (rng.random((5000, 1, 3)) + rng.normal(0, 0.01, (5000, 3, 3))).reshape(-1, 3)
    soup = trimesh.Trimesh(corners, np.arange(15_000).reshape(-1, 3), process=False)
    soup.export(taught / "soup.stl")
    assert transfer(taught, untrained, "--unit", "m", target=taught / "soup.stl") == 2
    said = " ".join(capsys.readouterr().err.split())
    assert "5000 of its 5000 triangles are loose" in said and "merge its vertices" in said
    assert not (taught / "job").exists()


def test_a_mesh_is_judged_by_itself(taught, untrained, capsys):
    """In its unit, whatever was sampled of it; the limit is on that distance."""
    box = trimesh.creation.box(1000 * SIZE)
    mesh = taught / "box.stl"
    box.export(mesh)
    words = ("--unit", "mm")
    assert transfer(taught, untrained, *words, "--max-surface-distance-mm", "20", target=mesh) == 0
    report = json.loads((taught / "job" / "report.json").read_text())
    for path in report["paths"]:
        assert path["metrics"]["compared_with"] == "the mesh as given (12 triangles)"
        assert path["metrics"]["true_distance_95_m"] < 1e-3
        assert 5e-3 < path["metrics"]["step_worst_m"] < 0.03
    page = (taught / "job" / "report.html").read_text()
    assert "the mesh as given (12 triangles)" in page and "off the object" in page
    tight = ("--max-surface-distance-mm", "0", "--max-step-mm", "1", "--overwrite")
    assert transfer(taught, untrained, *words, *tight, target=mesh) == 3
    said = " ".join(capsys.readouterr().err.split())
    assert "the worst distance from the mesh as given (12 triangles) is" in said
    assert "the largest step between waypoints is" in said and "above 1 mm" in said


_FILM = """
        thickness_um: 60 ± 10
        standoff_mm: 150
        tool: {name: gun, radius_mm: 90, profile: {across_mm: 90, along_mm: 80, flow_mm3_s: 800}}"""
_DEPTH = """
        removal_um: 20 ± 8
        force_n: 40
        spindle_rpm: 9000
        tool: {name: sander, radius_mm: 90, pad: {preston_per_pa: 5.0e-9, orbit_mm: 2.5}}"""


def with_target(taught, kind, target):
    """A knowledge file of the box's top with one process that has a target."""
    (taught / "box.yaml").write_text(f"""version: 1
category: chair
reference: {{cloud: box.ply, unit: m}}
regions:
  - name: top
    file: top.ply
    processes:
      - kind: {kind}{target}
        trajectory: raster
        stepover_mm: 60
        feed_mm_s: 300
""")


@pytest.mark.parametrize(
    ("kind", "target", "wanted", "least"),
    [("paint", _FILM, "60 ± 10 µm", 0.85), ("sand", _DEPTH, "20 ± 8 µm", 0.5)],
)
def test_a_process_with_a_target_is_checked_planned_and_reported(
    taught, untrained, capsys, kind, target, wanted, least
):
    with_target(taught, kind, target)
    assert cli.run(["check", str(taught / "box.yaml")]) == 0
    assert "nothing is wrong" in capsys.readouterr().out
    new = cloud(seed=1)
    (taught / "marked").mkdir()  # an untrained model's own region is ragged
    write_cloud(taught / "marked" / "top.ply", new.select(faces(new)["top"]))
    write_cloud(taught / "new.ply", new)
    marked = ("--region", str(taught / "marked" / "top.ply"))
    assert transfer(taught, untrained, *marked) == 0
    (path,) = json.loads((taught / "job" / "report.json").read_text())["paths"]
    result = path["result"]
    assert result["planned"]["within"] >= max(least, result["taught"]["within"])
    page = (taught / "job" / "report.html").read_text()
    low, high = (f"{1e3 * result[f'feed_{end}_m_s']:.0f}" for end in ("least", "most"))
    assert page.count(f"{low} to {high} mm/s") == 2 and "300 mm/s" not in page
    assert wanted in page and "What they leave" in page and "worst places" in page
    segments = [s for s in read_toolpaths(taught / "job").paths[0].segments if s.kind == "process"]
    feeds = np.concatenate([s.feeds_m_s for s in segments])
    assert feeds.min() == pytest.approx(result["feed_least_m_s"], rel=1e-3)


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("across_mm: 90", "across_mm: 0", "tool.profile.across_m: must be above 0.0, not 0.0"),
        ("across_mm: 90", "across_m: 50", "across_m is 50 (50000 mm), above what is plausible"),
        ("60 ± 10", "6000 ± 10", "µm at most and"),
        ("60 ± 10", "60e-6", "no amount with a tolerance; write it as 60 ± 10"),
        ("thickness_um", "thickness_mm", "did you mean 'thickness_um'?"),
    ],
)
def test_a_target_that_cannot_be_is_answered(taught, capsys, old, new, said):
    with_target(taught, "paint", _FILM.replace(old, new))
    assert cli.run(["check", str(taught / "box.yaml")]) == 2
    assert said in " ".join(capsys.readouterr().err.split())


def test_scan_options_need_up(taught, untrained, capsys):
    assert transfer(taught, untrained, "--skip", "floor") == 2
    assert "--sensor and --skip are for scans: give --up" in capsys.readouterr().err


def test_a_limit_that_is_not_met_ends_with_3_after_writing(taught, untrained, capsys):
    limits = ("--max-line-spacing-mm", "1", "--max-cycle-time-s", "2")
    assert transfer(taught, untrained, *limits) == 3
    said = capsys.readouterr().err
    assert "limits not met:" in said and "above 1 mm" in said and "above 2 s" in said
    report = json.loads((taught / "job" / "report.json").read_text())
    assert len(report["limits"]["not_met"]) == 3
    assert (taught / "job" / "toolpaths.json").exists()


def test_a_box_is_no_chair_and_ends_with_3_after_writing(taught, untrained, capsys):
    assert transfer(taught, untrained, kind=None) == 3
    said = " ".join(capsys.readouterr().err.split())
    assert "the target does not look like a chair" in said and "--any-kind" in said
    report = json.loads((taught / "job" / "report.json").read_text())
    assert not report["kind"]["fits"] and report["kind"]["warnings"][0] in report["strict_warnings"]
    assert report["kind"]["warnings"][0] in report["warnings"]
    assert (taught / "job" / "toolpaths.json").exists()
    assert transfer(taught, untrained, "--overwrite") == 0
    assert "the target does not look like a chair" in " ".join(capsys.readouterr().err.split())


def test_a_region_without_enough_confidence_is_skipped(taught, untrained, capsys):
    assert transfer(taught, untrained, "--min-confidence", "1") == 4
    said = " ".join(capsys.readouterr().err.split())
    assert "region 'top' is skipped: confidence" in said and "below 1" in said
    assert not (taught / "job" / "toolpaths.json").exists()
    assert json.loads((taught / "job" / "report.json").read_text())["total"]["paths"] == 0


def test_without_any_tool_path_each_region_says_why_and_a_hint_follows(taught, untrained, capsys):
    assert transfer(taught, untrained, "--min-confidence", "1", "--require-all") == 4
    said = capsys.readouterr().err
    assert "nrdf: no tool path could be planned:\n  region 'top': confidence" in said
    assert "\n  region 'front': confidence" in said and "try --up z" in said
    words = ("--min-confidence", "1", "--up", "y", "--skip", "floor", "--overwrite")
    assert transfer(taught, untrained, *words) == 4
    assert "is y the direction that points up?" in capsys.readouterr().err


def test_strict_takes_no_warning_and_the_result_is_written(taught, untrained, capsys):
    write_cloud(taught / "new.ply", PointCloud(1000 * cloud(seed=1).points))
    assert transfer(taught, untrained) == 0
    assert "does not say its unit; taken to be mm" in " ".join(capsys.readouterr().err.split())
    assert transfer(taught, untrained, "--strict", "--overwrite") == 3
    said = " ".join(capsys.readouterr().err.split())
    assert "nrdf: doubtful, with --strict:" in said and "taken to be mm" in said
    warnings = json.loads((taught / "job" / "report.json").read_text())["strict_warnings"]
    assert "taken to be mm" in warnings[0] and (taught / "job" / "toolpaths.json").exists()


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (("feed_m_s: 0.1 ", "feed_m_s: 0 "), "process 1 (sand), feed_m_s: must be above 0.0"),
        (("standoff_m: 0.0", "standoff_m: 0.1"), "a force without contact"),
        (("version: 1", "version: 9"), "version 9, from a newer nrdf"),
        (("category:", "catgeory:"), "unknown key 'catgeory'; did you mean 'category'?"),
        (("sha256: ", "sha256: 0000"), "reference.sha256"),
        (("category: chair", "category: table"), "for the category chair"),
        (("file: top.ply", "file: front.ply"), "regions 'top' and 'front' overlap"),
    ],
)
def test_bad_knowledge_is_explained_and_leaves_nothing(taught, untrained, capsys, change, message):
    path = taught / "box.yaml"
    text = path.read_text()
    assert change[0] in text
    path.write_text(text.replace(*change, 1))
    assert transfer(taught, untrained) == 2
    said = capsys.readouterr().err
    assert message in said and "Traceback" not in said
    assert not (taught / "job").exists()


def test_the_targets_unit_is_asked_for_where_nothing_tells_it(taught, untrained, capsys):
    write_cloud(taught / "new.ply", PointCloud(7 * cloud(seed=1).points))
    assert transfer(taught, untrained) == 2
    assert "give --unit (m, cm, mm, in)" in capsys.readouterr().err
    assert transfer(taught, untrained, "--unit", "in") == 0
    write_cloud(taught / "new.ply", PointCloud(cloud(seed=1).points, unit="m"))
    assert transfer(taught, untrained, "--unit", "mm", "--overwrite") == 2
    assert "--unit is mm, but the file says m" in capsys.readouterr().err


def test_a_region_marked_on_the_target_is_taken_instead_of_what_is_found(taught, untrained, capsys):
    new = cloud(SIZE, seed=1)
    chosen = faces(new)["top"][:200]
    (taught / "marked").mkdir()
    marked = taught / "marked" / "top.ply"
    write_cloud(marked, PointCloud(1000 * new.points[chosen], None, "mm"))
    assert transfer(taught, untrained, "--region", str(marked)) == 0
    report = json.loads((taught / "job" / "report.json").read_text())
    top = report["regions"]["top"]
    assert top["confidence"] == 1.0 and top["points"] == 200
    assert report["regions"]["front"]["confidence"] < 1.0
    marked.rename(taught / "marked" / "lid.ply")
    words = ("--region", str(taught / "marked" / "lid.ply"), "--overwrite")
    assert transfer(taught, untrained, *words) == 2
    assert "no taught region 'lid'; known: top, front" in capsys.readouterr().err


@pytest.fixture
def four(taught, monkeypatch):
    """The folder to work in: knowledge, two targets, and a broken one."""
    monkeypatch.chdir(taught)
    other = cloud(SIZE, seed=2)
    write_cloud(taught / "other.ply", PointCloud(other.points, other.normals, "m"))
    (taught / "broken.ply").write_text("no cloud")
    return taught


def test_one_target_has_a_folder_of_its_name_unless_told(four, untrained):
    assert cli.run(f"transfer box.yaml new.ply --model {untrained} --any-kind".split()) == 0
    assert (four / "job-new" / "toolpaths.json").exists()


def test_several_targets_have_a_folder_each_and_the_reference_is_encoded_once(
    four, untrained, capsys, monkeypatch
):
    from nrdf.regions.model import Model

    encoded, set_reference = [], Model.set_reference
    monkeypatch.setattr(
        Model, "set_reference", lambda self, c: encoded.append(1) or set_reference(self, c)
    )
    words = f"transfer box.yaml new.ply broken.ply other.ply --model {untrained} --any-kind"
    assert cli.run([*words.split(), "--out", "jobs"]) == 2
    said = capsys.readouterr()
    assert len(encoded) == 1
    assert sorted(p.name for p in (four / "jobs").iterdir() if p.is_dir()) == ["new", "other"]
    assert (four / "jobs" / "objects.csv").read_text().count("\n") == 4
    for name in ("new", "other"):
        assert len(read_toolpaths(four / "jobs" / name).paths) == 2
    assert "broken.ply: " in said.err and "Traceback" not in said.err
    table = said.out[said.out.index("all targets") :].splitlines()
    rows = {line.split()[0]: line for line in table[1:] if ".ply" in line}
    assert list(rows) == ["new.ply", "broken.ply", "other.ply"]
    assert "good" in rows["new.ply"] and "no result" in rows["broken.ply"]
    assert "good" in rows["other.ply"]
    # Jobs that are there, made from the same, are not made again; a new target is.
    before = (four / "jobs" / "new" / "report.json").stat().st_mtime_ns
    write_cloud(four / "third.ply", PointCloud(cloud(SIZE, seed=3).points, unit="m"))
    again = words.replace("broken.ply", "third.ply").split()
    assert cli.run([*again, "--out", "jobs"]) == 0
    assert capsys.readouterr().err.count("made before") == 2
    assert (four / "jobs" / "new" / "report.json").stat().st_mtime_ns == before
    assert (four / "jobs" / "third" / "report.html").exists()
    # With another limit they are not the same: their folders are refused, each for itself.
    assert cli.run([*again, "--out", "jobs", "--min-coverage", "0.1"]) == 2
    assert capsys.readouterr().err.count("is not empty") == 3


def test_knowledge_that_is_wrong_is_so_at_once_for_all_targets(four, untrained, capsys):
    assert cli.run(f"transfer no.yaml new.ply other.ply --model {untrained}".split()) == 2
    assert capsys.readouterr().err.count("no.yaml") == 1


@pytest.mark.parametrize(
    ("errors", "code"),
    [
        ((None, None), 0),
        ((None, LimitError("wide")), 3),
        ((LimitError("wide"), NothingFoundError("none")), 4),
        ((NothingFoundError("none"), CloudError("bad"), LimitError("wide")), 2),
        ((OSError("disk"), None), 2),
    ],
)
def test_the_exit_code_is_the_worst(four, monkeypatch, errors, code):
    codes = iter(0 if e is None else getattr(e, "exit_code", 2) for e in errors)

    def transferred(task, pair):
        return TransferOutcome(*pair, next(codes))

    monkeypatch.setattr("nrdf.serve.many.transfer_one", transferred)
    monkeypatch.setattr(ObjectTransfer, "process_transfer", None)
    targets = [f"{number}.ply" for number in range(len(errors))]
    assert cli.run(["transfer", "box.yaml", *targets]) == code


def test_folders_of_targets():
    a, b = Path("x/a.ply"), Path("y/b.ply")
    assert job_folders([a], None) == [Path("job-a")]
    assert job_folders([a], Path("out")) == [Path("out")]
    assert job_folders([a, b], None) == [Path("job-a"), Path("job-b")]
    assert job_folders([a, b], Path("out")) == [Path("out/a"), Path("out/b")]
    with pytest.raises(ConfigError, match="two targets are called 'A'"):
        job_folders([a, Path("z/A.stl")], None)
    with pytest.raises(ConfigError, match="needs a TARGET"):
        job_folders([], None)


def test_targets_from_a_list(tmp_path):
    (tmp_path / "list").write_text("\ufeffa.ply\n\n  b c.ply \r\n")
    assert listed_targets(tmp_path / "list") == [Path("a.ply"), Path("b c.ply")]
    with pytest.raises(ConfigError, match="none"):
        listed_targets(tmp_path / "none")


def test_marked_regions_are_of_one_target(four, capsys):
    assert cli.run(["transfer", "box.yaml", "new.ply", "other.ply", "--region", "top.ply"]) == 2
    assert "--region marks regions of one target" in capsys.readouterr().err
