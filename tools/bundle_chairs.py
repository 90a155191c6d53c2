"""Make the chairs of `nrdf demo`: members of the parametric family that no training set holds.

    python tools/bundle_chairs.py

Writes src/nrdf/bundled/<name>.npz: points (8192, 3) float32 in metres, without normals, as a
sensor would give them; region (8192,) uint8, the index into `regions` (name 0 is "none").
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from nrdf.shapes.families import get_family

BUNDLED = Path(__file__).resolve().parents[1] / "src" / "nrdf" / "bundled"
CHAIRS = {"reference": 900039, "ladder-back": 900064, "rocker": 900112, "armchair": 900123}
"""Seeds far above those that training sets count up from."""
REGIONS = ("none", "seat", "back-front", "back-back", "legs", "armrests")
GROUPS = {"legs": "leg-", "armrests": "arm-"}
"""The family's regions whose names begin so make one of ours."""
POINTS = 8192
HEIGHT = 0.9
"""Metres that the longest side of a chair is given."""


def main() -> None:
    family = get_family("chair")
    for name, seed in CHAIRS.items():
        surface = family.member(seed).sample_surface(POINTS, np.random.default_rng([seed, 7]))
        named = family.region_of(surface.coordinates)
        region = np.zeros(POINTS, np.uint8)
        for i, wanted in enumerate(REGIONS[1:], 1):
            region[np.char.startswith(named, GROUPS.get(wanted, wanted))] = i
        # Standing on the floor.
        points = HEIGHT * (surface.points - [0.0, surface.points[:, 1].min(), 0.0])
        np.savez_compressed(
            BUNDLED / f"{name}.npz",
            points=points.astype(np.float32),
            region=region,
            regions=np.array(REGIONS),
        )


if __name__ == "__main__":
    main()
