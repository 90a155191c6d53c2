"""Tables."""

from __future__ import annotations

import numpy as np
import pytest

from nrdf.shapes.families import Member, SurfaceCoordinates, get_family


def test_volume_agrees_with_the_divergence_theorem() -> None:
    """Independent of occupancy: the volume is the surface integral of x·n / 3."""
    member = get_family("table").member(3)
    rng = np.random.default_rng(0)
    queries = rng.uniform(-0.5, 0.5, (200_000, 3))
    volume = member.occupancy(queries).mean()
    sample = member.sample_surface(100_000, rng)
    area = _visible_area(member, rng)
    flux = area * (sample.points * sample.normals).sum(1).mean() / 3
    assert flux == pytest.approx(volume, rel=0.04)


def _visible_area(member: Member, rng: np.random.Generator) -> float:
    """Area of the visible skin, canonical, by testing one random place in each surface cell."""
    cells, area = member._cells
    mix = rng.random((2, len(cells)))
    coordinates = SurfaceCoordinates(
        cells[:, 0].astype(np.int32),
        cells[:, 1].astype(np.int32),
        cells[:, 2] + mix[0] * (cells[:, 3] - cells[:, 2]),
        cells[:, 4] + mix[1] * (cells[:, 5] - cells[:, 4]),
    )
    visible = member.locate(coordinates).exists
    return float((np.diff(area, prepend=0.0) * visible).sum() / member.scale**2)


def test_a_tables_top_is_above_its_legs_and_faces_up() -> None:
    table = get_family("table")
    for seed in range(10):
        sample = table.member(seed).sample_surface(1500, np.random.default_rng(0))
        region = table.region_of(sample.coordinates)
        top = region == "top"
        assert np.median(sample.normals[top, 1]) > 0.9
        legs = np.char.startswith(region, "leg")
        if legs.any():
            assert sample.points[top, 1].min() > sample.points[legs, 1].mean()
