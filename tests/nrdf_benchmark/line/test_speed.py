"""What the benchmark of the line counts."""

from __future__ import annotations

import pytest

from nrdf_benchmark.line.speed import LineSpeed


def test_speed_and_growth():
    resident = (*[500.0] * 10, *[1000.0] * 80, *[1050.0] * 10)
    speed = LineSpeed(2, {"done": 100}, 120.0, (3.0,) * 100, resident)
    assert speed.per_minute == 50.0 and speed.per_core_minute == 20.0
    assert speed.memory_growth == pytest.approx(0.05)
