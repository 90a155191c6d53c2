from __future__ import annotations

from builders.export_checks import (
    compare,
    written,
)
from builders.read_programs import (
    read_apt,
)


def test_apt(wild, tmp_path):
    compare(wild, read_apt(written(wild, "apt", tmp_path)))
