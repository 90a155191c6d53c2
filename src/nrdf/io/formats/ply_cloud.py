"""Clouds and meshes in PLY files, with the unit, frame and sensors that their comments name."""

from __future__ import annotations

import logging
from pathlib import Path

import numpy as np

from nrdf.errors import CloudError
from nrdf.geometry.units import METRES, parse_unit
from nrdf.io import ply
from nrdf.io.formats import meshes
from nrdf.io.formats.raw import USED_COLUMNS, RawCloud, colours_of, intensity_of, stack

logger = logging.getLogger(__name__)


def read_ply(path: Path, mesh_samples: int) -> RawCloud:
    header = ply.read_header(path)
    if header.count("face") and mesh_samples:
        cloud = meshes.read_mesh(path, mesh_samples)
    else:
        columns = ply.read_scalars(path, header, wanted=USED_COLUMNS)
        points = stack(columns, "xyz")
        if points is None:
            has = [p.name for e in header.elements if e.name == "vertex" for p in e.properties]
            raise CloudError(
                f"{path}: its vertices have the properties {', '.join(has) or '(none)'}; "
                "x, y and z are needed as plain numbers"
            )
        cloud = RawCloud(points, stack(columns, ("nx", "ny", "nz")))
        cloud.colours, cloud.intensity = colours_of(columns), intensity_of(columns)
    for comment in header.comments:
        word, _, rest = comment.partition(" ")
        if word == "unit" and len(rest.split()) == 1:
            cloud.unit = parse_unit(rest)
            if cloud.unit is None:
                known = ", ".join(METRES)
                logger.warning("%s: its unit '%s' is not known (%s)", path, rest.strip(), known)
        elif word == "frame" and rest:
            cloud.frame = rest
        elif word == "sensor":
            cloud.sensors = np.vstack([cloud.sensors, _place(path, rest)])
    return cloud


def _place(path: Path, words: str) -> np.ndarray:
    try:
        place = np.array([float(word) for word in words.split()])
    except ValueError:
        place = np.empty(0)
    if place.shape != (3,) or not np.isfinite(place).all():
        raise CloudError(f"{path}: comment 'sensor {words[:60]}': three numbers are needed")
    return place
