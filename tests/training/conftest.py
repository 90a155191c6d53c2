"""Fixtures of the tests of training."""

from __future__ import annotations

import pytest

from builders.step_shape import step_shape
from nrdf.shapes.dataset import IndexRow, write_index, write_shape


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A data folder of twelve steps, the last one for tests."""
    folder = tmp_path_factory.mktemp("steps")
    rows = []
    for number in range(12):
        name = f"step-{number:02d}"
        write_shape(folder / f"{name}.npz", step_shape(name, number))
        rows.append(IndexRow(name, "blocks", "test" if number == 11 else "train", "MIT"))
    write_index(folder, rows)
    return folder
