"""The classes that users need: teach a reference once, find its regions on every new object.

A `Model` embeds clouds; a `Taught` is one reference with its descriptors, and retrieves regions.
"""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
import torch
from scipy.spatial import cKDTree

from nrdf.cloud import PointCloud, check_cloud
from nrdf.errors import RegionError, unknown_name
from nrdf.field.base import Field
from nrdf.geometry import canonical_transform, estimate_normals, thin
from nrdf.regions.association import (
    NORMAL_WEIGHT,
    VOTERS,
    oriented_features,
    snap,
    voters,
)
from nrdf.regions.match import Mapped, Match, mapped_points
from nrdf.regions.presence import find_presence
from nrdf.regions.region import region_indices
from nrdf.similarity import LEFT_FOR_RIGHT, Similarity

METHODS = ("mask", "points")
WORKING_POINTS = 16384
"""A denser cloud is thinned to this many points; results are carried back to all of its points."""
MINIMUM_POINTS = 256
FARTHEST = 0.1
"""A target point farther than this from all mapped reference points, in position and weighted
normal, canonical, has no counterpart on the reference and belongs to no region."""
_CHUNK = 8192  # points described or inverted at a time
# Chosen on unseen family chairs, so that confidence is about the share of points that are right.
_DISTANCE_SCALE = 0.4  # canonical distance to the mapped point at which trust has fallen to 1/e


