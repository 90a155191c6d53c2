"""The options of a scan, and what is refused about them."""

from __future__ import annotations

import logging
from types import SimpleNamespace

import numpy as np
import pytest

from nrdf.errors import CloudError
from nrdf.io.cloud import PointCloud, write_cloud
from nrdf.serve.scan_input import ScanOptions, alignment_examples, read_scan, warn_of_scan


def test_options_of_a_scan_need_up():
    for options in (ScanOptions(None, sensor=(0.0, 0.0, 1.0)), ScanOptions(None, skip=("floor",))):
        with pytest.raises(CloudError, match="--sensor and --skip are for scans: give --up"):
            options.refuse_without_up("sensor", "skip")
    ScanOptions(None, unit="mm").refuse_without_up("sensor", "skip")
    ScanOptions("z", skip=("floor",)).refuse_without_up("sensor", "skip")


def test_sensors_are_passed_on_as_rows_of_three(tmp_path, monkeypatch):
    write_cloud(tmp_path / "scan.ply", PointCloud(np.random.default_rng(0).random((50, 3))))
    seen = []
    monkeypatch.setattr("nrdf.scans.aligned_scan.align", lambda *given: seen.append(given))
    read_scan(None, tmp_path / "scan.ply", ScanOptions("z", (1.0, 2.0, 3.0, 4.0, 5.0, 6.0), "mm"))
    model, cloud, up, sensors, unit, skip, examples = seen[0]
    assert (model, len(cloud), up, unit, skip, examples) == (None, 50, "z", "mm", (), ())
    assert sensors.tolist() == [[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]]
    with pytest.raises(CloudError, match="--sensor has 4 numbers"):
        read_scan(None, tmp_path / "scan.ply", ScanOptions("z", (1.0, 2.0, 3.0, 4.0)))


def test_only_a_category_without_a_family_is_aligned_by_its_reference():
    reference = PointCloud(np.eye(3))
    assert alignment_examples(SimpleNamespace(category="chair"), reference) == []
    assert alignment_examples(SimpleNamespace(category="sofa"), reference) == [reference]


def test_warnings_and_a_guessed_unit_are_logged_with_the_file(caplog):
    scan = SimpleNamespace(
        unit=SimpleNamespace(origin="guessed", name="mm"), warnings=["two objects"]
    )
    log = logging.getLogger("nrdf.serve.scan_input")
    log.addHandler(caplog.handler)
    with caplog.at_level(logging.INFO, log.name):
        warn_of_scan(scan, "scan.ply")
    log.removeHandler(caplog.handler)
    assert list(dict.fromkeys(record.getMessage() for record in caplog.records)) == [
        "scan.ply: the unit is guessed to be mm",
        "scan.ply: two objects",
    ]
