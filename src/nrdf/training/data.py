"""Training shapes in memory, and batches drawn from them.

A batch is a function of (seed, step, rank) alone: a run that was interrupted sees the same batches
again, and every process of a distributed run draws its own.
"""

from __future__ import annotations

import logging
from collections import Counter
from collections.abc import Iterable, Sequence
from copy import copy
from dataclasses import dataclass
from fnmatch import fnmatch

import numpy as np
import torch
from torch import Tensor

from nrdf.errors import ConfigError, DataError
from nrdf.shapes.dataset import Shape, read_shape
from nrdf.training.augment import draw_deformation, draw_sample, sensor_noise
from nrdf.training.config import AugmentConfig, DataConfig
from nrdf.training.cuts import Cuts, draw_cuts
from nrdf.training.pools import find_pools, pairs
from nrdf.training.provenance import Entry
from nrdf.training.views import draw_views, view_bits, visible_extremes

log = logging.getLogger(__name__)

CANDIDATES = 4
"""Correspondences tried for each one that is wanted; those without confidence drop out."""


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


class ShapeDataset:
    """All shapes of one split, stacked on one device.

    Raises DataError when there are no shapes or a shape cannot be stacked, ConfigError when the
    pools leave a shape out.
    """

    def __init__(
        self, shapes: Iterable[Shape], config: DataConfig, device: torch.device | str = "cpu"
    ) -> None:
        self.config = config
        self.device = torch.device(device)
        self.names: list[str] = []
        self.sources: list[str] = []
        self.categories: set[str] = set()
        surface, normals, queries, occupancies = [], [], [], []
        groups: list[dict[str, tuple[Tensor, Tensor, Tensor]]] = []
        for shape in shapes:
            # Seeded by the name: a shape's stored points don't depend on what is loaded before it.
            rng = np.random.default_rng(list(shape.name.encode()))
            pick = _draw(rng, len(shape.surface_points), config.surface_points, shape.name)
            surface.append(_tensor(shape.surface_points, pick))
            normals.append(_tensor(shape.surface_normals, pick))
            pick = _draw(rng, len(shape.query_points), config.stored_queries, shape.name)
            queries.append(_tensor(shape.query_points, pick))
            occupancies.append(torch.from_numpy(np.asarray(shape.query_occupancies, bool)[pick]))
            groups.append(
                {
                    # Only lists of the same length correspond, so the length is part of the name.
                    f"{name}/{len(group.points)}": (
                        _tensor(group.points),
                        _tensor(group.normals),
                        _tensor(group.weight),
                    )
                    for name, group in shape.correspondences.items()
                }
            )
            self.names.append(shape.name)
            self.sources.append(shape.source)
            self.categories.add(shape.category)
        if not surface:
            raise DataError("no training shapes; prepare some (`nrdf prepare` or `nrdf synth`)")
        self.surface = torch.stack(surface).to(self.device)
        self.surface_normals = torch.stack(normals).to(self.device)
        self.extremes = torch.cat([self.surface.argmin(1), self.surface.argmax(1)], dim=1)
        self.view_bits: Tensor | None = None
        if config.augment.views > 0:
            self.view_bits = view_bits(self.surface, self.surface_normals)
        self.queries = torch.stack(queries).to(self.device)
        self.occupancies = torch.stack(occupancies).to(self.device)
        self._stack_groups(groups)
        self.pools = find_pools(self.sources, config.pools)

    def __len__(self) -> int:
        return len(self.names)

    def _stack_groups(self, groups: list[dict[str, tuple[Tensor, Tensor, Tensor]]]) -> None:
        """All groups of all shapes in one long list, and where each begins.

        A group that one shape alone holds joins nothing and is left out.
        """
        holders = Counter(name for held in groups for name in held)
        self.group_names = sorted(name for name, count in holders.items() if count > 1)
        offset = torch.full((len(groups), max(1, len(self.group_names))), -1, dtype=torch.long)
        parts: list[tuple[Tensor, Tensor, Tensor]] = []
        total = 0
        for row, held in enumerate(groups):
            for column, name in enumerate(self.group_names):
                if name in held:
                    offset[row, column] = total
                    parts.append(held[name])
                    total += len(held[name][0])
        sizes = [int(name.rpartition("/")[2]) for name in self.group_names] or [1]
        exact = [
            any(fnmatch(name.rpartition("/")[0], pattern) for pattern in self.config.exact_groups)
            for name in self.group_names
        ] or [False]
        nothing = (torch.zeros(1, 3), torch.zeros(1, 3), torch.zeros(1))
        columns = list(zip(*(parts or [nothing]), strict=True))
        self.group_offset = offset.to(self.device)
        self.group_size = torch.tensor(sizes, device=self.device)
        self.group_exact = torch.tensor(exact, device=self.device)
        self.group_points = torch.cat(columns[0]).to(self.device)
        self.group_normals = torch.cat(columns[1]).to(self.device)
        self.group_weight = torch.cat(columns[2]).to(self.device)

    def with_pools(self, shares: dict[str, float] | None) -> ShapeDataset:
        """The same shapes in other shares; itself where `shares` is None.

        Raises ConfigError when the pools leave a shape out.
        """
        if shares is None:
            return self
        other = copy(self)
        other.pools = find_pools(self.sources, shares)
        return other

    def plain(self) -> dict[str, ShapeDataset]:
        """By pool, the same shapes without deformation or noise; pools of one are left out."""
        config = self.config.model_copy(
            update={"augment": AugmentConfig(), "rolls": 1, "correspondences": 256}
        )
        found = {}
        for pattern, _, members in self.pools:
            if len(members) > 1:
                found[pattern] = copy(self)
                found[pattern].config = config
                found[pattern].view_bits = None
                found[pattern].pools = [(pattern, 1.0, members)]
        return found

    def pool_sizes(self, batch_size: int) -> list[int]:
        """How many shapes of a batch come from each pool.

        Raises ConfigError when a pool would give fewer than two (a shape is never paired with
        itself).
        """
        shares = np.array([share for _, share, _ in self.pools])
        exact = batch_size * shares / shares.sum()
        sizes = np.floor(exact).astype(int)
        for index in np.argsort(sizes - exact, kind="stable")[: batch_size - sizes.sum()]:
            sizes[index] += 1
        sizes = np.minimum(sizes, [len(members) for _, _, members in self.pools])
        for size, (pattern, _, members) in zip(sizes, self.pools, strict=True):
            if size < 2:
                raise ConfigError(
                    f"a batch of {batch_size} takes {size} of the {len(members)} shapes of pool "
                    f"'{pattern}', and a pair needs two; raise the batch size or the pool's share, "
                    "or add shapes"
                )
        return [int(size) for size in sizes]

    def draw_shapes(
        self, batch_size: int, seed: int, step: int, rank: int, world: int
    ) -> tuple[Tensor, Tensor]:
        """Which shapes (b,) a batch holds, and which pool (b,) each is from.

        Each pool goes through its shapes in an order that is shuffled anew every time round; the
        few that do not fill a last batch wait for the next round.
        """
        chosen, pool_of = [], []
        for number, size in enumerate(self.pool_sizes(batch_size)):
            members = self.pools[number][2]
            per_round = max(1, len(members) // (size * world))
            order = torch.randperm(
                len(members),
                generator=seeded(torch.device("cpu"), seed, number, step // per_round),
            )
            start = ((step % per_round) * world + rank) * size % len(members)
            take = order.roll(-start)[:size]
            chosen.append(torch.as_tensor(members)[take])
            pool_of.append(torch.full((size,), number))
        return torch.cat(chosen).to(self.device), torch.cat(pool_of).to(self.device)

    def steps_per_epoch(self, batch_size: int, world: int = 1) -> int:
        """Steps in which as many shapes are seen as there are."""
        return max(1, len(self) // (sum(self.pool_sizes(batch_size)) * world))

    def batch(self, batch_size: int, seed: int, step: int, rank: int = 0, world: int = 1) -> Batch:
        """The batch of one step: at most `batch_size` shapes, each paired `rolls` times."""
        config = self.config
        generator = seeded(self.device, seed, step, rank)
        chosen, pool_of = self.draw_shapes(batch_size, seed, step, rank, world)
        reference, partner = pairs(self.pool_sizes(batch_size), config.rolls, self.device)
        surface = self.surface[chosen]
        mirror = torch.ones(len(self.pools), device=self.device)
        if config.augment.mirror:
            coin = torch.rand(len(self.pools), generator=generator, device=self.device)
            mirror = torch.where(coin < 0.5, -mirror, mirror)
        deform = draw_deformation(config.augment, surface, mirror[pool_of], generator)

        visible, extremes, cuts = None, self.extremes[chosen], None
        if config.augment.cut > 0:
            cuts = draw_cuts(surface, config.augment.cut, generator)
            visible = cuts.keep(surface)
            deform = deform.recanonicalised(cuts.kept(surface))
        if self.view_bits is not None:
            seen = draw_views(self.view_bits[chosen], config.augment.views, generator)
            deform = deform.misframed(config.augment.view_frame, ~seen.all(1), generator)
            visible = seen if visible is None else _both(seen, visible)
        if visible is not None:
            extremes = visible_extremes(surface, visible)
        count = min(config.encoder_points, surface.shape[1])
        sample = draw_sample(config.augment, surface, count, generator, visible)
        if count > 6:  # as at inference: the embedding must know the bounding box exactly
            sample = torch.cat([extremes, sample[:, 6:]], dim=1)
        rows = torch.arange(len(chosen), device=self.device)[:, None]
        points, normals = surface[rows, sample], self.surface_normals[chosen[:, None], sample]
        clean_points, clean_normals = deform.points(points), deform.normals(points, normals)
        points, normals = sensor_noise(config.augment, clean_points, clean_normals, generator)

        pick = torch.randint(
            self.queries.shape[1],
            (len(chosen), config.queries),
            generator=generator,
            device=self.device,
        )
        places = self.queries[chosen[:, None], pick]
        queries = deform.points(places)
        occupancy = self.occupancies[chosen[:, None], pick].float()
        if cuts is not None:
            occupancy = occupancy * cuts.keep(places)

        a, b, weight, known = self._draw_correspondences(
            chosen[reference],
            chosen[partner],
            generator,
            None if cuts is None else (cuts.select(reference), cuts.select(partner)),
        )
        on_a, on_b = deform.select(reference), deform.select(partner)
        return Batch(
            points=points,
            normals=normals,
            clean_points=clean_points,
            clean_normals=clean_normals,
            queries=queries,
            occupancy=occupancy,
            reference=reference,
            partner=partner,
            source=on_a.points(self.group_points[a]),
            source_normals=on_a.normals(self.group_points[a], self.group_normals[a]),
            target=on_b.points(self.group_points[b]),
            target_normals=on_b.normals(self.group_points[b], self.group_normals[b]),
            weight=weight,
            known=known,
        )

    def _draw_correspondences(
        self,
        first: Tensor,
        second: Tensor,
        generator: torch.Generator,
        cuts: tuple[Cuts, Cuts] | None = None,
    ) -> tuple[Tensor, Tensor, Tensor, Tensor]:
        """Rows (p, m) into the long list on shapes first (p,) and second (p,), weights (p, m), and
        whether the weight tells if there is such a place, (p, m). A pair that shares no group has
        weight 0 throughout. cuts: of the first and the second shapes.
        """
        pairs, wanted = len(first), self.config.correspondences
        offset_a, offset_b = self.group_offset[first], self.group_offset[second]  # (p, g)
        shared = (offset_a >= 0) & (offset_b >= 0)
        luck = torch.rand(shared.shape, generator=generator, device=self.device)
        score, group = torch.where(shared, luck, -1.0).max(dim=1)
        joined = (score >= 0)[:, None]
        offset_a = offset_a.gather(1, group[:, None]).clamp_min(0)
        offset_b = offset_b.gather(1, group[:, None]).clamp_min(0)
        exact = self.group_exact[group][:, None] & joined

        luck = torch.rand(
            pairs, max(1, wanted * CANDIDATES), generator=generator, device=self.device
        )
        index = (luck * self.group_size[group][:, None]).long()
        # Rounding can reach the end of the list.
        index = torch.minimum(index, self.group_size[group][:, None] - 1)
        index = torch.where(joined, index, 0)
        a, b = offset_a + index, offset_b + index
        threshold = self.config.weight_threshold
        on_source, on_target = self.group_weight[a], self.group_weight[b]
        lost = torch.zeros_like(joined)
        if cuts is not None:
            on_source = on_source * cuts[0].keep(self.group_points[a])
            kept = cuts[1].keep(self.group_points[b])
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
        return tuple(values.gather(1, order) for values in (a, b, weight, known))  # type: ignore


def _both(seen: Tensor, kept: Tensor) -> Tensor:
    """What is seen of what is kept, (b, n) bool; all that is kept where that is nothing."""
    both = seen & kept
    return both | (kept & ~both.any(1, keepdim=True))


def _draw(rng: np.random.Generator, available: int, wanted: int, name: str) -> np.ndarray:
    """Indices (wanted,), in random order, repeated only when there are too few."""
    if available == 0:
        raise DataError(f"shape '{name}' has no points; prepare it again")
    order = rng.permutation(available)
    return np.resize(order, wanted)


def _tensor(values: np.ndarray, pick: np.ndarray | None = None) -> Tensor:
    chosen = values if pick is None else values[pick]
    return torch.from_numpy(np.array(chosen, dtype=np.float32))


def load_bank(
    entries: Sequence[Entry], split: str, config: DataConfig, device: torch.device | str
) -> ShapeDataset:
    """The shapes of one split (train, val, test) in memory (errors: `read_shape`,
    `ShapeDataset`)."""
    return ShapeDataset((read_shape(e.path) for e in entries if e.split == split), config, device)
