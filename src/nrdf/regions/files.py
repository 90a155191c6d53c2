"""Region files: read as clouds of points on the reference or NumPy arrays, written as clouds."""

from __future__ import annotations

import zipfile
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from nrdf.cloud import PointCloud, read_cloud, write_cloud
from nrdf.errors import RegionError
from nrdf.picture import region_colours
from nrdf.regions.match import Match
from nrdf.regions.region import REGION_NAME
from nrdf.units import METRES


def read_regions(paths: Sequence[Path], unit: str | None = None) -> dict[str, np.ndarray]:
    """Regions by name from files: points (m, 3), masks (n,) or indices (m,).

    `unit`: of the reference's coordinates, to which the points of a file that names another unit
    are brought. Raises RegionError for no file, arrays that cannot be read, names that occur twice
    or cannot be file names, and CloudError for unreadable clouds.
    """
    regions: dict[str, np.ndarray] = {}
    if not paths:
        raise RegionError("no region given; name at least one file after --region")
    for path in paths:
        for name, values in read_region_file(path, unit).items():
            if name in regions:
                raise RegionError(f"two regions are called '{name}'; rename one of the files")
            if not REGION_NAME.fullmatch(name):
                raise RegionError(
                    f"'{name}' in {path} is no name for a region: letters, digits, spaces and "
                    "any of . + - _ are allowed, because it becomes a file name"
                )
            regions[name] = values
    return regions


def read_region_file(path: Path, unit: str | None = None) -> dict[str, np.ndarray]:
    """The regions of one file by name, as `read_regions` gives them: one, or those of an .npz."""
    if path.suffix.lower() in (".npy", ".npz"):
        try:
            with open(path, "rb") as file:
                loaded = np.load(file, allow_pickle=False)
                if isinstance(loaded, np.ndarray):
                    return {path.stem: loaded}
                if "points" not in loaded:
                    return {name: loaded[name] for name in loaded.files}
        except (OSError, ValueError, EOFError, zipfile.BadZipFile) as error:
            raise RegionError(f"cannot read the region file {path}: {error}") from None
    cloud = read_cloud(path)
    if unit is not None and cloud.unit is not None:
        return {path.stem: cloud.points * (METRES[cloud.unit] / METRES[unit])}
    return {path.stem: cloud.points}


def write_matches(folder: Path, target: PointCloud, matches: Mapping[str, Match]) -> None:
    """Write <region>.ply for each match into a folder: the target's points in the region, with
    their confidence and their index in the target."""
    colours = region_colours(list(matches))
    for name, match in matches.items():
        # Paler where less certain.
        strength = 0.25 + 0.75 * match.confidence[:, None]
        mixed = strength * colours[name] + (1 - strength)
        write_cloud(
            folder / f"{name}.ply",
            target.select(match.indices),
            colours=(255 * mixed).astype(np.uint8),
            scalars={"confidence": match.confidence, "index": match.indices},
        )
