"""Region files: read as clouds of points on the reference or NumPy arrays, written as clouds."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from nrdf.errors import RegionError
from nrdf.geometry.units import METRES
from nrdf.io.cloud import PointCloud, read_cloud, write_cloud
from nrdf.io.file_names import clashing_names
from nrdf.io.files import open_file
from nrdf.io.formats.arrays import array_head, open_arrays
from nrdf.regions.match import Match
from nrdf.regions.region import region_name_fault
from nrdf.viz.palette import region_colours


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
            if fault := region_name_fault(name):
                raise RegionError(f"'{name}' in {path} is no name for a region: {fault}")
            regions[name] = values
    if twins := clashing_names(regions):
        raise RegionError(
            f"the regions '{twins[0]}' and '{twins[1]}' would be one file on Windows and macOS; "
            "rename one of the files"
        )
    return regions


def read_region_file(path: Path, unit: str | None = None) -> dict[str, np.ndarray]:
    """The regions of one file by name, as `read_regions` gives them: one, or those of an .npz."""
    ending = path.suffix.lower()
    if ending == ".npy":
        return {path.stem: _read_array(path)}
    if ending == ".npz":
        with open_arrays(path, RegionError) as arrays:
            if "points" not in arrays.names:
                for name in arrays.names:
                    _check(name, *arrays.head(name))
                return {name: arrays.load(name) for name in arrays.names}
    cloud = read_cloud(path)
    if unit is not None and cloud.unit is not None:
        return {path.stem: cloud.points * (METRES[cloud.unit] / METRES[unit])}
    return {path.stem: cloud.points}


def _read_array(path: Path) -> np.ndarray:
    with open_file(path, RegionError) as file:
        try:
            _check(path.stem, *array_head(file, os.fstat(file.fileno()).st_size))
            file.seek(0)
            return np.lib.format.read_array(file, allow_pickle=False)
        except ValueError as error:
            raise RegionError(f"cannot read the region file {path}: {error}") from None


def _check(name: str, shape: tuple[int, ...], kind: np.dtype) -> None:
    """Raise ValueError for what is no mask, no indices and no points."""
    if kind.kind not in "biuf" or not (len(shape) == 1 or (len(shape) == 2 and shape[1] == 3)):
        raise ValueError(
            f"'{name}' is {shape} of {kind}; a region is a mask (n,), indices (m,) or points (m, 3)"
        )


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
