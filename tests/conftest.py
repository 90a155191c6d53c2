"""Fixtures that several test modules share."""

from __future__ import annotations

import os
import tempfile

import pytest

# One thread a process: tests run on every core at once (pytest-xdist), and start processes too.
for variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ.setdefault(variable, "1")
# Models that whoever runs the tests has learned must not serve in them.
os.environ["XDG_DATA_HOME"] = tempfile.mkdtemp(prefix="nrdf-tests-")


@pytest.fixture(scope="session")
def untrained(tmp_path_factory):
    """A weight file of the default preset, category chair, with its initial weights but for one:
    it knows that it is far off."""
    import torch

    from nrdf.field import build_field
    from nrdf.field.weights import save_weights

    path = tmp_path_factory.mktemp("weights") / "untrained.safetensors"
    with torch.random.fork_rng():
        torch.manual_seed(0)
        field = build_field("default")
        field.inverse.leave.bias.data[7] = 0.7  # log error
    shapes = {"family": {"count": 3, "licences": {"MIT": 3}}}
    save_weights(path, field, {"category": "chair", "shapes": shapes, "scores": {"own": 0.5}})
    return path


@pytest.fixture(scope="session")
def arm():
    """The bundled arm."""
    from nrdf.robot.model.arm import load_arm

    return load_arm()


@pytest.fixture(scope="session")
def plate_job(tmp_path_factory):
    """The folder of a job on a plate of 0.3 m with one region; not to be written into."""
    from builders.plate_job import write_plate_job

    return write_plate_job(tmp_path_factory.mktemp("plate"))
