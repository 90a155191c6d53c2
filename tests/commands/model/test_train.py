"""`nrdf model train`."""

from __future__ import annotations

import trimesh

from nrdf import cli
from nrdf.field.zoo import find_weights, load_field


def test_prepared_shapes_train_a_field_that_the_other_verbs_take(tmp_path, capsys):

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

    # The general model learns occupancy of shapes of any category, and nothing else of it changes.
    config.write_text(
        "preset: general\n"
        "data: {encoder_points: 256, queries: 32, correspondences: 0, surface_points: 256}\n"
        "stages: [{name: all, parts: [local_occupancy], weights: {occupancy: 1}, steps: 2, "
        "batch_size: 2}]\n"
    )
    words = f"model train general --start general {words}"
    assert cli.run(f"{words} {tmp_path}/general".split()) == 0
    (before, _), (after, metadata) = load_field("general"), load_field(tmp_path / "general")
    assert metadata["category"] == "" and metadata["start"]["file"] == "general.safetensors"
    known = before.state_dict()
    changed = {n.split(".")[0] for n, v in after.state_dict().items() if not v.equal(known[n])}
    assert changed == {"local_occupancy"}
