"""Make the chairs of `nrdf demo`: members of the parametric family that no training set holds.

    python tools/bundle_chairs.py [objects/]

With a folder of labelled objects (docs/evidence/objects.md) that has it, also the mesh of the real
chair.

Writes src/nrdf/bundled/<name>.npz: points (8192, 3) float32 in metres, without normals, as a
sensor would give them; region (8192,) uint8, the index into `regions` (name 0 is "none"). And the
regions of the reference, which the demo's process knowledge names: a mask (8192,) for each; and
its checksum into that knowledge, chair.yaml.
"""

from __future__ import annotations

import re
import sys
from pathlib import Path

import numpy as np

from nrdf.bundled import KNOWLEDGE, REAL, REFERENCE, REGIONS_FILE, bundled_chair
from nrdf.process.bound_knowledge import checksum
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
            inside = (
                np.char.startswith(named, GROUPS[wanted]) if wanted in GROUPS else named == wanted
            )
            region[inside] = i
        # Standing on the floor.
        points = HEIGHT * (surface.points - [0.0, surface.points[:, 1].min(), 0.0])
        np.savez_compressed(
            BUNDLED / f"{name}.npz",
            points=points.astype(np.float32),
            region=region,
            regions=np.array(REGIONS),
        )
    _, masks = bundled_chair(REFERENCE)
    np.savez_compressed(BUNDLED / REGIONS_FILE, **masks)
    line = f"sha256: {checksum(BUNDLED / f'{REFERENCE}.npz')}"
    KNOWLEDGE.write_text(re.sub("sha256: .*", line, KNOWLEDGE.read_text()))
    for folder in sys.argv[1:]:
        bundle_mesh(Path(folder))


def bundle_mesh(folder: Path) -> None:
    """The real chair, standing on the floor, in metres: its longest side is its height."""
    with np.load(folder / "chair" / f"{REAL}.npz", allow_pickle=False) as arrays:
        vertices, faces = arrays["vertices"], arrays["faces"]
    vertices = HEIGHT * (vertices - [0.0, vertices[:, 1].min(), 0.0])
    np.savez_compressed(
        BUNDLED / f"{REAL}.npz", vertices=vertices.astype(np.float32), faces=faces.astype(np.int32)
    )


if __name__ == "__main__":
    main()
