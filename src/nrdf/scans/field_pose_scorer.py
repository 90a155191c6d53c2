"""Scores of hypothesised poses by a field: how well it explains the cloud in each of them.

Prototypes, a few known members of the category, are mapped onto the cloud by the field (C of their
descriptors and the cloud's embedding). In the right pose they come to lie on it, on the right
sides; in a wrong one the field puts seats where backs are, off the surface.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import ClassVar

import numpy as np
import torch
from torch import Tensor
from torch.nn import functional

from nrdf.errors import ModelError
from nrdf.field.base import Inverse
from nrdf.field.cloud_encoder import CloudEncoder
from nrdf.field.encoded_cloud import NORMAL_WEIGHT, EncodedCloud
from nrdf.field.yaw_network import YawNetwork, find_yaw_network
from nrdf.io.cloud import PointCloud
from nrdf.scans.pose_scorer import PoseScorer, even_subset, sparse_subset
from nrdf.shapes.families import FAMILY_NAMES, get_family

FIRST_SEED = 900_000  # of the members that serve as prototypes; no training set has them
PROTOTYPES = 8
_COARSE_POINTS = 128  # of each prototype
_FINE_POINTS = 256
_SCORED_POINTS = 512  # of the cloud
_COARSE_TOLERANCE, _FINE_TOLERANCE = 0.05, 0.03
"""Distance at which a point counts half as explained, canonical."""
_UNSEEN = 0.5  # weight of the prototypes' points: what they lie on may not have been seen
_DEPTH = 0.02  # below and above the surface, where occupancy is evaluated, canonical
_ERROR, _INSIDE = 0.3, 0.1  # weights of the expected error's logarithm, and of occupancy
_USUAL_POINTS = 1024
_BATCH = 36
# The second of each where one object is all that is known.
_COST_MARGIN, _COST_MARGIN_TO_ONE = 0.5, 0.55
_LARGEST_Z_SCORE, _LARGEST_Z_SCORE_TO_ONE = 1.65, 3.0


class FieldPoseScorer(PoseScorer):
    """Scores poses of clouds by prototypes of a model's category, whose descriptors are kept.

    A score is a cost: the lower, the better the field explains the cloud.
    """

    def __init__(
        self,
        model: CloudEncoder,
        prototypes: Sequence[PointCloud] = (),
        yaw: YawNetwork | None = None,
    ) -> None:
        """`prototypes` are canonical in orientation; members of the category's family unless given.
        `yaw` estimates which way an object faces; the category's in the zoo unless given.

        Raises ModelError if there are none and the category has no family.
        """
        given = list(prototypes) or family_prototypes(model.category)
        super().__init__(model, given, yaw or find_yaw_network(model.category))
        descriptors = []
        with torch.inference_mode():
            for cloud in self._clouds:
                chosen = even_subset(cloud.points, _FINE_POINTS)
                points = model.tensor(cloud.points[chosen])[None]
                normals = model.tensor(cloud.normals[chosen])[None]
                descriptors.append(model.field.describe(cloud.z, points, normals))
        self._k = torch.cat(descriptors)  # (p, _FINE_POINTS, d_k)

    # Chosen on single views of family members and public meshes: nine in ten wrong poses are
    # reported as ambiguous, and two in ten right ones.
    cost_scale: ClassVar[float] = 0.036

    def coarse(self, points: np.ndarray, normals: np.ndarray) -> np.ndarray:
        """Cost (h,) of h hypotheses: clouds (h, n, 3) in hypothesised canonical frames.

        Mean over the prototypes of the robust distance (Geman and McClure; 0 to 1) from the cloud
        to the mapped prototype, plus half that of the way back.
        """
        parts = []
        for start in range(0, len(points), _BATCH):
            part = slice(start, start + _BATCH)
            q, n = self.model.tensor(points[part]), self.model.tensor(normals[part])
            parts.append(self._explained(q, n, q, n, _COARSE_POINTS, _COARSE_TOLERANCE)[0].mean(1))
        return torch.cat(parts).cpu().numpy()

    def fine(
        self, points: np.ndarray, normals: np.ndarray, whole: np.ndarray, whole_normals: np.ndarray
    ) -> np.ndarray:
        """Cost (h,) as of `coarse`, more exactly, with the errors that the field expects.

        whole, whole_normals: (h, m, 3) what the field encodes: the cloud, completed by its mirror
        image where it has one. Added are the error that the field expects on the prototypes, and
        how far it is from finding matter just below the cloud's points and none above.
        """
        return self._fine(points, normals, whole, whole_normals).mean(axis=1)

    def cost_of(self, target: EncodedCloud) -> float:
        """The cost of a target in the pose in which it is encoded."""
        return float(self._each_cost(target).mean())

    @property
    def cost_margin(self) -> float:
        """As of `PoseScorer`."""
        return _COST_MARGIN if self.prototypes > 1 else _COST_MARGIN_TO_ONE

    @property
    def largest_z_score(self) -> float:
        """As of `PoseScorer`."""
        return _LARGEST_Z_SCORE if self.prototypes > 1 else _LARGEST_Z_SCORE_TO_ONE

    @cached_property
    def usual_cost(self) -> float:
        """Mean cost of the prototypes, each scored by the others: what is usual in the category."""
        costs = []
        for number, cloud in enumerate(self._clouds):
            each = self._each_cost(cloud)
            costs.append(np.delete(each, number).mean() if self.prototypes > 1 else each.mean())
        return float(np.mean(costs))

    def _each_cost(self, target: EncodedCloud) -> np.ndarray:
        """The cost of a target by each of the prototypes, (p,)."""
        chosen = sparse_subset(target.points, _USUAL_POINTS)
        points, normals = target.points[None, chosen], target.normals[None, chosen]
        return self._fine(points, normals, points, normals)[0]

    def _fine(
        self, points: np.ndarray, normals: np.ndarray, whole: np.ndarray, whole_normals: np.ndarray
    ) -> np.ndarray:
        """The cost of h hypotheses by each of p prototypes, (h, p)."""
        q, n, w, wn = (self.model.tensor(part) for part in (points, normals, whole, whole_normals))
        cost, inverse, z = self._explained(q, n, w, wn, _FINE_POINTS, _FINE_TOLERANCE)
        with torch.inference_mode():
            if inverse.log_error is not None:
                error = inverse.log_error.unflatten(1, (self.prototypes, -1))
                cost = cost + _ERROR * error.mean(2)
            below = self.model.field.occupancy(z, q - _DEPTH * n)
            above = self.model.field.occupancy(z, q + _DEPTH * n)
            wrong = functional.softplus(-below) + functional.softplus(above)
            return (cost + _INSIDE * wrong.mean(1, keepdim=True)).cpu().numpy()

    def _explained(
        self, q: Tensor, n: Tensor, w: Tensor, wn: Tensor, count: int, tolerance: float
    ) -> tuple[Tensor, Inverse, Tensor]:
        """Cost (h, p) of clouds q, n (h, ., 3), encoded from w, wn; C's output; embeddings."""
        field, h = self.model.field, len(q)
        with torch.inference_mode():
            z = field.embed(w, wn)
            k = self._k[:, :count].flatten(0, 1)
            inverse = field.invert(z, k.expand(h, -1, -1))
            mapped = inverse.points
            seen = q[:, :_SCORED_POINTS]
            if inverse.normals is not None:
                mapped = torch.cat([mapped, NORMAL_WEIGHT * inverse.normals], dim=-1)
                seen = torch.cat([seen, NORMAL_WEIGHT * n[:, :_SCORED_POINTS]], dim=-1)
            mapped = mapped.unflatten(1, (self.prototypes, count)).flatten(0, 1)
            seen = seen[:, None].expand(-1, self.prototypes, -1, -1).flatten(0, 1)
            square = torch.cdist(seen, mapped).square()
            there, back = (
                (least / (least + tolerance**2)).mean(1)
                for least in (square.amin(2), square.amin(1))
            )
            return (there + _UNSEEN * back).view(h, -1), inverse, z


def family_prototypes(category: str) -> list[PointCloud]:
    """Members of a category's family that no training set holds. Raises ModelError without one."""
    if category not in FAMILY_NAMES:
        raise ModelError(
            f"the category '{category}' has no parametric family (there are "
            f"{', '.join(FAMILY_NAMES)}), so alignment needs an example: give a --reference"
        )
    family = get_family(category)
    rng = np.random.default_rng(0)
    found = []
    for seed in range(FIRST_SEED, FIRST_SEED + PROTOTYPES):
        surface = family.member(seed).sample_surface(2048, rng)
        found.append(PointCloud(surface.points, surface.normals))
    return found
