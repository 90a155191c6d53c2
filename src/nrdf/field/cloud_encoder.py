"""A trained field that encodes point clouds of any unit, centre and density."""

from __future__ import annotations

import time
from collections.abc import Mapping
from functools import cached_property
from typing import Any

import numpy as np
import torch

from nrdf.errors import CloudError
from nrdf.field.base import Field
from nrdf.field.encoded_cloud import EncodedCloud, encoder_subset
from nrdf.field.kind_network import KindNetwork, find_kind_network
from nrdf.geometry.canonical import MIRROR, canonical_transform
from nrdf.geometry.normals import estimate_normals
from nrdf.geometry.sampling import distinct_points, downsample
from nrdf.geometry.similarity import Similarity
from nrdf.io.cloud import check_cloud
from nrdf.io.inputs import as_cloud

WORKING_POINTS = 16384
"""A denser cloud is thinned to this many points; results are brought back to all of its points."""
MINIMUM_POINTS = 256
"""A cloud of fewer points is refused."""


class CloudEncoder:
    """A trained field of one category that encodes clouds.

    field: the network; metadata: what its weight file says of itself (category, preset, ...).
    """

    def __init__(
        self, field: Field, metadata: Mapping[str, Any], device: torch.device | str = "cpu"
    ) -> None:
        self.device = torch.device(device)
        self.field = field.to(self.device).eval()
        self.metadata = dict(metadata)

    @property
    def category(self) -> str:
        """What the model was trained on, such as "chair"; "" if its file does not say."""
        return str(self.metadata.get("category", ""))

    @property
    def preset(self) -> str:
        """Name of the network's preset, such as "default"."""
        return self.field.preset

    @cached_property
    def kind_network(self) -> KindNetwork | None:
        """What tells objects of the category from others, and how they are turned; None without
        one in the zoo."""
        return find_kind_network(self.category)

    def __repr__(self) -> str:
        name, device = type(self).__name__, self.device
        return f"{name}(category={self.category!r}, preset={self.preset!r}, {device=!s})"

    def encode(
        self, cloud: Any, pose: Similarity | None = None, mirrored: bool = False
    ) -> EncodedCloud:
        """Thin, orient, normalise and encode a cloud in the category's canonical frame.

        cloud: what `nrdf.as_cloud` takes: a PointCloud, a path, an array (n, 3), a mesh.
        Any unit, centre and scale will do. Normals are used as they are, or estimated where there
        are none. Without `pose` (from canonical coordinates to the cloud's) the cloud is in the
        canonical orientation and its bounding box gives the rest. With `mirrored` the field sees
        the cloud's mirror image beside it, left for right: an object that was seen in part from one
        side is encoded more like a whole one. Raises CloudError for a cloud that is empty, flat,
        or has too few points.
        """
        cloud = as_cloud(cloud)
        check_cloud(cloud, MINIMUM_POINTS)
        seconds: dict[str, float] = {}
        start = time.perf_counter()
        if pose is None:
            pose = Similarity(np.eye(3), *canonical_transform(cloud.points))
        working = downsample(cloud.points, WORKING_POINTS, np.random.default_rng(0))
        sides = None if cloud.normals is None else cloud.normals[working]
        working = working[distinct_points(cloud.points[working], sides)]
        if len(working) < MINIMUM_POINTS:
            raise CloudError(
                f"the cloud has {len(cloud)} points, but only {len(working)} in different places; "
                f"at least {MINIMUM_POINTS} are needed: scan or sample it more densely"
            )
        points = pose.to_canonical(cloud.points[working])
        seconds["normalise"] = time.perf_counter() - start
        start = time.perf_counter()
        if cloud.normals is None:
            sensors = None if cloud.sensors is None else pose.to_canonical(cloud.sensors)
            normals = estimate_normals(points, sensors=sensors)
        else:
            normals = cloud.normals[working] @ pose.rotation
        seconds["normals"] = time.perf_counter() - start
        start = time.perf_counter()
        seen, lines = points, normals
        if mirrored:
            seen = np.concatenate([points, points * MIRROR])
            lines = np.concatenate([normals, normals * MIRROR])
        chosen = encoder_subset(seen, self.field.config.encoder_points)
        with torch.inference_mode():
            z = self.field.embed(self.tensor(seen[chosen])[None], self.tensor(lines[chosen])[None])
        seconds["embed"] = time.perf_counter() - start
        return EncodedCloud(cloud, working, points, normals, pose, z, seconds)

    def tensor(self, values: np.ndarray) -> torch.Tensor:
        """Values of any shape on the model's device, in single precision."""
        return torch.as_tensor(values, dtype=torch.float32, device=self.device)
