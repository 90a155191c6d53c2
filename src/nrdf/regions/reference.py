"""A reference whose descriptors are known: its regions are found on every new object."""

from __future__ import annotations

import logging
import time
from collections.abc import Mapping
from dataclasses import replace
from functools import cached_property
from typing import Any

import numpy as np
import torch

from nrdf.errors import RegionError, unknown_name
from nrdf.field.cloud_encoder import CloudEncoder
from nrdf.field.encoded_cloud import NORMAL_WEIGHT, EncodedCloud, oriented_features
from nrdf.io.inputs import as_cloud
from nrdf.regions.association import VOTING_NEIGHBOURS, nearest_voters, snap
from nrdf.regions.match import TRUST_SCALE, MappedPoints, Match, mapped_points
from nrdf.regions.patches import explained_by, find_patches
from nrdf.regions.presence import evidence_of, find_presence
from nrdf.regions.refine import Refiner
from nrdf.regions.region import region_indices
from nrdf.scans.kind_check import KindCheck, check_kind
from nrdf.scans.pose_scorer import PoseScorer

log = logging.getLogger(__name__)

METHODS = ("mask", "points")
_CHUNK = 8192  # points described or inverted at a time
_RETURNED = 2048  # of a target's points that are led back to the reference


class EncodedReference:
    """A reference whose descriptors are known (paper, eq. 8)."""

    def __init__(self, model: CloudEncoder, reference: EncodedCloud) -> None:
        self.model = model
        self.reference = reference
        self._k = self._describe(reference.points, reference.normals)

    def check_kind(self, target: EncodedCloud) -> KindCheck:
        """Whether a target looks like an object of the category, upright and facing forward in the
        pose that it is encoded in; without a network that tells, like the reference."""
        return check_kind(self.model, target, lambda: self._scorer)

    @cached_property
    def _scorer(self) -> PoseScorer:
        return PoseScorer(self.model, [self.reference.cloud])

    @cached_property
    def _refiner(self) -> Refiner:
        return Refiner(self.reference.points, self.reference.normals)

    def retrieve(
        self,
        region: Any,
        target: Any,
        method: str = "mask",
        refine: bool = False,
    ) -> Match:
        """Find one region on a target: `retrieve_all` for a single region."""
        return self.retrieve_all({"region": region}, target, method, refine)["region"]

    def retrieve_all(
        self,
        regions: Mapping[str, Any],
        target: Any,
        method: str = "mask",
        refine: bool = False,
        drop_absent: bool = True,
        check: bool = True,
    ) -> dict[str, Match]:
        """Find regions on a target, which is encoded and mapped once for all of them.

        regions: name to boolean mask (n,), indices (m,) or points (m, 3) on the reference.
        target: what `nrdf.as_cloud` takes (a path, an array (n, 3), a mesh, …), or encoded.
        Matches index its points; `nrdf.as_cloud` gives those that a mesh is sampled to.
        method: "mask" maps the whole reference and lets each target point ask the mapped
        reference points nearest in position and normal; parts of the target that are far from all
        of them, by the error that the field expects, join a region only where they grow out of it
        (`nrdf.regions.patches`). "points" snaps C's prediction of each
        region point to the target (paper, eq. 9). A region of fewer than half of
        `VOTING_NEIGHBOURS` points gets no majority anywhere: use "points" for spots.
        refine: move the mapped reference onto the target in a few steps of smooth registration
        (`nrdf.regions.refine`), about half a second a target.
        drop_absent: a region that the target surely lacks, or that was not seen, comes back empty;
        without it, as what was found for it all the same.
        check: log a warning where the target does not look like an object of the category that
        stands upright and faces forward (`check_kind`).

        Raises RegionError for a region that is empty or not on the reference (the message names
        it) or an unknown method, and CloudError for a target as `CloudEncoder.encode` does.
        """
        if method not in METHODS:
            raise RegionError(unknown_name("method", method, METHODS))
        reference, chosen = self.reference, {}
        for name, region in regions.items():
            try:
                chosen[name] = region_indices(region, reference.cloud, lambda: reference.tree)
            except RegionError as error:
                raise RegionError(f"region '{name}': {error}") from None
        encoded = target if isinstance(target, EncodedCloud) else self._encode(target)
        for warning in self.check_kind(encoded).warnings if check else ():
            log.warning("%s", warning)
        surface = self.map_surface(encoded, refine)
        start = time.perf_counter()
        if method == "mask":
            matches = self._by_mask(chosen, encoded, surface)
        else:
            matches = {
                name: self._by_points(self.map_points(indices, encoded, surface), encoded)
                for name, indices in chosen.items()
            }
        # Refinement pulls what has no counterpart onto the target too: judge where C has put it.
        off = encoded.distance(surface.points - surface.moved, surface.normals)
        asked = self._map_back(encoded)
        matches = {
            name: self._with_presence(
                match, chosen[name], encoded, surface, off, asked, drop_absent
            )
            for name, match in matches.items()
        }
        encoded.seconds["associate"] = time.perf_counter() - start
        return matches

    def _encode(self, target: Any) -> EncodedCloud:
        return self.model.encode(as_cloud(target, "the target"))

    def map_surface(self, target: EncodedCloud, refine: bool = False) -> MappedPoints:
        """Where the reference's working points arrive on a target: C(z_t, k_r)."""
        start = time.perf_counter()
        mapped = self._invert(target, self._k, self.reference.normals)
        target.seconds["map"] = time.perf_counter() - start
        if refine:
            start = time.perf_counter()
            moved = self._refiner.displacement(
                mapped.points, mapped.normals, target.points, target.normals
            )
            mapped = mapped.shifted(moved)
            target.seconds["refine"] = time.perf_counter() - start
        return mapped

    def map_points(
        self, indices: np.ndarray, target: EncodedCloud, surface: MappedPoints | None = None
    ) -> MappedPoints:
        """Where reference points given by their indices (m,) in the cloud arrive on a target.

        surface: what `map_surface` gave for the target, to follow it where it has been refined.
        """
        reference = self.reference
        if reference.is_whole:
            if surface is not None:
                return surface.select(indices)
            return self._invert(target, self._k[:, indices], reference.normals[indices])
        nearest = reference.nearest_working[indices]
        points = reference.canonical(reference.cloud.points[indices])
        normals = reference.normals[nearest]
        if reference.cloud.normals is not None:
            normals = reference.canonical_normals(reference.cloud.normals[indices])
        mapped = self._invert(target, self._describe(points, normals), normals)
        return mapped if surface is None else mapped.shifted(surface.moved[nearest])

    def map_surface_points(
        self, points: np.ndarray, normals: np.ndarray, target: EncodedCloud
    ) -> MappedPoints:
        """Where any places of the reference's surface arrive on a target.

        points: (m, 3) in the reference's frame and unit, on its surface; normals: (m, 3) outward.
        """
        points = self.reference.canonical(points)
        normals = self.reference.canonical_normals(normals)
        return self._invert(target, self._describe(points, normals), normals)

    def correspondence_features(self, target: EncodedCloud) -> np.ndarray:
        """What the descriptors of a target's, or the reference's, working points (n, 6) say: what
        is alike is near.

        Descriptors of two shapes are compared by the places on the reference that C finds for
        them, C(z_reference, θ(z_target, x)), with their weighted normals. Raises ModelError for a
        field without C.
        """
        k = self._describe(target.points, target.normals, target.z)
        landed = self._invert(self.reference, k, target.normals)
        return oriented_features(landed.points, landed.normals, NORMAL_WEIGHT)

    def orient_sheets(
        self, regions: Mapping[str, np.ndarray], target: EncodedCloud
    ) -> EncodedCloud:
        """The target with its sheets turned to the side that the regions are on.

        regions: name to mask (n,) or indices (m,) on the reference. Only points whose side nothing
        tells are turned (`EncodedCloud.two_sided`): a seat that was measured as one sheet becomes
        the top of a seat where that is taught, and its underside where that is.
        """
        both, count = target.two_sided(), len(target.working)
        if len(both.working) == count:
            return target
        mapped = self.map_surface(target)
        asked, _ = nearest_voters(
            mapped.points,
            mapped.normals,
            both.points,
            both.normals,
            NORMAL_WEIGHT,
            VOTING_NEIGHBOURS,
        )
        wanted = np.any([self._working_mask(indices) for indices in regions.values()], axis=0)
        claim = wanted[asked].mean(axis=1)
        again = np.flatnonzero(np.isin(target.working, both.working[count:]))
        turned = again[claim[count:] > claim[again]]
        normals = target.normals.copy()
        normals[turned] *= -1
        return replace(target, normals=normals)

    def _with_presence(
        self,
        match: Match,
        indices: np.ndarray,
        target: EncodedCloud,
        surface: MappedPoints,
        off: np.ndarray,
        returned: tuple[np.ndarray, np.ndarray],
        drop_absent: bool,
    ) -> Match:
        """The match with the overlap that is to be expected; without its points where the target
        lacks the region or does not show it. off: (n,) distances of the mapped surface from the
        target; returned: as `_returned` gives it."""
        inside = self._working_mask(indices)
        found = np.zeros(len(target.cloud.points), bool)
        found[match.indices] = True
        found = found[target.working]
        chosen, asked = returned
        back = inside[asked[found[chosen]]]
        evidence = evidence_of(
            surface.existence[inside],
            match.score,
            float(found.mean() / inside.mean()),
            float(back.mean()) if back.size else 0.0,
        )
        return match.with_presence(find_presence(evidence, off[inside], off), drop_absent)

    def _map_back(self, target: EncodedCloud) -> tuple[np.ndarray, np.ndarray]:
        """Where a target's points lead back to: positions (m,) of some of its working points, and
        the reference's working points (m, k) nearest to C(z_reference, θ(z_target, x))."""
        chosen = np.random.default_rng(0).permutation(len(target.points))[:_RETURNED]
        points, normals = target.points[chosen], target.normals[chosen]
        k = self._describe(points, normals, target.z)
        landed = self._invert(self.reference, k, normals)
        return chosen, self.reference.nearest(landed.points, landed.normals, VOTING_NEIGHBOURS)

    def _by_mask(
        self, chosen: dict[str, np.ndarray], target: EncodedCloud, mapped: MappedPoints
    ) -> dict[str, Match]:
        asked, distance = nearest_voters(
            mapped.points,
            mapped.normals,
            target.points,
            target.normals,
            NORMAL_WEIGHT,
            VOTING_NEIGHBOURS,
        )
        trust = mapped.trust[asked] * np.exp(-distance / TRUST_SCALE)
        patches = find_patches(target.points, explained_by(distance, mapped.error[asked]))
        matches = {}
        for name, indices in chosen.items():
            member = self._working_mask(indices)[asked]
            votes = member.mean(axis=1)
            confidence = (member * trust).sum(axis=1) / np.maximum(member.sum(axis=1), 1)
            voted = votes > 0.5
            found = patches.joined(voted)
            # Where much was voted in that nothing on the reference explains, the rest is doubtful.
            confidence *= found.sum() / max(voted.sum(), 1)
            index, follows = target.to_all(found)
            arrived = self.map_points(indices, target, mapped)
            matches[name] = Match(
                indices=index,
                points=target.original(arrived.points),
                confidence=np.clip(votes * confidence, 0.0, 1.0)[follows],
                method="mask",
            )
        return matches

    def _by_points(self, mapped: MappedPoints, target: EncodedCloud) -> Match:
        nearest, distance = snap(mapped.points, mapped.normals, target.points, target.normals)
        found, first = np.unique(target.working[nearest], return_index=True)
        trust = mapped.trust * np.exp(-distance / TRUST_SCALE)
        return Match(
            indices=found,
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

    def _describe(
        self, points: np.ndarray, normals: np.ndarray, z: torch.Tensor | None = None
    ) -> torch.Tensor:
        """Descriptors (1, m, d_k) of points (m, 3), on the reference or on the shape of z."""
        model, z = self.model, self.reference.z if z is None else z
        parts = []
        with torch.inference_mode():
            for start in range(0, len(points), _CHUNK):
                part = slice(start, start + _CHUNK)
                parts.append(
                    model.field.describe(
                        z,
                        model.tensor(points[part])[None],
                        model.tensor(normals[part])[None],
                    )
                )
        return torch.cat(parts, dim=1)

    def _invert(self, target: EncodedCloud, k: torch.Tensor, normals: np.ndarray) -> MappedPoints:
        parts = []
        with torch.inference_mode():
            for start in range(0, k.shape[1], _CHUNK):
                inverse = self.model.field.invert(target.z, k[:, start : start + _CHUNK])
                parts.append(mapped_points(inverse, normals[start : start + _CHUNK]))
        return MappedPoints(*map(np.concatenate, zip(*parts, strict=True)))
