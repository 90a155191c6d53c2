"""The same places on chairs of different build, exactly: what the parametric families know.

python examples/02_exact_correspondence.py
"""

import numpy as np

from nrdf.shapes.families import get_family

family = get_family("chair")
first, second = family.member(1), family.member(2)

sample = first.sample_surface(2000, np.random.default_rng(0))  # points, normals (2000, 3)
there = second.locate(sample.coordinates)  # points (2000, 3), exists (2000,)

regions = family.region_of(sample.coordinates)  # (2000,) names
for name in family.region_names:
    here = regions == name
    if here.any():
        moved = np.linalg.norm(there.points - sample.points, axis=1)[here & there.exists]
        distance = f"{moved.mean():.3f} away" if len(moved) else "-"
        print(f"{name:16s} {there.exists[here].mean():4.0%} exist on the second chair, {distance}")
