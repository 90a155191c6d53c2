"""`nrdf eval toolpaths`: planned paths on known regions."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from builders.bsrc_folder import member_clouds, write_bsrc
from builders.surfaces import board
from nrdf.errors import DataError
from nrdf_benchmark.toolpaths import (
    NEAR_M,
    SIZE_M,
    STRATEGY,
    PlanningObject,
    bsrc_objects,
    evaluate_toolpaths,
    family_members,
    summarize,
)


def flat(name: str = "board", exact=None) -> PlanningObject:
    points, normals = board()
    return PlanningObject(name, points, normals, {"all": np.arange(len(points))}, exact)


def test_the_figures_of_a_flat_board_meet_every_bar():
    results = evaluate_toolpaths([flat(exact=lambda p, n: np.abs(p[:, 2]) < NEAR_M)])
    (result,) = results
    assert result.wide and result.width_m == pytest.approx(0.3, abs=0.02)
    assert result.near == 1.0 and result.bend_rad < 1e-6
    shown = {metric.name: metric for metric in summarize(results)}
    assert len(shown) == 8
    assert all(metric.met.all() for metric in shown.values())
    assert shown["coverage of what is not left out, %"].worst == pytest.approx(100.0, abs=1.0)


def test_what_misses_a_bar_is_counted():
    edge = replace(STRATEGY, trajectory="edge")  # along the border alone
    results = evaluate_toolpaths([flat(), flat()], edge)
    coverage = summarize(results, edge)[1]
    assert not coverage.met.any()
    rim = 1.0 - (0.4 - 2 * 0.025) * (0.3 - 2 * 0.025) / (0.4 * 0.3)
    assert coverage.worst == pytest.approx(100.0 * rim, abs=15.0)


def test_members_have_their_size_and_an_exact_surface():
    done = []
    (chair,) = family_members("chair", 1)
    assert np.ptp(chair.points, axis=0).max() == pytest.approx(SIZE_M, rel=0.02)
    inside = chair.regions["seat"][:200]
    near = chair.exact(chair.points[inside], chair.normals[inside])
    off = chair.exact(
        chair.points[inside] + 2 * NEAR_M * chair.normals[inside], chair.normals[inside]
    )
    assert near.mean() > 0.98 and off.mean() < 0.02
    seat = replace(chair, regions={"seat": chair.regions["seat"]})
    (result,) = evaluate_toolpaths([seat], progress=done.append)
    assert done == [1]
    assert result.metrics.coverage > 0.99 and result.near > 0.9
    with pytest.raises(DataError, match="0 members asked for"):
        next(family_members("chair", 0))


def test_the_benchmarks_objects_are_scaled(tmp_path):
    root = write_bsrc(tmp_path, "chair", member_clouds("chair", (0, 1)))
    for item in bsrc_objects(root, "chair"):
        assert np.ptp(item.points, axis=0).max() == pytest.approx(SIZE_M)
        assert item.exact is None and len(item.regions) == 8
