"""Methods of a trained field: one forward pass a pair."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from nrdf.field.encoded_cloud import EncodedCloud
from nrdf.io.cloud import PointCloud
from nrdf.regions.match import Match
from nrdf.regions.model import Model
from nrdf.regions.reference import EncodedReference


class FieldMethod:
    """A field with an inverse: ours of either preset, or IMDC's.

    association: "mask", or "points": C's prediction of each region point, snapped to the nearest
    target point by position alone (paper, eq. 9). refine: move the mapped reference onto the target
    in a few steps first. The last reference stays encoded, as in use; a target is encoded in
    every call.
    """

    def __init__(self, model: Model, association: str, refine: bool = False) -> None:
        self.model, self.association, self.refine = model, association, refine
        self.confidence: dict[str, float] = {}
        self._reference: EncodedReference | None = None

    def __call__(
        self, reference: PointCloud, regions: Mapping[str, Any], target: PointCloud
    ) -> dict[str, np.ndarray]:
        matches = self.find(reference, regions, target)
        self.confidence = {name: match.score for name, match in matches.items()}
        if self.association == "mask":
            return {name: match.indices for name, match in matches.items()}
        tree = cKDTree(target.points)
        return {name: tree.query(match.points)[1] for name, match in matches.items()}

    def find(
        self, reference: PointCloud, regions: Mapping[str, Any], target: PointCloud | EncodedCloud
    ) -> dict[str, Match]:
        """All that retrieval says of each region."""
        if self._reference is None or self._reference.encoded_cloud.cloud is not reference:
            self._reference = self.model.set_reference(reference)
        return self._reference.retrieve_all(regions, target, self.association, self.refine)