@dataclass(frozen=True)
class Embedded:
    """A cloud as the field sees it: thinned, with normals, canonical, with its embedding z.

    cloud: what the user gave. working: (n,) indices of its points in use. points, normals: (n, 3)
    canonical. pose: from canonical coordinates to the cloud's. z: (1, d_z). seconds: time of each
    phase.
    """

    cloud: PointCloud
    working: np.ndarray
    points: np.ndarray
    normals: np.ndarray
    pose: Similarity
    z: torch.Tensor
    seconds: dict[str, float] = field(default_factory=dict)

    def original(self, points_canonical: np.ndarray) -> np.ndarray:
        """Canonical points (m, 3) in the cloud's own frame and unit."""
        return self.pose.to_scan(np.asarray(points_canonical, np.float64))

    def canonical(self, points: np.ndarray) -> np.ndarray:
        """Points (m, 3) of the cloud's own frame and unit in canonical coordinates."""
        return self.pose.to_canonical(points)

    def to_all(self, selected: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Selected working points as indices of the whole cloud, and which working point each
        follows (its nearest): (k,) indices into `cloud.points`, (k,) positions in `working`.
        """
        index = np.flatnonzero(selected[self.nearest_working])
        return index, self.nearest_working[index]

    @property
    def is_whole(self) -> bool:
        """Whether every point of the cloud is in use."""
        return len(self.working) == len(self.cloud.points)

    @cached_property
    def nearest_working(self) -> np.ndarray:
        """The position in `working` of the point nearest to each point of the cloud."""
        if self.is_whole:
            return self.working
        return cKDTree(self.points).query(self.canonical(self.cloud.points))[1]

    def distance(self, mapped: Mapped) -> np.ndarray:
        """Distance (m,) of mapped points from the working points, in position and normal."""
        features = oriented_features(mapped.points, mapped.normals, NORMAL_WEIGHT)
        return self._oriented_tree.query(features)[0]

    @cached_property
    def _oriented_tree(self) -> cKDTree:
        return cKDTree(oriented_features(self.points, self.normals, NORMAL_WEIGHT))

    @cached_property
    def tree(self) -> cKDTree:
        """The cloud's own points, for regions that are given as points."""
        return cKDTree(self.cloud.points)


class Model:
    """A trained field of one category, ready to be taught references.

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

    def __repr__(self) -> str:
        return f"Model(category={self.category!r}, preset={self.preset!r}, device={self.device})"

    def embed(
        self, cloud: PointCloud, pose: Similarity | None = None, mirrored: bool = False
    ) -> Embedded:
        """Thin, orient, normalise and embed a cloud in the category's canonical frame.

        Any unit, centre and scale will do. Normals are used as they are, or estimated where there
        are none. Without `pose` (from canonical coordinates to the cloud's) the cloud is in the
        canonical orientation and its bounding box gives the rest. With `mirrored` the field sees
        the cloud's mirror image beside it, left for right: an object that was seen in part from one
        side is embedded more like a whole one. Raises CloudError for a cloud that is empty, flat,
        or has too few points.
        """
        check_cloud(cloud, MINIMUM_POINTS)
        seconds: dict[str, float] = {}
        start = time.perf_counter()
        if pose is None:
            pose = Similarity(np.eye(3), *canonical_transform(cloud.points))
        working = thin(cloud.points, WORKING_POINTS, np.random.default_rng(0))
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
            seen = np.concatenate([points, points * LEFT_FOR_RIGHT])
            lines = np.concatenate([normals, normals * LEFT_FOR_RIGHT])
        chosen = encoder_subset(seen, self.field.config.encoder_points)
        with torch.inference_mode():
            z = self.field.embed(self.tensor(seen[chosen])[None], self.tensor(lines[chosen])[None])
        seconds["embed"] = time.perf_counter() - start
        return Embedded(cloud, working, points, normals, pose, z, seconds)

    def set_reference(self, reference: PointCloud, pose: Similarity | None = None) -> Taught:
        """Embed a reference and describe its surface once, for any number of targets.

        `pose` and errors as for `embed`.
        """
        return Taught(self, self.embed(reference, pose))

    def tensor(self, values: np.ndarray) -> torch.Tensor:
        """Values of any shape on the model's device, in single precision."""
        return torch.as_tensor(values, dtype=torch.float32, device=self.device)


class Taught:
    """A reference whose descriptors are known (paper, eq. 8)."""

    def __init__(self, model: Model, reference: Embedded) -> None:
        self.model = model
        self.reference = reference
        self._k = self._describe(reference.points, reference.normals)

    def retrieve(self, region: Any, target: PointCloud | Embedded, method: str = "mask") -> Match:
        """Find one region on a target: `retrieve_all` for a single region."""
        return self.retrieve_all({"region": region}, target, method)["region"]

    def retrieve_all(
        self, regions: Mapping[str, Any], target: PointCloud | Embedded, method: str = "mask"
    ) -> dict[str, Match]:
        """Find regions on a target, which is embedded and mapped once for all of them.

        regions: name to boolean mask (n,), indices (m,) or points (m, 3) on the reference.
        method: "mask" maps the whole reference and lets each target point ask the mapped
        reference points nearest in position and normal; "points" snaps C's prediction of each
        region point to the target (paper, eq. 9). A region of fewer than half of `VOTERS` points
        gets no majority anywhere: use "points" for spots.

        Raises RegionError for a region that is empty or not on the reference (the message names
        it) or an unknown method, and CloudError for a target as `Model.embed` does.
        """
        if method not in METHODS:
            raise RegionError(unknown_name("method", method, METHODS))
        reference, chosen = self.reference, {}
        for name, region in regions.items():
            try:
                chosen[name] = region_indices(region, reference.cloud, lambda: reference.tree)
            except RegionError as error:
                raise RegionError(f"region '{name}': {error}") from None
        embedded = target if isinstance(target, Embedded) else self.model.embed(target)
        start = time.perf_counter()
        mapped = self.map_surface(embedded)
        embedded.seconds["map"] = time.perf_counter() - start
        start = time.perf_counter()
        if method == "mask":
            matches = self._by_mask(chosen, mapped, embedded)
        else:
            matches = {name: self._by_points(i, mapped, embedded) for name, i in chosen.items()}
        usual = float(np.median(mapped.error))
        for name, indices in chosen.items():
            region = mapped.select(self._working_mask(indices))
            presence = find_presence(region.exists, region.error, usual, embedded.distance(region))
            matches[name] = matches[name].with_presence(presence)
        embedded.seconds["associate"] = time.perf_counter() - start
        return matches

    def map_surface(self, target: Embedded) -> Mapped:
        """Where the reference's working points arrive on a target: C(z_t, k_r)."""
        return self._invert(target, self._k, self.reference.normals)

    def map_points(self, indices: np.ndarray, target: Embedded) -> Mapped:
        """Where reference points given by their indices (m,) in the cloud arrive on a target."""
        reference = self.reference
        if reference.is_whole:
            return self._invert(target, self._k[:, indices], reference.normals[indices])
        points = reference.canonical(reference.cloud.points[indices])
        given = reference.cloud.normals
        normals = (
            given[indices] @ reference.pose.rotation
            if given is not None
            else reference.normals[reference.nearest_working[indices]]
        )
        return self._invert(target, self._describe(points, normals), normals)

    def _by_mask(
        self, chosen: dict[str, np.ndarray], mapped: Mapped, target: Embedded
    ) -> dict[str, Match]:
        asked, distance = voters(
            mapped.points, mapped.normals, target.points, target.normals, NORMAL_WEIGHT, VOTERS
        )
        trust = mapped.trust[asked] * np.exp(-distance / _DISTANCE_SCALE)
        near = distance[:, 0] < FARTHEST
        matches = {}
        for name, indices in chosen.items():
            member = self._working_mask(indices)[asked]
            votes = member.mean(axis=1)
            confidence = (member * trust).sum(axis=1) / np.maximum(member.sum(axis=1), 1)
            index, follows = target.to_all((votes > 0.5) & near)
            whole = self.reference.is_whole
            arrived = mapped.points[indices] if whole else self.map_points(indices, target).points
            matches[name] = Match(
                indices=index,
                points=target.original(arrived),
                confidence=np.clip(votes * confidence, 0.0, 1.0)[follows],
                method="mask",
            )
        return matches

    def _by_points(self, indices: np.ndarray, mapped: Mapped, target: Embedded) -> Match:
        whole = self.reference.is_whole
        mapped = mapped.select(indices) if whole else self.map_points(indices, target)
        nearest, distance = snap(mapped.points, mapped.normals, target.points, target.normals)
        found, first = np.unique(nearest, return_index=True)
        trust = mapped.trust * np.exp(-distance / _DISTANCE_SCALE)
        return Match(
            indices=target.working[found],
            points=target.original(mapped.points),
            confidence=np.clip(trust[first], 0.0, 1.0),
            method="points",
        )

    def _working_mask(self, indices: np.ndarray) -> np.ndarray:
        """Which working points of the reference a region holds, (n,) bool."""
        reference = self.reference
        inside = np.zeros(len(reference.cloud.points), bool)
        inside[indices] = True
        mask = inside[reference.working]
        if mask.any():
            return mask
        # The region fell between the points that were kept: its nearest ones stand for it.
        mask[reference.nearest_working[indices]] = True
        return mask

    def _describe(self, points: np.ndarray, normals: np.ndarray) -> torch.Tensor:
        model = self.model
        parts = []
        with torch.inference_mode():
            for start in range(0, len(points), _CHUNK):
                part = slice(start, start + _CHUNK)
                parts.append(
                    model.field.describe(
                        self.reference.z,
                        model.tensor(points[part])[None],
                        model.tensor(normals[part])[None],
                    )
                )
        return torch.cat(parts, dim=1)

    def _invert(self, target: Embedded, k: torch.Tensor, normals: np.ndarray) -> Mapped:
        parts = []
        with torch.inference_mode():
            for start in range(0, k.shape[1], _CHUNK):
                inverse = self.model.field.invert(target.z, k[:, start : start + _CHUNK])
                parts.append(mapped_points(inverse, normals[start : start + _CHUNK]))
        return Mapped(*map(np.concatenate, zip(*parts, strict=True)))


def encoder_subset(points: np.ndarray, count: int) -> np.ndarray:
    """Indices of the points that the encoder sees: an even subset of `count`, which always holds
    the extreme points of each axis, so that the embedding knows the bounding box exactly."""
    chosen = thin(points, count, np.random.default_rng(0))
    extremes = np.concatenate([points.argmin(axis=0), points.argmax(axis=0)])
    return np.union1d(chosen, extremes)
