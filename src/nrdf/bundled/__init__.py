"""Chairs that come with the package: what the demo and the examples run on.

They are members of the parametric family that no training set holds (`tools/bundle_chairs.py`
made them), so their regions are known exactly.
"""

from __future__ import annotations

import zipfile
from pathlib import Path

import numpy as np

from nrdf.cloud import PointCloud
from nrdf.errors import DataError, unknown_name

REFERENCE = "reference"
TARGETS = ("ladder-back", "rocker", "armchair")
KNOWLEDGE = Path(__file__).parent / "chair.yaml"
"""What is done to the reference's five regions: a knowledge file."""
REGIONS_FILE = "reference-regions.npz"


def bundled_chair(name: str) -> tuple[PointCloud, dict[str, np.ndarray]]:
    """A chair, 8192 points in metres without normals, and its five regions as masks (8192,).

    Raises DataError for a name that is not known, or a file that is missing or damaged.
    """
    if name not in (REFERENCE, *TARGETS):
        raise DataError(unknown_name("bundled chair", name, (REFERENCE, *TARGETS)))
    try:
        with np.load(Path(__file__).parent / f"{name}.npz", allow_pickle=False) as arrays:
            cloud = PointCloud(arrays["points"], unit="m")
            names, region = arrays["regions"].tolist(), arrays["region"]
    except (OSError, KeyError, ValueError, zipfile.BadZipFile) as error:
        raise DataError(
            f"the bundled chair '{name}' is damaged ({error}); install nrdf again"
        ) from None
    return cloud, {region_name: region == i for i, region_name in enumerate(names) if i}
