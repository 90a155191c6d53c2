"""Chairs that come with the package: what the demo and the examples run on.

Four are members of the parametric family that no training set holds, so their regions are known
exactly. One is the mesh of a real chair (CC-BY-4.0, ATTRIBUTION.txt), to be scanned.
`tools/bundle_chairs.py` made the files.
"""

from __future__ import annotations

import zipfile
from pathlib import Path

import numpy as np

from nrdf.errors import DataError, unknown_name
from nrdf.geometry.mesh import Mesh
from nrdf.io.cloud import PointCloud

REFERENCE = "reference"
TARGETS = ("ladder-back", "rocker", "armchair")
REAL = "stefan"
"""The real chair."""
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


def bundled_mesh() -> Mesh:
    """The real chair in metres: +X forward, +Y up, its feet at y = 0.

    Raises DataError if its file is missing or damaged.
    """
    try:
        with np.load(Path(__file__).parent / f"{REAL}.npz", allow_pickle=False) as arrays:
            return Mesh(arrays["vertices"].astype(np.float64), arrays["faces"].astype(np.int64))
    except (OSError, KeyError, ValueError, zipfile.BadZipFile) as error:
        raise DataError(
            f"the bundled chair '{REAL}' is damaged ({error}); install nrdf again"
        ) from None
