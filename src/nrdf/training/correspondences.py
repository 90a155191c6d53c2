"""Known correspondences between training shapes: stored once, drawn for every batch.

Shapes that share a correspondence group list the same places in the same order. A place's weight
says how sure its correspondence is; in groups that are exact, weight 0 means "no such place".
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from fnmatch import fnmatch

import numpy as np
import torch
from torch import Tensor

from nrdf.shapes.dataset import Correspondence
from nrdf.training.config import DataConfig
from nrdf.training.cuts import Cuts

CANDIDATES = 4
"""Correspondences tried for each one that is wanted; those without confidence drop out."""


@dataclass(frozen=True)
class CorrespondenceRows:
    """Drawn correspondences of p pairs, m each: rows of the groups' long list.

    first, second: (p, m) rows of the reference's and the partner's places. weight: (p, m)
    confidence, 0 throughout for a pair that shares no group. known: (p, m) bool, whether the weight
    tells if the partner has such a place.
    """

    first: Tensor
    second: Tensor
    weight: Tensor
    known: Tensor


class CorrespondenceGroups:
    """The correspondence groups of all shapes in one long list, and where each begins.

    names: of the groups, each with the length of its lists, since only lists of the same length
    correspond. A group that one shape alone has joins nothing and is left out. points, normals:
    (n, 3) and weight: (n,) of all places.
    """

    def __init__(
        self,
        shapes: Sequence[Mapping[str, Correspondence]],
        exact_groups: Sequence[str],
        device: torch.device,
    ) -> None:
        """shapes: each one's groups by name; exact_groups: patterns of names (`DataConfig`)."""
        groups = [
            {f"{name}/{len(group.points)}": group for name, group in of_shape.items()}
            for of_shape in shapes
        ]
        count = Counter(name for of_shape in groups for name in of_shape)
        self.names = sorted(name for name, holders in count.items() if holders > 1)
        self._device = device
        offset = torch.full((len(groups), max(1, len(self.names))), -1, dtype=torch.long)
        points, normals, weight = [torch.zeros(0, 3)], [torch.zeros(0, 3)], [torch.zeros(0)]
        total = 0
        for row, of_shape in enumerate(groups):
            for column, name in enumerate(self.names):
                if name in of_shape:
                    group = of_shape[name]
                    offset[row, column] = total
                    total += len(group.points)
                    points.append(to_tensor(group.points))
                    normals.append(to_tensor(group.normals))
                    weight.append(to_tensor(group.weight))
        if not total:  # one row, so that pairs without a group have one to point to
            points, normals, weight = [torch.zeros(1, 3)], [torch.zeros(1, 3)], [torch.zeros(1)]
        sizes = [int(name.rpartition("/")[2]) for name in self.names] or [1]
        exact = [
            any(fnmatch(name.rpartition("/")[0], pattern) for pattern in exact_groups)
            for name in self.names
        ] or [False]
        self._offset = offset.to(device)
        self._size = torch.tensor(sizes, device=device)
        self._exact = torch.tensor(exact, device=device)
        self.points = torch.cat(points).to(device)
        self.normals = torch.cat(normals).to(device)
        self.weight = torch.cat(weight).to(device)

    def draw(
        self,
        first: Tensor,
        second: Tensor,
        config: DataConfig,
        generator: torch.Generator,
        cuts: tuple[Cuts, Cuts] | None = None,
    ) -> CorrespondenceRows:
        """Random correspondences between shapes first (p,) and second (p,).

        cuts: of the first and the second shapes.
        """
        pairs, wanted = len(first), config.correspondences
        offset_a, offset_b = self._offset[first], self._offset[second]  # (p, g)
        shared = (offset_a >= 0) & (offset_b >= 0)
        luck = torch.rand(shared.shape, generator=generator, device=self._device)
        score, group = torch.where(shared, luck, -1.0).max(dim=1)
        joined = (score >= 0)[:, None]
        offset_a = offset_a.gather(1, group[:, None]).clamp_min(0)
        offset_b = offset_b.gather(1, group[:, None]).clamp_min(0)
        exact = self._exact[group][:, None] & joined

        luck = torch.rand(
            pairs, max(1, wanted * CANDIDATES), generator=generator, device=self._device
        )
        index = (luck * self._size[group][:, None]).long()
        # Rounding can reach the end of the list.
        index = torch.minimum(index, self._size[group][:, None] - 1)
        index = torch.where(joined, index, 0)
        a, b = offset_a + index, offset_b + index
        threshold = config.weight_threshold
        on_source, on_target = self.weight[a], self.weight[b]
        lost = torch.zeros_like(joined)
        if cuts is not None:
            on_source = on_source * cuts[0].keep(self.points[a])
            kept = cuts[1].keep(self.points[b])
            lost = ~kept & (on_target > threshold)
            on_target = on_target * kept
        weight = torch.where(joined, on_source * on_target, 0.0)
        weight = torch.where(weight > threshold, weight, 0.0)
        # Places that the source has and the target lacks teach `existence`, where that is sure.
        lacking = (exact | lost) & (on_source > threshold) & (weight == 0) & joined
        useful = (weight > 0) | lacking
        order = useful.to(torch.uint8).sort(dim=1, descending=True, stable=True).indices[:, :wanted]
        # Without cuts only exact groups say of their places that they exist.
        known = lacking | ((weight > 0) & (exact if cuts is None else joined))
        return CorrespondenceRows(*(values.gather(1, order) for values in (a, b, weight, known)))


def to_tensor(values: np.ndarray, pick: np.ndarray | None = None) -> Tensor:
    """Values, or those at `pick`, in single precision."""
    chosen = values if pick is None else values[pick]
    return torch.from_numpy(np.array(chosen, dtype=np.float32))
