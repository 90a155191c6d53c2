"""Training shapes from the parametric families, with exact occupancy and correspondences."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache, partial
from pathlib import Path

import numpy as np

from nrdf.errors import DataError
from nrdf.shapes.dataset import (
    Correspondence,
    IndexRow,
    Shape,
    add_to_index,
    make_data_folder,
    settings_stamp,
    write_shape,
)
from nrdf.shapes.families import SurfaceCoordinates, get_family
from nrdf.shapes.occupancy import occupancy_queries
from nrdf.tasks import Workers, run_tasks

SURFACE_POINTS = 8192
QUERIES = 16384
CORRESPONDENCES = 4096
VALIDATION_EVERY = 20


def synthesise(
    category: str,
    count: int,
    out: Path,
    seed: int = 0,
    workers: Workers = 1,
    progress: Callable[[int, int], None] | None = None,
) -> int:
    """Write `count` members of a family as training shapes into the folder `out`.

    Member i is made of the seed `seed + i`, so a larger run goes on from a smaller one; members
    that are there already are kept, and so are shapes from elsewhere that the folder's index
    lists. Every 20th is for validation. `progress` is told (done, to do). Returns how many were
    written now. Raises DataError for a count below 1 or an unknown family, OutputError if the
    folder cannot be written.
    """
    if count < 1:
        raise DataError(f"{count} shapes asked for; give at least 1")
    if seed < 0:
        raise DataError(f"a seed must not be negative, this one is {seed}")
    get_family(category)  # an unknown name is an error before anything is made
    make_data_folder(out)
    seeds = range(seed, seed + count)
    stamp = f"family/1 {category} {SURFACE_POINTS} {QUERIES} {CORRESPONDENCES}"
    todo = [s for s in seeds if settings_stamp(out / f"{_name(category, s)}.npz") != stamp]
    make = partial(_write_member, category, out, stamp)
    for done, (_, result) in enumerate(run_tasks(make, todo, workers), 1):
        if isinstance(result, Exception):
            raise result
        if progress is not None:
            progress(done, len(todo))
    splits = ["train" if (s + 1) % VALIDATION_EVERY else "val" for s in seeds]
    add_to_index(
        out,
        [
            IndexRow(_name(category, s), "family", split, "MIT")
            for s, split in zip(seeds, splits, strict=True)
        ],
    )
    return len(todo)


def member_shape(category: str, seed: int, listed: SurfaceCoordinates | None = None) -> Shape:
    """The training shape of one member, with the group `family-<category>` of the places `listed`,
    the family's canonical list unless given."""
    family = get_family(category)
    member = family.member(seed)
    rng = np.random.default_rng([seed, 1])
    surface = member.sample_surface(SURFACE_POINTS, rng)
    places = member.locate(_canonical_coordinates(category) if listed is None else listed)
    queries = occupancy_queries(surface.points, QUERIES, rng)
    return Shape(
        name=_name(category, seed),
        category=category,
        source="family",
        surface_points=surface.points,
        surface_normals=surface.normals,
        query_points=queries,
        query_occupancies=member.occupancy(queries.astype(np.float64)),
        correspondences={
            f"family-{category}": Correspondence(
                np.nan_to_num(places.points),
                np.nan_to_num(places.normals),
                places.exists.astype(np.float32),
            )
        },
    )


@lru_cache
def _canonical_coordinates(category: str) -> SurfaceCoordinates:
    return get_family(category).canonical_coordinates(CORRESPONDENCES, np.random.default_rng(0))


def _name(category: str, seed: int) -> str:
    return f"family-{category}-{seed:06d}"


def _write_member(category: str, out: Path, stamp: str, seed: int) -> None:
    write_shape(out / f"{_name(category, seed)}.npz", member_shape(category, seed), stamp)
