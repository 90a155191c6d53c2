"""Configurations: what is read, and what is refused with which words."""

from __future__ import annotations

import pytest

from builders.tiny_field import tiny_config
from nrdf.errors import ConfigError
from nrdf.training.config import CONFIG_FOLDER, load_config

STAGE = {"name": "a", "weights": {"occupancy": 1}, "steps": 1}


def test_a_configuration_survives_json():
    config = tiny_config()
    assert load_config(config.model_dump(mode="json")) == config


def test_a_file_is_read(tmp_path):
    path = tmp_path / "mine.yaml"
    path.write_text("preset: paper\nstages: [{name: a, weights: {occupancy: 1}, epochs: 2}]\n")
    config = load_config(path)
    assert config.preset == "paper" and config.stages[0].epochs == 2


@pytest.mark.parametrize("path", sorted(CONFIG_FOLDER.glob("*.yaml")), ids=lambda path: path.stem)
def test_shipped_configurations_are_valid(path):
    assert load_config(path) == load_config(path.stem)
    assert path.read_text().startswith("#"), "a config says in a comment what it costs"


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"sed": 1}, "unknown key 'sed'; did you mean 'seed'?"),
        ({"data": {"query": 3}}, "unknown key 'data.query'; did you mean 'queries'?"),
        ({"data": {"augment": {"wrap": 1}}}, "did you mean 'warp'?"),
        ({"optimizer": {"cilp": 1}}, "did you mean 'clip'?"),
        ({"optimizer": {"name": "adamw", "muon": ["encoder"]}}, "muon goes with name: adam"),
        ({"stages": [{**STAGE, "batchsize": 3}]}, "did you mean 'batch_size'?"),
        ({"stages": [{**STAGE, "weights": {"ocupancy": 1}}]}, "did you mean 'occupancy'?"),
        ({"stages": [{**STAGE, "epochs": 3}]}, "give either epochs or steps"),
        ({"stages": [{**STAGE, "batch_size": 1}]}, "stages.0.batch_size: "),
        ({"stages": []}, "stages: "),
        ({"ema": 1.5}, "ema: "),
    ],
)
def test_mistakes_are_named_with_what_is_right(change, message):
    with pytest.raises(ConfigError) as caught:
        load_config({"preset": "paper", "stages": [STAGE], **change})
    assert message in str(caught.value)


def test_files_that_are_no_configuration(tmp_path):
    with pytest.raises(ConfigError, match="no configuration file 'nothing'; give a YAML file"):
        load_config("nothing")
    path = tmp_path / "x.yaml"
    for text, message in (("a: [", "not valid YAML"), ("3", "must hold a mapping")):
        path.write_text(text)
        with pytest.raises(ConfigError, match=message):
            load_config(path)
