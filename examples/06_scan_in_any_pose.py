"""A scan in any pose: simulated, cleaned, aligned, and regions found on it.

python examples/06_scan_in_any_pose.py
"""

import numpy as np

import nrdf
from nrdf.bundled import bundled_chair
from nrdf.geometry.canonical import rotation_about_up
from nrdf.geometry.similarity import Similarity, up_axis, upright
from nrdf.scans.simulate import ScanSettings, simulate_scan
from nrdf.shapes.families import get_family
from nrdf.shapes.families.tessellation import tessellate

# Three depth cameras around a chair of 0.9 m that stands on a floor, z up, turned by 2 rad.
mesh = tessellate(get_family("chair").member(1_000_003))  # vertices (v, 3), faces (f, 3)
pose = Similarity(upright(up_axis("z")) @ rotation_about_up(2.0), np.array([4.0, -1.0, 0.4]), 0.9)
settings = ScanSettings(views=3, noise=0.001, floor=True)
rng = np.random.default_rng(0)
scan = simulate_scan(mesh.vertices, mesh.faces, settings, rng, pose)  # scan.cloud: points (n, 3)

model = nrdf.load_model("chair")
aligned = nrdf.align(model, scan.cloud, up="z")
for step in aligned.cleaned.steps:
    print(f"{step.name:10s} {step.removed:6d} points removed: {step.note}")
print("T_scan_canonical\n", aligned.pose.T_scan_canonical.round(3))  # (4, 4)
print(f"longest side {aligned.pose.scale:.3f} {aligned.unit.name} ({aligned.unit.origin})")
print("\n".join(aligned.warnings) or "no warnings")

reference, regions = bundled_chair("reference")  # PointCloud, name -> mask (8192,)
matches = model.set_reference(reference).retrieve_all(regions, aligned.encode())
for name, match in matches.items():
    match = match.in_scan(aligned)  # match.indices (k,) of the scan's own points
    print(f"{name:11s} {match.presence.reason or len(match.indices)}")
