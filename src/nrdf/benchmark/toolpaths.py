"""How well rasters are planned: on the named regions of family members, and on BSRC's regions."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from nrdf.errors import ProcessError
from nrdf.process.coverage import Measures, measure
from nrdf.process.plan import Strategy, plan
from nrdf.process.surface import Surface
from nrdf.shapes.families import get_family

FIRST_SEED = 1_000_000  # members that no training set holds
POINTS = 8192
SIZE_M = 0.9
"""Length of every object's longest side."""
LEAST_POINTS = 10
"""Regions of fewer points are left out."""
BARS = {
    "coverage": "at least 99 % covered",
    "spacing": "lines at most 1.15 stepovers apart",
    "distance": "99 % of waypoints within 1 mm of the surface",
    "axis": "99 % of tool axes within 5° of what was asked",
}


@dataclass(frozen=True)
class Planned:
    """One region: its object and name, the figures of its tool path, and seconds to plan it."""

    item: str
    region: str
    measures: Measures
    seconds: float

    def meets(self, stepover_m: float) -> dict[str, bool]:
        """Which of `BARS` it keeps."""
        worst = self.measures.line_spacing_worst_m
        return {
            "coverage": self.measures.coverage >= 0.99,
            "spacing": worst is None or worst <= 1.15 * stepover_m,
            "distance": self.measures.surface_distance_99_m <= 0.001,
            "axis": self.measures.axis_error_99_rad <= np.radians(5.0),
        }


def plan_regions(
    category: str,
    strategy: Strategy,
    members: int = 6,
    bsrc: Path | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> tuple[list[Planned], list[str]]:
    """Plan and measure every region; those that could not be planned are named with the reason.

    Objects are `members` of the family of `category`, or with `bsrc` the benchmark's objects of it
    (corrected labels). `progress` is told (objects done, all). Raises DataError as `read_bsrc`
    does.
    """
    objects = list(_members(category, members) if bsrc is None else _benchmark(category, bsrc))
    found, faults = [], []
    for done, (name, points, normals, regions) in enumerate(objects, 1):
        surface = Surface(SIZE_M * points / np.ptp(points, axis=0).max(), normals)
        for region, indices in regions.items():
            start = time.process_time()
            try:
                segments = plan(surface, indices, strategy)
            except ProcessError as error:
                faults.append(f"{name}, {region}: {error}")
                continue
            seconds = time.process_time() - start
            figures = measure(surface, indices, strategy, segments)
            found.append(Planned(name, region, figures, seconds))
        if progress is not None:
            progress(done, len(objects))
    return found, faults


_Object = tuple[str, np.ndarray, np.ndarray, dict[str, np.ndarray]]


def _members(category: str, count: int) -> Iterator[_Object]:
    family = get_family(category)
    for seed in range(FIRST_SEED, FIRST_SEED + count):
        sample = family.member(seed).sample_surface(POINTS, np.random.default_rng(seed))
        names = family.region_of(sample.coordinates)
        regions = {str(name): np.flatnonzero(names == name) for name in family.region_names}
        kept = {name: where for name, where in regions.items() if len(where) >= LEAST_POINTS}
        yield f"{category} {seed}", sample.points, sample.normals, kept


def _benchmark(category: str, folder: Path) -> Iterator[_Object]:
    from nrdf.benchmark.bsrc import read_bsrc

    for item in read_bsrc(folder, category, "corrected").objects:
        assert item.cloud.normals is not None  # read_bsrc estimates them
        yield item.name, item.cloud.points, item.cloud.normals, dict(item.truth)
