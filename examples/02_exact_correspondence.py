"""Exact corresponding points of two chairs of the parametric family, region by region.

python examples/02_exact_correspondence.py
"""

import numpy as np

from nrdf.shapes.families import get_family

family = get_family("chair")
first, second = family.member(1), family.member(2)

sample = first.sample_surface(2000, np.random.default_rng(0))  # points, normals (2000, 3)
found = second.locate(sample.coordinates)  # points (2000, 3), exists (2000,)

regions = family.region_of(sample.coordinates)  # (2000,) names
for name in family.region_names:
    inside = regions == name  # (2000,)
    if inside.any():
        offsets = found.points - sample.points  # (2000, 3)
        distances = np.linalg.norm(offsets, axis=1)[inside & found.exists]  # (k,)
        distance = f"{distances.mean():.3f} away" if len(distances) else "-"
        share = found.exists[inside].mean()
        print(f"{name:16s} {share:4.0%} exist on the second chair, {distance}")
