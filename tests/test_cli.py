from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from importlib.metadata import EntryPoint
from pathlib import Path

import numpy as np
import pytest

from nrdf import cli
from nrdf.bundled import REAL, bundled_chair
from nrdf.field.zoo import find_weights, list_models, load_field
from nrdf.io.cloud import PointCloud, read_cloud, write_cloud
from nrdf.io.ply import read_header, read_scalars
from nrdf.io.result_folder import MANIFEST
from nrdf.process.bound_knowledge import read_bound_knowledge
from nrdf.process.transfer_result import MIN_CONFIDENCE

VERBS = sorted(set(cli.verbs()) - set(cli.GROUPS))


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    """A reference and two of its regions in metres; targets in millimetres, far away: target.ply,
    and other.ply, of which an untrained field puts nothing in the right place."""
    folder = tmp_path_factory.mktemp("files")
    reference, regions = bundled_chair("reference")
    write_cloud(folder / "reference.ply", reference)
    write_cloud(folder / "seat.ply", reference.select(regions["seat"]))
    np.savez(folder / "masks.npz", legs=regions["legs"])
    for name, chair in (("target", "rocker"), ("other", "armchair")):
        points = 1000 * bundled_chair(chair)[0].points + [5000.0, -300.0, 20.0]
        write_cloud(folder / f"{name}.ply", PointCloud(points, unit="mm", frame="cell"))
    return folder


@pytest.fixture
def retrieve(files, untrained, tmp_path):
    """Run `nrdf retrieve` into tmp_path/deep/result with some options changed."""

    def run(**changes):
        options = {
            "model": [untrained],
            "reference": [files / "reference.ply"],
            "region": [files / "seat.ply", files / "masks.npz"],
            "target": [files / "target.ply"],
            "out": [tmp_path / "deep" / "result"],
            **changes,
        }
        words = ["retrieve"]
        for name, values in options.items():
            words += [f"--{name}", *map(str, values)]
        return cli.run(words)

    return run


