"""Which shapes meet in a batch: pools of shapes by their source, each with a share."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from fnmatch import fnmatch
from typing import NamedTuple

import numpy as np
import torch
from torch import Tensor

from nrdf.errors import ConfigError
from nrdf.training.batch import seeded

log = logging.getLogger(__name__)


class Pool(NamedTuple):
    """Shapes that are paired with each other: pattern of their sources, share of each batch, and
    their numbers in the data set."""

    pattern: str
    share: float
    members: list[int]


def find_pools(sources: list[str], shares: dict[str, float]) -> list[Pool]:
    """The pools that have members, for patterns of sources with their shares (first match counts).

    Raises ConfigError when a source belongs to none.
    """
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
    return [Pool(p, share, members[p]) for p, share in patterns.items() if members[p] and share > 0]


def pool_sizes(pools: Sequence[Pool], batch_size: int) -> list[int]:
    """How many shapes of a batch come from each pool.

    Raises ConfigError when a pool would give fewer than two (a shape is never paired with
    itself).
    """
    shares = np.array([pool.share for pool in pools])
    exact = batch_size * shares / shares.sum()
    sizes = np.floor(exact).astype(int)
    for index in np.argsort(sizes - exact, kind="stable")[: batch_size - sizes.sum()]:
        sizes[index] += 1
    sizes = np.minimum(sizes, [len(pool.members) for pool in pools])
    for size, pool in zip(sizes, pools, strict=True):
        if size < 2:
            raise ConfigError(
                f"a batch of {batch_size} takes {size} of the {len(pool.members)} shapes of pool "
                f"'{pool.pattern}', and a pair needs two; raise the batch size or the pool's "
                "share, or add shapes"
            )
    return [int(size) for size in sizes]


def draw_shapes(
    pools: Sequence[Pool], batch_size: int, seed: int, step: int, rank: int, world: int
) -> tuple[Tensor, Tensor]:
    """Which shapes (b,) a batch holds, and the number of the pool (b,) that each is from.

    Each pool goes through its shapes in an order that is shuffled anew every time round; the
    few that do not fill a last batch wait for the next round.
    """
    chosen, pool_of = [], []
    for number, size in enumerate(pool_sizes(pools, batch_size)):
        members = pools[number].members
        per_round = max(1, len(members) // (size * world))
        order = torch.randperm(
            len(members),
            generator=seeded(torch.device("cpu"), seed, number, step // per_round),
        )
        start = ((step % per_round) * world + rank) * size % len(members)
        take = order.roll(-start)[:size]
        chosen.append(torch.as_tensor(members)[take])
        pool_of.append(torch.full((size,), number))
    return torch.cat(chosen), torch.cat(pool_of)
