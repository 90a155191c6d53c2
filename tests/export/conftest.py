"""Fixtures of the exports' tests."""

from __future__ import annotations

import pytest

from builders.export_jobs import wild_job


@pytest.fixture(scope="session")
def wild():
    return wild_job()
