"""A reference with its descriptors: its regions are found on every new object."""

from __future__ import annotations

import logging
import time
from collections.abc import Mapping
from dataclasses import replace
from functools import cached_property
from typing import Any

import numpy as np

from nrdf.errors import RegionError, unknown_name
from nrdf.field.cloud_encoder import CloudEncoder
from nrdf.field.encoded_cloud import NORMAL_WEIGHT, EncodedCloud
from nrdf.field.general import GENERAL
from nrdf.field.registration import REGISTRATION
from nrdf.geometry.normals import oriented_features
from nrdf.io.inputs import as_cloud
from nrdf.regions.association import VOTING_NEIGHBOURS, alike_voters, nearest_voters, snap
from nrdf.regions.field_mapper import FieldMapper
from nrdf.regions.mapping import TRUST_SCALE, MappedPoints, SurfaceMapper
from nrdf.regions.match import Match
from nrdf.regions.patches import explained_by, find_patches
from nrdf.regions.presence import evidence_of, find_presence
from nrdf.regions.refine import Refiner
from nrdf.regions.region import region_indices
from nrdf.regions.registration_mapper import RegistrationMapper
from nrdf.scans.kind_check import KindCheck, check_kind
from nrdf.scans.pose_scorer import PoseScorer

log = logging.getLogger(__name__)

METHODS = ("mask", "points")
_MAPPED_BACK = 2048  # of a target's points


def surface_mapper(model: CloudEncoder, source: EncodedCloud) -> SurfaceMapper:
    """What maps the surface of an encoded cloud onto others by a model."""
    if model.preset == REGISTRATION:
        return RegistrationMapper(source)
    if model.preset == GENERAL:
        return RegistrationMapper(source, model)
    return FieldMapper(model, source)


