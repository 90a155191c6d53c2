"""Which shapes meet in a batch: pools by source, and pairs within each pool."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from fnmatch import fnmatch

import torch
from torch import Tensor

from nrdf.errors import ConfigError

log = logging.getLogger(__name__)


def find_pools(sources: list[str], shares: dict[str, float]) -> list[tuple[str, float, list[int]]]:
    """Pattern, share and members of each pool that has members."""
    patterns = shares or {"*": 1.0}
    members: dict[str, list[int]] = {pattern: [] for pattern in patterns}
    for index, source in enumerate(sources):
        fitting = next((p for p in patterns if fnmatch(source, p)), None)
        if fitting is None:
            raise ConfigError(
                f"shapes of source '{source}' belong to no pool ({', '.join(patterns)}); "
                "add a pool '*' for the rest"
            )
        members[fitting].append(index)
    for pattern in patterns:
        if not members[pattern]:
            log.warning("pool '%s' has no shapes and is left out", pattern)
    return [(p, share, members[p]) for p, share in patterns.items() if members[p] and share > 0]


def pairs(sizes: Sequence[int], rolls: int, device: torch.device) -> tuple[Tensor, Tensor]:
    """Reference and partner (p,) of every pair: within each pool, the next, the one after, ..."""
    partners = []
    for roll in range(rolls):
        start = 0
        for size in sizes:
            partners.append(start + (torch.arange(size) + 1 + roll % (size - 1)) % size)
            start += size
    reference = torch.arange(sum(sizes)).repeat(rolls)
    return reference.to(device), torch.cat(partners).to(device)
