"""Table III: variants that share their first stages, and the command."""

from __future__ import annotations

import threading

import pytest
import torch

from builders.tiny_ablation import CONFIG, STAGES
from builders.tiny_field import balls, tiny_config, write_folder
from nrdf.errors import ConfigError
from nrdf.field import PRESETS
from nrdf.field.weights import load_weights
from nrdf.training import loop
from nrdf.training.config import load_config
from nrdf.training.loop import train
from nrdf_benchmark.ablation import training as ablation
from nrdf_benchmark.ablation.training import (
    COMPLETE,
    OMITTED,
    SHARED,
    VARIANTS,
    read_cost,
    shared_config,
    train_variants,
    variant_config,
)


@pytest.fixture(autouse=True)
def tiny_preset(monkeypatch):
    monkeypatch.setitem(PRESETS, "tiny", "builders.tiny_field:TinyField")
    monkeypatch.setattr("nrdf.training.progress._tensorboard", lambda folder, step: None)


@pytest.fixture(scope="module")
def data(tmp_path_factory):
    folder = tmp_path_factory.mktemp("data")
    write_folder(folder, balls(7, category="chair"))
    return folder


def run(data, out, variants=VARIANTS, config=CONFIG, **options):
    return train_variants(variants, config, [data], out, category="chair", device="cpu", **options)


def same(a, b) -> bool:
    one, two = (load_weights(path / "weights.safetensors")[0].state_dict() for path in (a, b))
    return all(torch.equal(one[name], two[name]) for name in one)


def test_a_variant_lacks_one_loss_of_the_last_stage_and_nothing_else():
    paper = load_config("ablation-short")
    assert variant_config(paper, COMPLETE) == paper
    for variant, loss in OMITTED.items():
        changed = variant_config(paper, variant)
        weights = {**changed.stages[-1].weights, loss: paper.stages[-1].weights[loss]}
        last = changed.stages[-1].model_copy(update={"weights": weights})
        assert loss not in changed.stages[-1].weights
        assert changed.model_copy(update={"stages": [*changed.stages[:-1], last]}) == paper
    assert shared_config(paper).stages == paper.stages[:-1]
    trained = load_config("paper-short")
    assert trained.stages[2] == paper.stages[1], "self reconstruction"
    assert trained.stages[3].weights == paper.stages[2].weights
    assert trained.data.inside == 0.5 and paper.data.inside is None, "Table III was measured so"
    as_stored = trained.data.model_copy(update={"inside": None})
    assert trained.model_copy(update={"stages": paper.stages, "data": as_stored}) == paper


def test_variants_that_cannot_be_are_refused():
    with pytest.raises(ConfigError, match="no variant 'ed'; known: complete, cd, emd"):
        variant_config(CONFIG, "ed")
    without = tiny_config(stages=[STAGES[0], STAGES[1]])
    with pytest.raises(ConfigError, match="'cd' leaves out 'chamfer', which the last stage 'b'"):
        variant_config(without, "cd")
    with pytest.raises(ConfigError, match="needs stages before"):
        shared_config(tiny_config(stages=STAGES[:1]))


def test_every_variant_ends_as_if_trained_from_scratch(data, tmp_path):
    runs = run(data, tmp_path / "out", ("complete", "emd"))
    assert list(runs) == [("complete", 0), ("emd", 0)]
    assert sorted(p.name for p in (tmp_path / "out").iterdir() if p.is_dir()) == sorted(
        ["complete", "emd", SHARED]
    )
    for (variant, _), folder in runs.items():
        config = variant_config(CONFIG, variant)
        train(config, [data], tmp_path / variant, category="chair", device="cpu")
        assert same(tmp_path / variant, folder)
        assert read_cost(folder) > 0
    assert not same(runs["complete", 0], runs["emd", 0])


def test_seeds_differ_in_the_last_stage_alone(data, tmp_path, monkeypatch):
    trained, steps = loop.train, []
    monkeypatch.setattr(
        ablation, "train", lambda *a, **k: steps.append(a[2].name) or trained(*a, **k)
    )
    runs = run(data, tmp_path / "out", ("complete",), seeds=2)
    assert {key: folder.name for key, folder in runs.items()} == {
        ("complete", 0): "complete",
        ("complete", 1): "complete-seed-1",
    }
    assert steps == [SHARED, "complete", "complete-seed-1"]
    assert not same(*runs.values())
    config = variant_config(CONFIG, COMPLETE, 1)
    assert config.stages[:-1] == CONFIG.stages[:-1] and config.stages[-1].seed == 1
    assert config.seed == CONFIG.seed
    train(config, [data], tmp_path / "scratch", category="chair", device="cpu")
    assert same(tmp_path / "scratch", runs["complete", 1])


def test_what_is_trained_is_not_trained_again_and_what_is_not_goes_on(data, tmp_path, monkeypatch):
    whole = run(data, tmp_path / "whole", ("cd",))["cd", 0]
    rate, steps = loop.learning_rate, []

    def counted(*args):
        steps.append(1)
        if len(steps) == 8:
            raise KeyboardInterrupt
        return rate(*args)

    monkeypatch.setattr(loop, "learning_rate", counted)
    with pytest.raises(KeyboardInterrupt):
        run(data, tmp_path / "cut", ("cd",))
    spent = read_cost(tmp_path / "cut/cd")
    assert spent > 0
    cut = run(data, tmp_path / "cut", ("cd",))["cd", 0]
    assert same(whole, cut) and len(steps) == 8 + 3  # the checkpoint is of step 6 of 9
    assert read_cost(cut) > spent
    run(data, tmp_path / "cut", ("cd",))
    assert len(steps) == 11
    run(data, tmp_path / "cut", ("cd", "dd"))
    assert len(steps) == 11 + 4
    run(data, tmp_path / "cut", ("cd",), overwrite=True)
    assert len(steps) == 15 + 9


def test_one_process_waits_for_the_other(tmp_path):
    order, held = [], threading.Event()

    def second():
        held.wait()
        with ablation.turn(tmp_path, "cd"):
            order.append("second")

    thread = threading.Thread(target=second)
    thread.start()
    with ablation.turn(tmp_path, "cd"):
        held.set()
        with ablation.turn(tmp_path, "emd"):
            thread.join(0.2)
            order.append("first")
    thread.join()
    assert order == ["first", "second"]


def test_torchrun_is_refused(data, tmp_path, monkeypatch):
    monkeypatch.setenv("WORLD_SIZE", "2")
    with pytest.raises(ConfigError, match="does not run under torchrun"):
        run(data, tmp_path)
