"""Many objects on many workers, simulated."""

from __future__ import annotations

import pytest

from nrdf_benchmark.line import scale_out
from nrdf_benchmark.line.scale_out import draw_scale_out, limits, measure_overhead, simulate


def test_hours_follow_from_work_and_workers(monkeypatch):
    monkeypatch.setattr(scale_out, "_DEATHS_A_DAY", 0.0)
    found = simulate([3.6], 0.0, 1000, 10)
    assert found.hours == pytest.approx(0.1 + 10 / 3600, rel=1e-6) and found.deaths == 0
    assert found.worker_busy == pytest.approx(360 / 370, rel=1e-6)


def test_a_scheduler_that_is_slower_than_its_workers_sets_the_pace():
    found = simulate([1.0], 0.1, 1000, 100)
    assert found.hours == pytest.approx((10 + 100 + 1) / 3600, rel=1e-3)
    assert found.scheduler_busy > 0.85 and found.worker_busy < 0.2


def test_workers_that_die_cost_their_task_and_a_start(monkeypatch):
    monkeypatch.setattr(scale_out, "_DEATHS_A_DAY", 43200.0)
    found = simulate([1.0], 0.0, 2000, 1)
    assert 900 < found.deaths < 1100
    assert found.hours * 3600 == pytest.approx(10 + 2000 + 10.5 * found.deaths, rel=0.02)


def test_what_a_job_needs_is_measured_on_jobs(tmp_path):
    (tmp_path / "job").mkdir()
    for name in "ab":
        (tmp_path / "job" / name).write_bytes(bytes(500_000))
    said = {what: how for what, how, _ in limits([tmp_path / "job"], 10**6)}
    assert said["files"].startswith("2,000,000") and said["disk"].startswith("1.00 TB")


def test_overhead_is_what_more_tasks_cost(monkeypatch):
    monkeypatch.setattr(scale_out, "_processor_time", lambda n: (1.0 + 0.001 * n, 2.0 + 0.002 * n))
    found = measure_overhead()
    assert found.serial_s == pytest.approx(0.001) and found.whole_s == pytest.approx(0.003)


def test_the_picture_is_drawn(tmp_path, monkeypatch):
    monkeypatch.setattr(scale_out, "_DRAWN", 1000)
    draw_scale_out(tmp_path / "a.png", [1.0, 2.0], 0.001, 10**6)
    assert (tmp_path / "a.png").stat().st_size > 10_000
