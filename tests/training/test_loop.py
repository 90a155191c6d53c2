"""The training loop: it learns, resumes bit by bit, and refuses what it must."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from itertools import pairwise
from pathlib import Path

import pytest
import torch

from builders.tiny_field import Ball, TinyField, balls, tiny_config, write_folder
from nrdf.errors import ConfigError, DataError, OutputError, TrainingError
from nrdf.field import PRESETS
from nrdf.field.weights import load_weights
from nrdf.io.locks import write_lock
from nrdf.training import loop
from nrdf.training.checkpoint import latest_checkpoint
from nrdf.training.loop import learning_rate, train

HERE = Path(__file__).parents[1]


@pytest.fixture(autouse=True)
def tiny_preset(monkeypatch):
    monkeypatch.setitem(PRESETS, "tiny", "builders.tiny_field:TinyField")
    # The event files of TensorBoard take seconds to import and are no part of what is tested.
    monkeypatch.setattr("nrdf.training.progress._tensorboard", lambda folder, step: None)


@pytest.fixture(scope="module")
def data(tmp_path_factory):
    folder = tmp_path_factory.mktemp("data")
    write_folder(folder, balls(7))
    return folder


def run(data, out, config=None, **options) -> Path:
    return train(config or tiny_config(), [data], out, category="ball", device="cpu", **options)


def program(data, out, changes=None) -> subprocess.Popen:
    return subprocess.Popen(
        [sys.executable, HERE / "builders" / "train_tiny.py", data, out, json.dumps(changes or {})],
        env={**os.environ, "PYTHONPATH": str(HERE)},
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
    )


def same(a: Path, b: Path) -> bool:
    one, two = (load_weights(path)[0].state_dict() for path in (a, b))
    return all(torch.equal(one[name], two[name]) for name in one)


def test_training_learns_and_says_what_it_made(data, tmp_path):
    stage = {"name": "a", "steps": 150, "batch_size": 4, "rate": 0.01}
    weights = {"correspondence": 1, "occupancy": 0.1}
    config = tiny_config(stages=[{**stage, "weights": weights}], ema=0.98, log_every=10)
    path = run(data, tmp_path / "run", config)
    field, metadata = load_weights(path, "tiny", "ball")
    assert isinstance(field, TinyField) and field.config.dropout == 0.1 and not field.training
    assert metadata["scores"]["val/error"] < 0.8 * metadata["scores"]["val/copy"]
    assert metadata["shapes"] == {"family-ball": {"count": 5, "licences": {"CC0": 5}}}
    assert metadata["train"]["seed"] == 0 and metadata["versions"]["torch"] == torch.__version__
    lines = [json.loads(line) for line in (tmp_path / "run/metrics.jsonl").open()]
    losses = [line["loss/total"] for line in lines if "loss/total" in line]
    assert losses[-1] < losses[0] and lines[-1]["step"] == 150
    saved = json.loads((tmp_path / "run/run.json").read_text())
    assert saved["identity"]["config"]["preset"] == "tiny" and "commit" in saved


def test_a_second_training_in_the_same_folder_is_refused(data, tmp_path):
    with (
        write_lock(tmp_path / "run"),
        pytest.raises(OutputError, match=r"another run is writing to .*run"),
    ):
        run(data, tmp_path / "run")
    assert list(tmp_path.iterdir()) == []


def test_a_run_depends_on_its_seed_alone(data, tmp_path):
    first = run(data, tmp_path / "a")
    torch.manual_seed(123)
    assert same(first, run(data, tmp_path / "b"))
    assert not same(first, run(data, tmp_path / "c", tiny_config(seed=1)))


@pytest.mark.parametrize(("step", "muon"), [(1, []), (4, []), (6, []), (9, []), (6, ["encoder"])])
def test_an_interrupted_run_ends_at_the_same_weights(data, tmp_path, monkeypatch, step, muon):
    config = tiny_config(optimizer={"muon": muon})
    whole = run(data, tmp_path / "whole", config)
    batch, calls = loop.ShapeDataset.batch, []

    def interrupt(self, size, seed, *args):
        # Validation draws its batches with seed=0 by keyword.
        calls.append(step)
        if len(calls) > step:
            raise KeyboardInterrupt
        return batch(self, size, seed, *args)

    with monkeypatch.context() as patch, pytest.raises(KeyboardInterrupt):
        patch.setattr("nrdf.training.loop.validate", lambda *_: {})
        patch.setattr(loop.ShapeDataset, "batch", interrupt)
        run(data, tmp_path / "cut", config)
    assert not (tmp_path / "cut" / "weights.safetensors").exists()
    assert same(whole, run(data, tmp_path / "cut", config))
    # Once more, after the end: nothing left to do, nothing changed.
    assert same(whole, run(data, tmp_path / "cut", config))


def test_a_run_starts_with_a_models_weights_but_once(data, tmp_path, monkeypatch):
    given = run(data, tmp_path / "given", tiny_config(seed=5))
    whole = run(data, tmp_path / "whole", start=given)
    assert not same(whole, run(data, tmp_path / "fresh"))

    def interrupted(*args):
        raise KeyboardInterrupt

    with monkeypatch.context() as patch, pytest.raises(KeyboardInterrupt):
        patch.setattr(loop, "save_weights", interrupted)
        run(data, tmp_path / "cut", start=given)
    monkeypatch.setattr(loop, "start_with", interrupted)
    assert same(whole, run(data, tmp_path / "cut", start=given))


def test_a_killed_program_goes_on_to_the_same_weights(data, tmp_path):
    stage = {"name": "a", "weights": {"occupancy": 1}, "steps": 60, "batch_size": 4}
    changes = {"checkpoint_every": 3, "validate_every": 1000, "log_every": 1000, "stages": [stage]}
    out = tmp_path / "cut"
    process = program(data, out, changes)
    end = time.monotonic() + 60
    while latest_checkpoint(out) is None and process.poll() is None and time.monotonic() < end:
        time.sleep(0.002)
    process.kill()
    process.communicate()
    reached = latest_checkpoint(out)
    assert reached is not None and reached.name != "step-000000060"
    resumed = program(data, out, changes)
    _, messages = resumed.communicate()
    assert resumed.returncode == 0 and "going on from step" in messages
    whole = run(data, tmp_path / "whole", tiny_config(**changes))
    assert same(whole, out / "weights.safetensors")
    assert [path.name for path in (out / "checkpoints").iterdir()] == ["step-000000060"]


def test_control_c_leaves_a_checkpoint_of_the_step_it_came_in(data, tmp_path, monkeypatch):
    whole = run(data, tmp_path / "whole")
    occupancy = loop.LOSSES["occupancy"]
    calls = []
    before = signal.getsignal(signal.SIGINT)  # a background job has it ignored

    def interrupted(forward):
        calls.append(1)
        if len(calls) == 8:
            os.kill(os.getpid(), signal.SIGINT)
        return occupancy(forward)

    with monkeypatch.context() as patch, pytest.raises(KeyboardInterrupt):
        patch.setitem(loop.LOSSES, "occupancy", interrupted)
        run(data, tmp_path / "cut")
    assert latest_checkpoint(tmp_path / "cut").name == "step-000000008"
    assert signal.getsignal(signal.SIGINT) is before
    assert same(whole, run(data, tmp_path / "cut"))


def begun(data, out, begin, **changes) -> Path:
    return run(data, out, tiny_config(**changes), begin=begin)


def test_a_run_begun_from_anothers_stages_ends_as_if_alone(data, tmp_path, monkeypatch):
    first, second = (stage.model_dump() for stage in tiny_config().stages)
    third = {**first, "name": "third", "parts": "all"}
    stages, fewer = [first, second, third], {**third, "weights": {"correspondence": 1}}
    run(data, tmp_path / "shared", tiny_config(stages=stages[:2]))
    whole = run(data, tmp_path / "whole", tiny_config(stages=stages))
    assert same(whole, begun(data, tmp_path / "begun", tmp_path / "shared", stages=stages))
    other = run(data, tmp_path / "other", tiny_config(stages=[first, second, fewer]))
    assert not same(whole, other)
    # Interrupted in its own stage it goes on from its own checkpoint.
    step, calls = loop.learning_rate, []

    def interrupt(*args):
        calls.append(1)
        if len(calls) == 5:
            raise KeyboardInterrupt
        return step(*args)

    changes = {"stages": [first, second, fewer], "begin": tmp_path / "shared"}
    with monkeypatch.context() as patch, pytest.raises(KeyboardInterrupt):
        patch.setattr(loop, "learning_rate", interrupt)
        begun(data, tmp_path / "cut", **changes)
    assert latest_checkpoint(tmp_path / "cut").name == "step-000000018"
    monkeypatch.setattr(loop, "learning_rate", lambda *args: calls.append(1) or step(*args))
    calls.clear()
    assert same(other, begun(data, tmp_path / "cut", **changes)) and len(calls) == 2


def test_a_run_does_not_begin_from_one_that_went_another_way(data, tmp_path):
    first, second = (stage.model_dump() for stage in tiny_config().stages)
    run(data, tmp_path / "shared", tiny_config(stages=[first]))
    changed = {**first, "rate": 0.5}
    for changes, message in (
        ({"seed": 3}, r"cannot begin from .*shared: its config\.seed is 0, not 3; begin from"),
        ({"stages": [changed, second]}, r"its config\.stages is "),
    ):
        with pytest.raises(ConfigError, match=message):
            begun(data, tmp_path / "run", tmp_path / "shared", **changes)
    with pytest.raises(ConfigError, match="no training run"):
        begun(data, tmp_path / "run", tmp_path / "nothing")
    assert not (tmp_path / "run").exists()


def test_frozen_parts_stay_as_they_were(data, tmp_path):
    stage = {"name": "a", "weights": {"correspondence": 1}, "steps": 3, "rate": 0.05}
    config = tiny_config(stages=[{**stage, "parts": ["inverse"]}], ema=None)
    trained = load_weights(run(data, tmp_path / "run", config))[0].state_dict()
    torch.manual_seed(config.seed)
    fresh = TinyField().state_dict()
    moved = {
        name.split(".")[0]
        for name in fresh
        if not torch.allclose(fresh[name].float(), trained[name].float(), atol=1e-3)
    }
    assert moved == {"inverse"}


def test_a_part_that_does_not_exist_is_named(data, tmp_path):
    stage = {"name": "a", "weights": {"occupancy": 1}, "steps": 1, "parts": ["encodr"]}
    with pytest.raises(ConfigError, match="no part 'encodr'; known: encoder, norm"):
        run(data, tmp_path / "run", tiny_config(stages=[stage]))
    with pytest.raises(ConfigError, match=r"optimizer\.muon: no part 'decodr'; known: encoder"):
        run(data, tmp_path / "run", tiny_config(optimizer={"muon": ["decodr"]}))
    assert list(tmp_path.iterdir()) == []


def test_another_run_in_the_folder_is_refused(data, tmp_path):
    run(data, tmp_path / "run")
    with pytest.raises(OutputError, match=r"its config\.seed is 0, not 5; choose another folder"):
        run(data, tmp_path / "run", tiny_config(seed=5))
    with pytest.raises(DataError, match="of category ball, not chair"):
        train(tiny_config(), [data], tmp_path / "run", category="chair", device="cpu")
    run(data, tmp_path / "run", tiny_config(seed=5), overwrite=True)


def test_a_folder_with_something_else_is_refused_and_kept(data, tmp_path):
    (tmp_path / "thesis.txt").write_text("mine")
    for overwrite in (False, True):
        with pytest.raises(OutputError, match="is not empty and holds no training run"):
            run(data, tmp_path, overwrite=overwrite)
    assert (tmp_path / "thesis.txt").read_text() == "mine"


def test_a_loss_that_stays_infinite_stops_the_run_and_names_the_step(data, tmp_path, monkeypatch):
    occupancy = loop.LOSSES["occupancy"]
    calls = []

    def bad(forward):
        calls.append(1)
        return occupancy(forward) * (float("nan") if len(calls) > 4 else 1.0)

    monkeypatch.setitem(loop.LOSSES, "occupancy", bad)
    stage = {"name": "a", "weights": {"occupancy": 1}, "steps": 30, "batch_size": 4}
    with pytest.raises(TrainingError, match=r"step 8 \(stage 'a'\).*not finite: total, occupancy"):
        run(data, tmp_path / "run", tiny_config(stages=[stage]))


def test_one_infinite_step_changes_nothing_and_is_skipped(data, tmp_path, monkeypatch, caplog):
    occupancy = loop.LOSSES["occupancy"]
    calls = []

    def bad(forward):
        calls.append(1)
        return occupancy(forward) * (float("inf") if len(calls) == 3 else 1.0)

    monkeypatch.setitem(loop.LOSSES, "occupancy", bad)
    field, _ = load_weights(run(data, tmp_path / "run"))
    assert "step 2 (stage 'shape') had no finite gradient" in caplog.text
    assert all(value.isfinite().all() for value in field.state_dict().values())


def test_rates_warm_up_and_fall():
    stage = tiny_config().stages[1]
    rates = [learning_rate(stage, step, 100) for step in range(100)]
    assert rates[0] < rates[1] < rates[2] and rates[2] == pytest.approx(0.01, rel=0.01)
    assert rates[99] < 1e-4 and all(a >= b for a, b in pairwise(rates[2:]))


def test_bfloat16_trains(data, tmp_path):
    config = tiny_config(precision="bfloat16")
    field, _ = load_weights(run(data, tmp_path / "run", config))
    assert all(value.isfinite().all() for value in field.state_dict().values())
    full = tiny_config(precision="float32")
    assert not same(tmp_path / "run/weights.safetensors", run(data, tmp_path / "full", full))


def test_shapes_of_another_category_are_refused(tmp_path):
    (tmp_path / "data").mkdir()
    write_folder(tmp_path / "data", [*balls(3), Ball("cup", category="cup")], val=0)
    with pytest.raises(DataError, match="of category ball, cup, not ball"):
        run(tmp_path / "data", tmp_path / "run")
