"""`nrdf eval speed`: the time of a transfer."""

from __future__ import annotations

import pytest

from nrdf_benchmark.commands.speed import show_transfer_speed
from nrdf_benchmark.speed.transfer import measure_transfer


def test_the_parts_of_a_transfer_add_up(capsys):
    speed = measure_transfer(repeats=1)
    assert (speed.regions, speed.points) == (8, 8192)
    assert {"regions", "tool paths", "pictures", "files"} <= set(speed.phases)
    assert sum(speed.phases.values()) == pytest.approx(speed.wall_s)
    assert speed.cpu_s > 0.0
    show_transfer_speed(speed)
    assert "must keep to" in capsys.readouterr().out
