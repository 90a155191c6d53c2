"""What every reader gives: the content of a file, its values not yet checked."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from nrdf.geometry.mesh import Mesh

MAX_UNPACKED_BYTES = 800_000_000
"""Bytes that a compressed file may unpack to; a small file can claim any number."""
_INTENSITY = ("intensity", "scalar_Intensity", "scalar_intensity", "reflectance", "i")
USED_COLUMNS = {
    *("x", "y", "z", "nx", "ny", "nz", "normal_x", "normal_y", "normal_z"),
    *("red", "green", "blue", "rgb", "rgba", *_INTENSITY),
}
"""Names of the columns that a cloud uses; others are not read."""


@dataclass
class RawCloud:
    """What a file holds, unchecked.

    points: (n, 3); normals: (n, 3) or None; unit, frame: None where the file does not say;
    colours: (n, 3) uint8 or None; intensity: (n,) or None; sensors: (s, 3) where the sensors stood,
    in the points' frame and unit, none if unknown; mesh: what the points were sampled from, None
    where the file holds points; gaps: whether a point that is not finite means
    "nothing was measured here", as in the grids of depth cameras.
    """

    points: np.ndarray
    normals: np.ndarray | None = None
    unit: str | None = None
    frame: str | None = None
    colours: np.ndarray | None = None
    intensity: np.ndarray | None = None
    sensors: np.ndarray = field(default_factory=lambda: np.empty((0, 3)))
    mesh: Mesh | None = None
    gaps: bool = False


def stack(columns: Mapping[str, np.ndarray], names: str | Sequence[str]) -> np.ndarray | None:
    """(n, 3) float64 of three columns, or None if one of them is missing."""
    if any(name not in columns for name in names):
        return None
    whole = np.empty((len(columns[names[0]]), 3))
    for axis, name in enumerate(names):
        whole[:, axis] = columns[name]
    return whole


def colours_of(columns: Mapping[str, np.ndarray]) -> np.ndarray | None:
    """(n, 3) uint8 from red, green and blue (0 to 255, or floats of 0 to 1), or from the rgb that
    the Point Cloud Library packs into one number (0xRRGGBB in the bits of a float); None without.
    """
    whole = stack(columns, ("red", "green", "blue"))
    if whole is not None:
        floats = columns["red"].dtype.kind == "f" and len(whole) > 0
        if floats and np.nan_to_num(whole).max(initial=0.0) <= 1.0:
            whole = 255.0 * whole
        return np.clip(np.nan_to_num(whole), 0, 255).astype(np.uint8)
    packed = columns.get("rgb", columns.get("rgba"))
    if packed is None:
        return None
    bits = np.ascontiguousarray(packed)
    if bits.dtype.kind == "f":
        bits = bits.astype(np.float32).view(np.uint32)
    bits = bits.astype(np.uint32)
    return np.stack([bits >> shift & 255 for shift in (16, 8, 0)], axis=1).astype(np.uint8)


def intensity_of(columns: Mapping[str, np.ndarray]) -> np.ndarray | None:
    """(n,) float32 of whatever a file calls its points' intensity, or None."""
    for name in _INTENSITY:
        if name in columns:
            return columns[name].astype(np.float32)
    return None
