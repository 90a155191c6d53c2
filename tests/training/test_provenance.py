"""Where shapes and code of a run come from."""

from __future__ import annotations

from pathlib import Path

import torch

import nrdf
from builders.tiny_field import balls, write_folder
from nrdf.training import provenance
from nrdf.training.distributed import Workers
from nrdf.training.provenance import Entry, environment, git_commit, list_shapes


def test_training_shapes_are_counted_by_source_with_their_licences():
    rows = [("a", "train", "MIT"), ("a", "train", "CC0"), ("b", "train", "MIT"), ("a", "val", "")]
    entries = [Entry(Path("x.npz"), *row) for row in rows]
    assert provenance.provenance(entries) == {
        "a": {"count": 2, "licences": {"MIT": 1, "CC0": 1}},
        "b": {"count": 1, "licences": {"MIT": 1}},
    }


def test_shapes_are_listed_in_order(tmp_path):
    write_folder(tmp_path, balls(3), val=1)
    assert [entry.path.name for entry in list_shapes([tmp_path])] == [
        "ball-0.npz", "ball-1.npz", "ball-2.npz"
    ]  # fmt: skip


def test_a_result_says_what_made_it():
    found = environment(Workers(0, 3, torch.device("cpu")))
    assert found["versions"]["torch"] == torch.__version__ and found["processes"] == 3
    assert found["device"].startswith("cpu") and found["versions"]["nrdf"] == nrdf.__version__


def test_outside_of_a_checkout_there_is_no_commit(monkeypatch):
    def refuse(*words, **options):
        raise OSError

    monkeypatch.setattr(provenance.subprocess, "run", refuse)
    assert git_commit() is None
