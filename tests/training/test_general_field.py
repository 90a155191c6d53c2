"""The general field's training: it learns, goes on when killed, and says what it was trained on."""

from __future__ import annotations

import pytest
import torch

from builders.step_shape import step_shape
from nrdf.errors import DataError
from nrdf.field.general import GeneralConfig, GeneralField
from nrdf.field.weights import load_weights
from nrdf.shapes.dataset import IndexRow, write_index, write_shape
from nrdf.training import general_pairs
from nrdf.training.general_field import GeneralSettings, pair_loss, train_general
from nrdf.training.general_pairs import draw_pairs, make_pool

SMALL = GeneralConfig(tokens=24, width=16, heads=2, looks=2)
FEW = GeneralSettings(steps=2, batch=2, kinds=2, families=())


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Two shapes to train on, and one that is not."""
    place, rows = tmp_path_factory.mktemp("shapes"), []
    for number, split in enumerate(("train", "train", "test")):
        shape = step_shape(f"step-{number}", number)
        write_shape(place / f"{shape.name}.npz", shape)
        rows.append(IndexRow(shape.name, "blocks", split, "CC0"))
    write_index(place, rows)
    return place


@pytest.fixture(autouse=True)
def small(monkeypatch):
    monkeypatch.setattr(general_pairs, "POINTS", 256)
    monkeypatch.setattr("nrdf.training.general_field._SURFACE_POINTS", 300)
    monkeypatch.setattr("nrdf.training.general_field._VALIDATION_PAIRS", 4)


def test_the_loss_falls_on_pairs_that_are_seen_again():
    torch.manual_seed(0)
    field = GeneralField(SMALL)
    pool = make_pool([], 2, (), 0, 0)
    pair = draw_pairs(pool, 4, torch.Generator().manual_seed(0))
    optimizer = torch.optim.Adam(field.parameters(), 3e-3)
    losses, errors = [], []
    for _ in range(30):
        loss, error = pair_loss(field, pair)
        optimizer.zero_grad()
        loss.backward()
        optimizer.step()
        losses.append(float(loss.detach()))
        errors.append(float(error))
    assert losses[-1] < losses[0] - 0.1 and errors[-1] < 0.95 * errors[0]


def test_a_run_says_what_it_was_trained_on_and_is_not_done_twice(folder, tmp_path):
    weights = train_general([folder], tmp_path / "run", FEW, SMALL)
    field, metadata = load_weights(weights, "general", "")
    assert isinstance(field, GeneralField)
    assert metadata["shapes"]["blocks"] == {"count": 2, "licences": {"CC0": 2}}
    assert metadata["shapes"]["assemblies"]["licences"] == {"MIT": 2}
    assert 0 < metadata["scores"]["assemblies"] < 1
    seen = []
    again = train_general(
        [folder], tmp_path / "run", FEW, SMALL, progress=lambda *at: seen.append(at)
    )
    assert not seen
    other = load_weights(again)[0].state_dict()
    assert all(torch.equal(value, other[name]) for name, value in field.state_dict().items())


def test_folders_without_shapes_are_refused(tmp_path):
    with pytest.raises(DataError, match="no training shapes in no folder"):
        train_general([], tmp_path / "run", FEW)
