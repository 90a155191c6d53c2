"""Teach five regions on one chair, find them on another.

python examples/01_find_regions.py
"""

import nrdf
from nrdf.bundled import bundled_chair

model = nrdf.load_model("chair")
reference, regions = bundled_chair("reference")  # PointCloud, name -> mask (8192,)
target, truth = bundled_chair("ladder-back")  # the same for another chair

encoded = model.set_reference(reference)  # EncodedReference: encoded once, for every target
matches = encoded.retrieve_all(regions, target)  # name -> Match; the target is encoded once

for name, match in matches.items():
    # match.indices (k,): the target's own points; match.confidence (k,) in [0, 1]
    intersection = truth[name][match.indices].sum()  # number of points, of two masks (8192,)
    union = len(match.indices) + truth[name].sum() - intersection
    print(
        f"{name:11s} {len(match.indices):5d} points, confidence {match.score:.2f}, "
        f"IoU with the truth {intersection / union:.2f}"
    )
