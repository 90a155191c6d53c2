"""How NDF finds a point: by the descriptor, not by an inverse (Simeonov et al., ICRA 2022)."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import torch
from scipy.spatial import cKDTree
from torch import Tensor

from nrdf.field.encoded_cloud import EncodedCloud
from nrdf.io.cloud import PointCloud
from nrdf.regions.model import Model
from nrdf.regions.region import region_indices

STARTS = 4
"""Random target points that the minimisation of each region point starts from."""
STEPS = 100
RATE = 0.01
"""Adam's rate, in canonical lengths."""
_CHUNK = 512


class DescriptorSearch:
    """Region points by the nearest descriptor among the target's own points, or by energy.

    energy: instead minimise the L1 distance between descriptors over free points by `STEPS` of
    Adam from `STARTS` random target points, as its authors do for the points of a gripper; the best
    start wins and is snapped to the target. Nearest descriptors are compared by Euclidean distance,
    which a matrix product gives; the energy is L1.

    For 5600 region points and a target of 8192 points, on one core of a 2023 server CPU: nearest
    descriptors 0.7 s, energy about a minute (0.15 s for each of `STARTS` times `STEPS`).
    """

    def __init__(self, model: Model, energy: bool = False) -> None:
        self.model, self.energy = model, energy
        self._reference: tuple[PointCloud, EncodedCloud] | None = None

    def match(
        self, reference: PointCloud, regions: Mapping[str, Any], target: PointCloud
    ) -> dict[str, np.ndarray]:
        """Indices into the target's points by region, one for each of the region's points, in
        their order. Raises RegionError and CloudError as `EncodedReference.retrieve_all` does."""
        if self._reference is None or self._reference[0] is not reference:
            self._reference = (reference, self.model.encode(reference))
        on_reference, on_target = self._reference[1], self.model.encode(target)
        chosen = {
            name: region_indices(region, reference, lambda: on_reference.tree)
            for name, region in regions.items()
        }
        every = np.concatenate(list(chosen.values()))
        points = on_reference.canonical(reference.points[every])
        wanted = self._describe(on_reference, points)
        if self.energy:
            found = cKDTree(on_target.points).query(self._minimise(on_target, wanted))[1]
        else:
            found = nearest(wanted, self._describe(on_target, on_target.points))
        indices = on_target.working[found]
        ends = np.cumsum([len(part) for part in chosen.values()])[:-1]
        return dict(zip(chosen, np.split(indices, ends), strict=True))

    def _describe(self, shape: EncodedCloud, points: np.ndarray) -> Tensor:
        queries = self._tensor(points)[None]
        with torch.no_grad():
            return self.model.field.describe(shape.z, queries, queries)[0]

    def _minimise(self, shape: EncodedCloud, wanted: Tensor) -> np.ndarray:
        """Points (m, 3), canonical, where the descriptors are like `wanted` (m, d)."""
        rng = np.random.default_rng(0)
        z, best, least = shape.z.clone(), None, None
        for _ in range(STARTS):
            start = shape.points[rng.integers(len(shape.points), size=len(wanted))]
            points = self._tensor(start).requires_grad_()
            optimizer = torch.optim.Adam([points], RATE)
            for _ in range(STEPS):
                # Not backward(), which would leave gradients on the model's weights.
                energy = self._energy(z, points, wanted).sum()
                points.grad = torch.autograd.grad(energy, points)[0]
                optimizer.step()
            with torch.no_grad():
                energy = self._energy(z, points, wanted)
                if best is None or least is None:
                    best, least = points.detach(), energy
                best = torch.where((energy < least)[:, None], points.detach(), best)
                least = torch.minimum(energy, least)
        assert best is not None
        return best.cpu().numpy()

    def _energy(self, z: Tensor, points: Tensor, wanted: Tensor) -> Tensor:
        k = self.model.field.describe(z, points[None], points[None])[0]
        return (k - wanted).abs().sum(-1)

    def _tensor(self, points: np.ndarray) -> Tensor:
        return torch.as_tensor(points, dtype=torch.float32, device=self.model.device)


def nearest(wanted: Tensor, among: Tensor) -> np.ndarray:
    """For each descriptor (m, d) the index (m,) of the nearest of others (n, d)."""
    # What all have in common would drown the differences in the product's rounding.
    common = among.mean(dim=0)
    wanted, among = wanted - common, among - common
    parts = [torch.cdist(part, among).argmin(dim=1) for part in wanted.split(_CHUNK)]
    return torch.cat(parts).cpu().numpy()
