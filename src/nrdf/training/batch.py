"""What a training step sees: shapes, and pairs of them with known correspondences."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor


@dataclass(frozen=True)
class Batch:
    """b shapes and p pairs of them; everything canonical, after deformation.

    Pair i maps points of shape `reference[i]` to shape `partner[i]`, which is another one.
    """

    points: Tensor  # (b, n, 3) what the encoder sees
    normals: Tensor  # (b, n, 3)
    clean_points: Tensor  # (b, n, 3) the same without sensor noise
    clean_normals: Tensor  # (b, n, 3)
    queries: Tensor  # (b, q, 3)
    occupancy: Tensor  # (b, q) 1 inside, 0 outside
    reference: Tensor  # (p,) index into the batch
    partner: Tensor  # (p,) index into the batch; the first b pairs are every shape's first partner
    source: Tensor  # (p, m, 3) on the reference
    source_normals: Tensor  # (p, m, 3)
    target: Tensor  # (p, m, 3) the same places on the partner
    target_normals: Tensor  # (p, m, 3)
    weight: Tensor  # (p, m) confidence; 0: no such place on the partner, or not known
    known: Tensor  # (p, m) bool: the weight tells whether there is such a place on the partner


def seeded(device: torch.device, *keys: int) -> torch.Generator:
    """A generator on `device` whose seed is a hash of the keys."""
    state = np.random.SeedSequence([int(key) for key in keys]).generate_state(1, np.uint64)[0]
    return torch.Generator(device).manual_seed(int(state >> 1))


def pair_up(sizes: Sequence[int], rolls: int, device: torch.device) -> tuple[Tensor, Tensor]:
    """Reference and partner (p,) of every pair: within each pool of `sizes`, the next shape, the
    one after it, ... (`rolls` of them)."""
    partners = []
    for roll in range(rolls):
        start = 0
        for size in sizes:
            partners.append(start + (torch.arange(size) + 1 + roll % (size - 1)) % size)
            start += size
    reference = torch.arange(sum(sizes)).repeat(rolls)
    return reference.to(device), torch.cat(partners).to(device)
