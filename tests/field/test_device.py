"""Which device and precision a network runs in."""

import pytest
import torch

from nrdf.errors import ConfigError
from nrdf.field.device import choose_device, choose_precision


def test_devices_are_checked():
    assert choose_device("cpu").type == "cpu"
    with pytest.raises(ConfigError, match="no device 'gpu'; known: auto, cpu, cuda"):
        choose_device("gpu")
    if not torch.cuda.is_available():
        assert choose_device("auto").type == "cpu"
        with pytest.raises(ConfigError, match="finds no CUDA; use cpu or auto"):
            choose_device("cuda")


def test_precision_is_what_is_asked_for(monkeypatch):
    cpu = torch.device("cpu")
    assert choose_precision("bfloat16", cpu) == torch.bfloat16
    assert choose_precision("float32", cpu) == torch.float32
    for fast, expected in ((True, torch.bfloat16), (False, torch.float32)):
        monkeypatch.setattr("nrdf.field.device.cpu_has_bfloat16", lambda fast=fast: fast)
        assert choose_precision("auto", cpu) == expected