def test_help_lists_every_verb_and_imports_nothing_heavy():
    code = (
        "import sys; from nrdf import cli; assert cli.run(['--help']) == 0; "
        "print([m for m in ('torch', 'scipy', 'matplotlib', 'numpy') if m in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    lines = done.stdout.splitlines()
    assert lines[-1] == "[]"
    for verb in cli.verbs():
        assert any(line.startswith(f"  {verb} ") for line in lines)


@pytest.mark.parametrize("verb", VERBS)
def test_every_verb_explains_itself_with_an_example(verb, capsys):
    assert cli.run([verb, "--help"]) == 0
    assert f"Example: nrdf {verb}" in capsys.readouterr().out


@pytest.mark.parametrize(
    "group, verb", [(group, verb) for group in cli.GROUPS for verb in cli.verbs()[group]()]
)
def test_every_verb_of_a_group_explains_itself_with_an_example(group, verb, capsys):
    assert cli.run([group, verb, "--help"]) == 0
    assert f"Example: nrdf {group} {verb}" in capsys.readouterr().out


def test_what_only_the_benchmark_has_says_what_to_install(monkeypatch, capsys):
    monkeypatch.setattr(cli, "entry_points", lambda group: ())
    assert "eval" not in cli.verbs()
    for words in (["eval", "bsrc"], ["ablate", "chair"]):
        assert cli.run(words) == 2
        assert "pip install 'nrdf[benchmark]'" in " ".join(capsys.readouterr().err.split())


def test_a_package_that_is_gone_adds_no_verbs_and_a_broken_one_is_told(monkeypatch):
    def found(value):
        monkeypatch.setattr(
            cli, "entry_points", lambda group: [EntryPoint("eval", value, "nrdf.commands")]
        )
        return cli.verbs()

    assert "eval" not in found("no_such_package.commands:evaluations")
    with pytest.raises(ModuleNotFoundError, match=r"nrdf\.no_such_module"):
        found("nrdf.no_such_module:evaluations")


def test_version(capsys):
    import nrdf

    assert cli.run(["--version"]) == 0
    assert capsys.readouterr().out == f"nrdf {nrdf.__version__}\n"


@pytest.mark.parametrize("method", ["mask", "points"])
def test_retrieve_answers_in_the_targets_own_coordinates(retrieve, files, tmp_path, method):
    assert retrieve(method=[method]) == 0
    out = tmp_path / "deep" / "result"
    report = json.loads((out / "report.json").read_text())
    assert {p.name for p in out.iterdir()} == {MANIFEST, *report["files"]}
    assert set(report["files"]) == {"seat.ply", "legs.ply", "picture.png", "report.json"}
    assert report["method"] == method
    assert report["model"]["preset"] == "default"
    assert report["target"]["unit"] == "mm" and report["reference"]["unit"] == "m"
    assert {"normals", "embed", "map", "associate"} <= set(report["seconds"]["of the target"])
    target = read_cloud(files / "target.ply")
    for name in ("seat", "legs"):
        found = read_cloud(out / f"{name}.ply")
        columns = read_scalars(out / f"{name}.ply", read_header(out / f"{name}.ply"))
        assert len(found) == report["regions"][name]["points"] > 0
        np.testing.assert_allclose(found.points, target.points[columns["index"].astype(int)])
        assert (columns["confidence"] >= 0).all() and (columns["confidence"] <= 1).all()
        assert columns["confidence"].mean() == pytest.approx(
            report["regions"][name]["mean_confidence"], abs=1e-3
        )
        assert {"red", "green", "blue"} <= set(columns)
        assert (found.unit, found.frame) == ("mm", "cell")


def test_what_is_not_there_comes_back_empty_with_the_reason(retrieve, files, tmp_path, capsys):
    assert retrieve(target=[files / "other.ply"]) == 0
    out = tmp_path / "deep" / "result"
    seat = json.loads((out / "report.json").read_text())["regions"]["seat"]
    assert (seat["points"], seat["reason"]) == (0, "not observed") and seat["centre"] is None
    assert seat["share_observed"] < 0.2 and 0.5 < seat["confidence_of_presence"] <= 1
    assert read_header(out / "seat.ply").count("vertex") == 0
    assert "region 'seat': not observed (confidence 0." in capsys.readouterr().err
    words = {"target": [files / "other.ply"], "region": [files / "seat.ply"]}
    assert retrieve(**words, overwrite=[]) == 4
    said = capsys.readouterr().err
    assert "none of the regions was found" in said and "try --up z" in said
    assert (out / "report.json").exists() and not (out / "legs.ply").exists()


def test_full_folder_is_refused_before_anything_is_computed(retrieve, tmp_path, capsys):
    out = tmp_path / "deep" / "result"
    out.mkdir(parents=True)
    (out / "mine.txt").write_text("mine")
    assert retrieve(model=["no-such-model"]) == 2
    assert "not empty" in capsys.readouterr().err
    assert cli.run(["demo", "--out", str(out)]) == 2


def test_overwrite_keeps_what_is_not_ours(retrieve, tmp_path):
    out = tmp_path / "deep" / "result"
    out.mkdir(parents=True)
    (out / "mine.txt").write_text("mine")
    assert retrieve(overwrite=[]) == 0
    assert (out / "mine.txt").exists() and (out / "seat.ply").exists()


def bad_regions(files):
    reference, _ = bundled_chair("reference")
    np.save(files / "far.npy", reference.points[:50] + np.array([1.0, 0.0, 0.0]))
    np.save(files / "empty.npy", np.zeros(8192, bool))
    np.save(files / "short.npy", np.ones(77, bool))
    np.savez(files / "evil.npz", **{"../../evil": np.ones(8192, bool)})
    (files / "text.npy").write_text("no array")
    (files / "void.ply").write_text("")
    return {
        "far.npy": "not on the reference",
        "empty.npy": "False everywhere",
        "short.npy": "8192 points",
        "evil.npz": "no name for a region",
        "text.npy": "cannot read the region file",
        "void.ply": "empty",
        "missing.ply": "missing.ply",
    }


@pytest.mark.parametrize(
    "name",
    ["far.npy", "empty.npy", "short.npy", "evil.npz", "text.npy", "void.ply", "missing.ply"],
)
def test_bad_region_is_named_and_nothing_is_left_behind(retrieve, files, tmp_path, capsys, name):
    message = bad_regions(files)[name]
    assert retrieve(region=[files / "seat.ply", files / name]) == 2
    said = " ".join(capsys.readouterr().err.split())
    assert message in said
    assert "Traceback" not in said
    assert list(tmp_path.iterdir()) == []


def test_two_regions_of_one_name_are_refused(retrieve, files, capsys):
    assert retrieve(region=[files / "seat.ply", files / "seat.ply"]) == 2
    assert "two regions are called 'seat'" in capsys.readouterr().err


def test_unknown_model_lists_the_known(retrieve, tmp_path, capsys):
    assert retrieve(model=["chiar"]) == 2
    said = capsys.readouterr().err
    assert "no model 'chiar'; known: " in said
    assert all(entry.name in said for entry in list_models())
    assert list(tmp_path.iterdir()) == []


def test_ctrl_c_ends_with_130_and_leaves_nothing(retrieve, tmp_path, monkeypatch):
    def interrupted(*arguments):
        raise KeyboardInterrupt

    monkeypatch.setattr("nrdf.viz.picture.draw_regions", interrupted)
    assert retrieve() == 130
    assert list(tmp_path.iterdir()) == []


@pytest.mark.skipif(os.name != "posix", reason="signals")
def test_a_real_ctrl_c_ends_with_130_and_leaves_nothing(untrained, tmp_path):
    command = [sys.executable, "-m", "nrdf.cli", "demo", "--no-arm", "--model", str(untrained)]
    process = subprocess.Popen(
        [*command, "--out", str(tmp_path / "demo")],
        stderr=subprocess.PIPE,
        text=True,
        # Started from a background job, the tests inherit an ignored SIGINT.
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    )
    deadline = time.monotonic() + 60
    while not any(tmp_path.glob(".demo.*/*.ply")) and time.monotonic() < deadline:
        time.sleep(0.02)
    process.send_signal(signal.SIGINT)
    said = process.communicate(timeout=60)[1]
    assert (process.returncode, "Traceback" in said) == (130, False)
    assert list(tmp_path.iterdir()) == []


def test_unexpected_errors_keep_their_traceback(retrieve, tmp_path, monkeypatch):
    def broken(*arguments):
        raise ZeroDivisionError("a bug")

    monkeypatch.setattr("nrdf.viz.picture.draw_regions", broken)
    with pytest.raises(ZeroDivisionError):
        retrieve()
    assert list(tmp_path.iterdir()) == []


def test_demo_compares_with_the_truth_and_ends_with_programs(untrained, tmp_path, monkeypatch):
    monkeypatch.setattr("nrdf.bundled.TARGETS", ("rocker",))
    out = tmp_path / "demo"
    assert cli.run(["demo", "--no-arm", "--model", str(untrained), "--out", str(out)]) == 0
    report = json.loads((out / "report.json").read_text())
    found = {str(p.relative_to(out)) for p in out.rglob("*") if p.is_file()}
    assert found == {MANIFEST, *report["files"]}
    real = [row for row in report["found"] if row["chair"] == REAL]
    rows = [row for row in report["found"] if row["chair"] == "rocker"]
    assert len(real) == len(rows) == 5 and real[0]["true"] is real[0]["iou"] is None
    # The scan lies as it was scanned; the job says how the chair stands in it.
    job = json.loads((out / REAL / "toolpaths.json").read_text())
    np.testing.assert_allclose(job["pose"]["up"], [0, 0, 1], atol=0.02)
    for row in rows:
        _, truth = bundled_chair(row["chair"])
        assert row["true"] == int(truth[row["region"]].sum())
        assert 0 <= row["iou"] <= 1
        if row["coverage"] is not None:
            found = read_cloud(out / row["chair"] / "regions" / f"{row['region']}.ply")
            assert len(found) == row["found"]
            assert 0.5 < row["coverage"] <= 1 and row["cycle_time_s"] > 0
        else:
            assert row["found"] == 0 or row["confidence"] < MIN_CONFIDENCE
    assert max(row["iou"] for row in rows) > 0.3
    assert sum(row["coverage"] is not None for row in rows) >= 3
    assert (out / "picture.png").stat().st_size > 50_000
    assert (out / "rocker" / "report.html").exists()
    assert list((out / "rocker" / "export" / "urscript").iterdir())
    # What the demo suggests to try next works.
    result = tmp_path / "result"
    words = f"retrieve --model {untrained} --reference {out}/reference.ply --region "
    words += f"{out}/reference/seat.ply --target {out}/rocker.ply --out {result}"
    assert cli.run(words.split()) == 0
    seat = next(row for row in rows if (row["chair"], row["region"]) == ("rocker", "seat"))
    again = json.loads((result / "report.json").read_text())["regions"]["seat"]
    assert again["points"] == seat["found"]
    taught, _ = bundled_chair("reference")
    lesson = read_bound_knowledge(out / "chair.yaml")
    np.testing.assert_allclose(lesson.cloud.points, taught.points, atol=1e-6)


def test_info_as_json(capsys):
    assert cli.run(["info", "--as-json"]) == 0
    said = json.loads(capsys.readouterr().out)
    assert {"python", "nrdf", "torch"} <= set(said["versions"])
    assert "cpu" in said["devices"]
    assert cli.run(["info"]) == 0


def test_zoo_add_parses_scores(untrained, tmp_path, monkeypatch, capsys):
    monkeypatch.setattr("nrdf.field.zoo.add_to_zoo.__defaults__", (None, None, "", tmp_path))
    words = ["model", "add", str(untrained), "--name", "mine", "--scores", "a=0.5", "b=2"]
    assert cli.run(words) == 0
    index = json.loads((tmp_path / "index.json").read_text())
    assert index["models"]["mine"]["scores"] == {"own": 0.5, "a": 0.5, "b": 2.0}
    assert cli.run([*words[:-1], "b"]) == 2
    assert "name=value" in capsys.readouterr().err


def test_verbose_works_anywhere(capsys):
    with pytest.raises(SystemExit) as ended:
        cli.main(["info", "-v", "--as-json"])
    assert ended.value.code == 0


def test_prepare_names_what_it_cannot_use_and_goes_on(tmp_path, capsys):
    import trimesh

    meshes = tmp_path / "meshes"
    meshes.mkdir()
    trimesh.creation.box((0.5, 1.0, 0.7)).export(meshes / "box.ply")
    (meshes / "broken.obj").write_text("f 1 2 3")
    words = f"model prepare {meshes} --category chair --out {tmp_path}/data --workers 1 "
    words += "--surface-points 500 --queries 500"
    for made, kept in ((1, 0), (0, 1)):
        assert cli.run(words.split()) == 1
        said = capsys.readouterr()
        assert f"{made} shapes made, {kept} were there already" in said.out
        assert "not used: broken.obj: " in said.err
    (meshes / "broken.obj").unlink()
    assert cli.run(words.split()) == 0
    assert cli.run(["model", "prepare", str(tmp_path / "none"), *words.split()[3:]]) == 2


def test_prepared_shapes_train_a_field_that_the_other_verbs_take(tmp_path, capsys):
    import trimesh

    meshes, data, run = tmp_path / "meshes", tmp_path / "data", tmp_path / "run"
    meshes.mkdir()
    for i in range(3):
        trimesh.creation.box((0.5, 1.0, 0.3 + 0.2 * i)).export(meshes / f"box-{i}.ply")
    words = f"model prepare {meshes} --category chair --out {data} --workers 1 --surface-points 300"
    assert cli.run([*words.split(), "--queries", "300"]) == 0
    config = tmp_path / "tiny.yaml"
    config.write_text(
        "preset: default\n"
        "data: {encoder_points: 128, queries: 32, correspondences: 0, surface_points: 256}\n"
        "stages: [{name: all, weights: {occupancy: 1}, steps: 2, batch_size: 2}]\n"
    )
    words = f"--data {data} --config {config} --device cpu --out"
    assert cli.run(f"model train car {words} {tmp_path}/car".split()) == 2
    assert "of category chair, not car" in capsys.readouterr().err
    assert cli.run(f"model train chair {words} {run}".split()) == 0
    assert f"--model {run}/weights.safetensors" in capsys.readouterr().out
    assert find_weights(run) == run / "weights.safetensors"
    assert load_field(run)[1]["category"] == "chair"


def test_synth_and_correspond_pass_on_what_is_asked(tmp_path, monkeypatch, capsys):
    from nrdf.shapes.correspond import CorrespondReport

    asked = []

    def synthesise(category, count, out, seed, workers, progress):
        asked.append((category, count, out, seed))
        progress(count, count)
        return 2

    def correspond_folders(folders, templates, workers, settings, progress, templates_from):
        asked.append((folders, templates, templates_from))
        return CorrespondReport(["a", "b"], 5, 1)

    monkeypatch.setattr("nrdf.shapes.synth.synthesise", synthesise)
    monkeypatch.setattr("nrdf.shapes.correspond.correspond_folders", correspond_folders)
    assert cli.run(f"model synth car --count 7 --seed 3 --out {tmp_path}".split()) == 0
    words = f"model correspond {tmp_path} other --templates 2 --templates-from other"
    assert cli.run(words.split()) == 0
    assert asked == [("car", 7, tmp_path, 3), ([tmp_path, Path("other")], 2, Path("other"))]
    said = capsys.readouterr().out
    assert "2 shapes made, 5 were there already" in said
    assert "5 shapes registered, 1 were before; templates: a, b" in said
