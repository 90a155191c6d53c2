"""Teach five regions on one chair, find them on another.

python examples/01_find_regions.py
"""

import nrdf
from nrdf.bundled import bundled_chair

model = nrdf.load_model("chair")
reference, regions = bundled_chair("reference")  # PointCloud, name -> mask (8192,)
target, truth = bundled_chair("ladder-back")

encoded = model.set_reference(reference)  # encodes the reference once
matches = encoded.retrieve_all(regions, target)  # encodes the target once for all regions

for name, match in matches.items():
    # match.indices (k,): the target's own points; match.confidence (k,) in [0, 1]
    common = truth[name][match.indices].sum()
    union = len(match.indices) + truth[name].sum() - common
    print(
        f"{name:11s} {len(match.indices):5d} points, confidence {match.score:.2f}, "
        f"IoU with the truth {common / union:.2f}"
    )
