"""What a sensor would give of a labelled mesh, with the true label of each point: the outer skin
as a whole, or simulated scans in any pose. Always the same of the same object."""

from __future__ import annotations

import zlib
from dataclasses import dataclass

import numpy as np

from nrdf.geometry.mesh import outer_skin
from nrdf.geometry.normals import estimate_normals
from nrdf.geometry.similarity import Similarity
from nrdf.io.cloud import PointCloud
from nrdf.scans.simulate import ScanSettings, simulate_scan
from nrdf_benchmark.objects.dataset import LabelledMesh
from nrdf_benchmark.scans import NOISE, random_pose

POINTS = 8192
FLOOR = ""
"""The label of points that are not of the object."""


@dataclass(frozen=True)
class LabelledCloud:
    """Points of an object, and the label (n,) of each. pose: from canonical coordinates to the
    cloud's."""

    cloud: PointCloud
    label: np.ndarray
    pose: Similarity

    def share(self, name: str) -> float:
        """Share of the object's points that carry a label."""
        return float((self.label == name).sum() / max((self.label != FLOOR).sum(), 1))


def sample_object(
    mesh: LabelledMesh, points: int = POINTS, normals: str = "estimated"
) -> LabelledCloud:
    """Points of the outer skin, in the mesh's own frame.

    normals: "estimated" from the points, as those of a scan are; "given", the mesh's own. Raises
    DataError where too little of the mesh can be seen.
    """
    rng = np.random.default_rng(zlib.crc32(mesh.key.encode()))
    skin = outer_skin(mesh.vertices, mesh.faces, points, rng)[1]
    own = skin.normals if normals == "given" else estimate_normals(skin.points)
    pose = Similarity(np.eye(3), np.zeros(3), 1.0)
    return LabelledCloud(PointCloud(skin.points, own), mesh.label[skin.face], pose)


def scan_object(mesh: LabelledMesh, views: int) -> LabelledCloud:
    """A simulated scan from that many views (`nrdf.scans.simulate`), on a floor, noise of 1 mm on
    an object of 0.9 m, at any yaw, scale and offset; +Z is up. It has sensors and no normals."""
    rng = np.random.default_rng([zlib.crc32(mesh.key.encode()), views])
    pose = random_pose(rng)
    settings = ScanSettings(views=views, noise=NOISE, quantisation=NOISE / 2, floor=True)
    scan = simulate_scan(mesh.vertices, mesh.faces, settings, rng, pose)
    label = np.where(scan.face < 0, FLOOR, mesh.label[np.maximum(scan.face, 0)])
    return LabelledCloud(scan.cloud, label, pose)
