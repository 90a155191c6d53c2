"""Training shapes in memory, and batches drawn from them.

A batch is a function of (seed, step, rank) alone: a run that was interrupted sees the same batches
again, and every process of a distributed run draws its own.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from copy import copy

import numpy as np
import torch
from torch import Tensor

from nrdf.errors import DataError
from nrdf.shapes.dataset import Correspondence, Shape, read_shape
from nrdf.training.augment import draw_deformation, draw_sample, sensor_noise
from nrdf.training.batch import Batch, pair_up, seeded
from nrdf.training.config import AugmentConfig, DataConfig, Stage
from nrdf.training.correspondences import CorrespondenceGroups, to_tensor
from nrdf.training.cuts import draw_cuts
from nrdf.training.pools import draw_shapes, find_pools, pool_sizes
from nrdf.training.provenance import Entry
from nrdf.training.views import draw_views, view_bits, visible_extremes


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
        groups: list[dict[str, Correspondence]] = []
        for shape in shapes:
            # Seeded by the name: a shape's stored points don't depend on what is loaded before it.
            rng = np.random.default_rng(list(shape.name.encode()))
            pick = _draw(rng, len(shape.surface_points), config.surface_points, shape.name)
            surface.append(to_tensor(shape.surface_points, pick))
            normals.append(to_tensor(shape.surface_normals, pick))
            pick = _draw(rng, len(shape.query_points), config.stored_queries, shape.name)
            queries.append(to_tensor(shape.query_points, pick))
            occupancies.append(torch.from_numpy(np.asarray(shape.query_occupancies, bool)[pick]))
            groups.append(shape.correspondences)
            self.names.append(shape.name)
            self.sources.append(shape.source)
            self.categories.add(shape.category)
        if not surface:
            raise DataError(
                "no training shapes; prepare some (`nrdf model prepare` or `nrdf model synth`)"
            )
        self.surface = torch.stack(surface).to(self.device)
        self.surface_normals = torch.stack(normals).to(self.device)
        self.extremes = torch.cat([self.surface.argmin(1), self.surface.argmax(1)], dim=1)
        self.view_bits: Tensor | None = None
        if config.augment.views > 0:
            self.view_bits = view_bits(self.surface, self.surface_normals)
        self.queries = torch.stack(queries).to(self.device)
        self.occupancies = torch.stack(occupancies).to(self.device)
        self.groups = CorrespondenceGroups(groups, config.exact_groups, self.device)
        self.pools = find_pools(self.sources, config.pools)

    def __len__(self) -> int:
        return len(self.names)

    def for_stage(self, stage: Stage) -> ShapeDataset:
        """The same shapes as a stage draws them: in its shares, its points and queries.

        Raises ConfigError when its pools leave a shape out.
        """
        other = copy(self)
        own = {name: getattr(stage, name) for name in ("encoder_points", "queries", "inside")}
        other.config = self.config.model_copy(
            update={name: value for name, value in own.items() if value is not None}
        )
        if stage.pools is not None:
            other.pools = find_pools(self.sources, stage.pools)
        return other

    def plain(self) -> dict[str, ShapeDataset]:
        """By pool, the same shapes without deformation or noise; pools of one are left out."""
        config = self.config.model_copy(
            update={
                "augment": AugmentConfig(),
                "rolls": 1,
                "correspondences": 256,
                "inside": None,
            }
        )
        found = {}
        for pool in self.pools:
            if len(pool.members) > 1:
                found[pool.pattern] = copy(self)
                found[pool.pattern].config = config
                found[pool.pattern].view_bits = None
                found[pool.pattern].pools = [pool._replace(share=1.0)]
        return found

    def pool_sizes(self, batch_size: int) -> list[int]:
        """How many shapes of a batch come from each pool (errors: `nrdf.training.pools`)."""
        return pool_sizes(self.pools, batch_size)

    def steps_per_epoch(self, batch_size: int, world: int = 1) -> int:
        """Steps in which as many shapes are seen as there are."""
        return max(1, len(self) // (sum(self.pool_sizes(batch_size)) * world))

    def batch(self, batch_size: int, seed: int, step: int, rank: int = 0, world: int = 1) -> Batch:
        """The batch of one step: at most `batch_size` shapes, each paired `rolls` times."""
        config = self.config
        generator = seeded(self.device, seed, step, rank)
        drawn = draw_shapes(self.pools, batch_size, seed, step, rank, world)
        chosen, pool_of = (values.to(self.device) for values in drawn)
        reference, partner = pair_up(self.pool_sizes(batch_size), config.rolls, self.device)
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

        pick = self._draw_queries(chosen, generator)
        undeformed = self.queries[chosen[:, None], pick]
        queries = deform.points(undeformed)
        occupancy = self.occupancies[chosen[:, None], pick].float()
        if cuts is not None:
            occupancy = occupancy * cuts.keep(undeformed)

        places = self.groups.draw(
            chosen[reference],
            chosen[partner],
            config,
            generator,
            None if cuts is None else (cuts.select(reference), cuts.select(partner)),
        )
        a, b = places.first, places.second
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
            source=on_a.points(self.groups.points[a]),
            source_normals=on_a.normals(self.groups.points[a], self.groups.normals[a]),
            target=on_b.points(self.groups.points[b]),
            target_normals=on_b.normals(self.groups.points[b], self.groups.normals[b]),
            weight=places.weight,
            known=places.known,
        )

    def _draw_queries(self, chosen: Tensor, generator: torch.Generator) -> Tensor:
        """Which of their stored queries the chosen shapes (b,) are asked, (b, q)."""
        share, wanted, stored = self.config.inside, self.config.queries, self.queries.shape[1]
        if share is None:
            size = (len(chosen), wanted)
            return torch.randint(stored, size, generator=generator, device=self.device)
        inside = self.occupancies[chosen]
        count = inside.sum(1, keepdim=True)
        odds = torch.where(inside, share / count, (1.0 - share) / (stored - count))
        # Never all 0: a shape with nothing inside (or outside) is asked about what there is.
        return odds.clamp_min(1e-12).multinomial(wanted, replacement=True, generator=generator)


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


def load_dataset(
    entries: Sequence[Entry], split: str, config: DataConfig, device: torch.device | str
) -> ShapeDataset:
    """The shapes of one split (train, val, test) in memory (errors: `read_shape`,
    `ShapeDataset`)."""
    return ShapeDataset((read_shape(e.path) for e in entries if e.split == split), config, device)
