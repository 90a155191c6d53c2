"""The examples that speed is measured on."""

from __future__ import annotations

import os

import numpy as np

from nrdf_benchmark.speed.common import POINTS, Stopwatch, eight_regions, example, in_new_process


def test_eight_regions_share_the_cloud_out():
    cloud = example(1)
    regions = eight_regions(cloud)
    assert len(regions) == 8 and len(cloud) == POINTS
    np.testing.assert_array_equal(sum(mask.astype(int) for mask in regions.values()), 1)
    assert cloud.normals is None


def test_a_lap_ends_where_the_next_begins():
    clock = Stopwatch("cpu")
    laps = [clock.lap() for _ in range(3)]
    assert all(0 <= lap < 1 for lap in laps)


def test_a_measurement_has_a_process_of_its_own():
    assert in_new_process(os.getpid) != os.getpid()
