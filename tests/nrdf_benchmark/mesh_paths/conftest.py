"""Fewer points of the skin than real meshes need."""

from __future__ import annotations

import pytest

from nrdf_benchmark.mesh_paths import targets


@pytest.fixture(autouse=True)
def few_samples(monkeypatch):
    monkeypatch.setattr(targets, "SAMPLES", 6000)