class EncodedReference:
    """A reference, encoded, with what maps it (paper, eq. 8), for any number of targets.

    Attributes:
        model: what encodes targets.
        encoded_cloud: the reference as the model sees it.
    """

    def __init__(self, model: CloudEncoder, encoded_cloud: EncodedCloud) -> None:
        self.model = model
        self.encoded_cloud = encoded_cloud
        self._mapper = surface_mapper(model, encoded_cloud)

    def check_kind(self, target: EncodedCloud) -> KindCheck:
        """Whether a target looks like an object of the category, upright and facing forward in the
        pose that it is encoded in. A category without a network compares it with the reference."""
        return check_kind(self.model, target, lambda: self._scorer)

    @cached_property
    def _scorer(self) -> PoseScorer:
        return PoseScorer(self.model, [self.encoded_cloud.cloud])

    @cached_property
    def _refiner(self) -> Refiner:
        return Refiner(self.encoded_cloud.points, self.encoded_cloud.normals)

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

        Args:
            regions: name to boolean mask (n,), indices (m,) or points (m, 3) on the reference.
            target: what `nrdf.as_cloud` takes (a path, an array (n, 3), a mesh, …), or encoded.
                Matches index its points; `nrdf.as_cloud` gives those that a mesh is sampled to.
            method: "mask" maps the whole reference. Each target point joins a region by the
                votes of the mapped reference points nearest in position, normal and local shape
                (k-nearest voting). Parts of the target that are far from all of them, by the error
                that the field expects, join a region only where they grow out of it
                (`nrdf.regions.patches`). "points" snaps C's prediction of each region point to the
                target (paper, eq. 9). A region of fewer than half of `VOTING_NEIGHBOURS` points
                gets no majority anywhere: use "points" for spots.
            refine: move the mapped reference onto the target in a few steps of smooth registration
                (`nrdf.regions.refine`), about half a second a target.
            drop_absent: a region that the target surely lacks, or that was not seen, comes back
                empty; without it, as what was found for it all the same.
            check: log a warning where the target does not look like an object of the category that
                stands upright and faces forward (`check_kind`).

        Raises:
            RegionError: a region is empty or not on the reference (the message names it), or the
                method is unknown.
            CloudError: the target cannot be used, as `CloudEncoder.encode` says.
        """
        if method not in METHODS:
            raise RegionError(unknown_name("method", method, METHODS))
        reference, chosen = self.encoded_cloud, {}
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
        # Refinement pulls what has no counterpart onto the target too: measure from where C put it.
        distance = encoded.distance(surface.points - surface.displacement, surface.normals)
        some = np.random.default_rng(0).permutation(len(encoded.points))[:_MAPPED_BACK]
        back = self._mapper.map_back(encoded, some)
        nearest = self.encoded_cloud.nearest(back.points, back.normals, VOTING_NEIGHBOURS)
        matches = {
            name: self._with_presence(
                match, chosen[name], encoded, surface, distance, (some, nearest), drop_absent
            )
            for name, match in matches.items()
        }
        encoded.seconds["associate"] = time.perf_counter() - start
        return matches

    def _encode(self, target: Any) -> EncodedCloud:
        return self.model.encode(as_cloud(target, "the target"))

    def map_surface(self, target: EncodedCloud, refine: bool = False) -> MappedPoints:
        """Where the reference's working points arrive on a target: C(z_t, k_r), refined if that is
        asked for."""
        start = time.perf_counter()
        mapped = self._mapper.map_working(target)
        target.seconds["map"] = time.perf_counter() - start
        if refine:
            start = time.perf_counter()
            displacement = self._refiner.displacement(
                mapped.points, mapped.normals, target.points, target.normals
            )
            mapped = mapped.displaced(displacement)
            target.seconds["refine"] = time.perf_counter() - start
        return mapped

    def map_points(
        self, indices: np.ndarray, target: EncodedCloud, surface: MappedPoints | None = None
    ) -> MappedPoints:
        """Where reference points given by their indices (m,) in the cloud arrive on a target.

        surface: what `map_surface` gave for the target, to follow it where it has been refined.
        """
        reference = self.encoded_cloud
        if reference.is_whole:
            if surface is not None:
                return surface.select(indices)
            return self._mapper.map_working(target, indices)
        nearest = reference.nearest_working[indices]
        points = reference.canonical(reference.cloud.points[indices])
        normals = reference.normals[nearest]
        if reference.cloud.normals is not None:
            normals = reference.canonical_normals(reference.cloud.normals[indices])
        mapped = self._mapper.map_points(points, normals, target)
        return mapped if surface is None else mapped.displaced(surface.displacement[nearest])

    def map_surface_points(
        self, points: np.ndarray, normals: np.ndarray, target: EncodedCloud
    ) -> MappedPoints:
        """Where any points of the reference's surface arrive on a target, as exactly as can be.

        points: (m, 3) in the reference's frame and unit, on its surface; normals: (m, 3) outward.
        """
        points = self.encoded_cloud.canonical(points)
        normals = self.encoded_cloud.canonical_normals(normals)
        return self._mapper.map_precisely(points, normals, target)

    def correspondence_features(self, target: EncodedCloud) -> np.ndarray:
        """Features (n, 6) of a target's, or the reference's, working points by which points of
        different objects are compared: corresponding points have nearly the same.

        They are the points of the reference that C finds for the descriptors, with weighted
        normals. Raises ModelError for a field without C.
        """
        mapped = self._mapper.map_back(target, slice(None))
        return oriented_features(mapped.points, mapped.normals, NORMAL_WEIGHT)

    def orient_sheets(
        self, regions: Mapping[str, np.ndarray], target: EncodedCloud
    ) -> EncodedCloud:
        """The target with the normals of its sheets on the side that the regions are on.

        regions: name to mask (n,) or indices (m,) on the reference. Only points whose side is not
        known change (`EncodedCloud.two_sided`): a seat that was measured as one sheet becomes the
        top of a seat where a region holds that, and its underside where a region holds that.
        """
        both, count = target.two_sided(), len(target.working)
        if len(both.working) == count:
            return target
        mapped = self.map_surface(target)
        voters, _ = nearest_voters(mapped.points, mapped.normals, both.points, both.normals)
        wanted = np.any([self._working_mask(indices) for indices in regions.values()], axis=0)
        votes = wanted[voters].mean(axis=1)
        sheets = np.flatnonzero(np.isin(target.working, both.working[count:]))
        flipped = sheets[votes[count:] > votes[sheets]]
        normals = target.normals.copy()
        normals[flipped] *= -1
        return replace(target, normals=normals)

    def _with_presence(
        self,
        match: Match,
        indices: np.ndarray,
        target: EncodedCloud,
        surface: MappedPoints,
        distance: np.ndarray,
        mapped_back: tuple[np.ndarray, np.ndarray],
        drop_absent: bool,
    ) -> Match:
        """The match with its expected overlap; without its points where the target lacks the region
        or does not show it.

        distance: (n,) of the mapped surface from the target. mapped_back: some of the target's
        working points (m,), and the reference's working points (m, k) nearest to where they map.
        """
        inside = self._working_mask(indices)
        found = np.zeros(len(target.points), bool)
        found[match.working] = True
        chosen, nearest = mapped_back
        returned = inside[nearest[found[chosen]]]
        evidence = evidence_of(
            surface.existence[inside],
            match.score,
            float(found.mean() / inside.mean()),
            float(returned.mean()) if returned.size else 0.0,
        )
        presence = find_presence(evidence, distance[inside], distance, self._mapper.presence_rule)
        return match.with_presence(presence, drop_absent)

    def _by_mask(
        self, chosen: dict[str, np.ndarray], target: EncodedCloud, mapped: MappedPoints
    ) -> dict[str, Match]:
        """Each target point joins a region by the votes of the mapped reference points that are
        nearest and lie alike; where these are far, only if it grows out of the region."""
        voters, distance = alike_voters(mapped, self.encoded_cloud, target)
        patches = find_patches(target.points, explained_by(distance, mapped.error[voters]))
        # How far to trust a place is told by what is nearest, alike or not.
        nearest, distance = nearest_voters(
            mapped.points, mapped.normals, target.points, target.normals
        )
        trust = (mapped.trust[nearest] * np.exp(-distance / TRUST_SCALE)).mean(axis=1)
        matches = {}
        for name, indices in chosen.items():
            votes = self._working_mask(indices)[voters].mean(axis=1)
            voted = votes > 0.5
            found = patches.joined(voted)
            # Where much was voted in that nothing on the reference explains, trust the rest less.
            confidence = votes * trust * (found.sum() / max(voted.sum(), 1))
            index, follows = target.to_all(found)
            points = self.map_points(indices, target, mapped).points
            matches[name] = Match(
                indices=index,
                points=target.original(points),
                confidence=np.clip(confidence, 0.0, 1.0)[follows],
                method="mask",
                working=np.flatnonzero(found),
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
            working=np.unique(nearest),
        )

    def _working_mask(self, indices: np.ndarray) -> np.ndarray:
        """Which working points of the reference a region holds, (n,) bool."""
        reference = self.encoded_cloud
        mask = np.zeros(len(reference.points), bool)
        mask[reference.to_working(indices)] = True
        if mask.any():
            return mask
        # The region fell between the points that were kept: its nearest ones stand for it.
        mask[reference.nearest_working[indices]] = True
        return mask
