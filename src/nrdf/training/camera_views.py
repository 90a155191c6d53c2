"""Clouds as depth cameras see training shapes, for the small networks that are shown scans.

Which points of a shape a camera sees is worked out once for a ring of cameras, and kept as a bit a
camera; a step draws cameras, noise, and what else befalls a scan.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor
from torch.nn import functional

from nrdf.errors import DataError
from nrdf.geometry.visibility import seen_from
from nrdf.shapes.dataset import read_shape
from nrdf.training.provenance import Entry

_AROUND, _ELEVATIONS = 16, np.radians([12.0, 25.0, 40.0])
CAMERAS = np.array(
    [
        [np.cos(e) * np.cos(a), np.sin(e), np.cos(e) * np.sin(a)]
        for a in 2 * np.pi / _AROUND * np.arange(_AROUND)
        for e in _ELEVATIONS
    ]
)
"""(48, 3) directions that cameras look from, three elevations at each azimuth."""
SURFACE_POINTS = 4096  # that are kept of each shape
_VIEWS = torch.tensor([0, 1, 1, 1, 2, 3, 3, 4])  # drawn alike; 0 is the whole surface
_HELD_OUT = 10  # one in so many shapes of each source tells how well others are done


@dataclass(frozen=True)
class Views:
    """points, normals: (s, n, 3) of shapes; bits: (s, n) int64, bit i where camera i sees it."""

    points: Tensor
    normals: Tensor
    bits: Tensor

    def __len__(self) -> int:
        return len(self.points)


def split(entries: Sequence[Entry]) -> tuple[list[Entry], list[Entry]]:
    """Shapes to train on, and to validate with: every tenth of a source and those of the `val`
    split. The `test` split is in neither."""
    count: dict[str, int] = {}
    kept: list[Entry] = []
    held: list[Entry] = []
    for entry in entries:
        if entry.split == "test":
            continue
        count[entry.source] = count.get(entry.source, 0) + 1
        last = count[entry.source] % _HELD_OUT == 0
        (held if last or entry.split == "val" else kept).append(entry)
    return kept, held


def join(parts: Sequence[Views]) -> Views:
    """All shapes of several, in order."""
    names = ("points", "normals", "bits")
    return Views(*(torch.cat([getattr(part, name) for part in parts]) for name in names))


def load_views(entries: Sequence[Entry], category: str | None = None) -> Views:
    """Shapes as their cameras see them. Raises DataError for a shape of another category."""
    found = []
    for entry in entries:
        shape = read_shape(entry.path)
        if category is not None and shape.category != category:
            raise DataError(f"{entry.path} is of the category '{shape.category}', not '{category}'")
        found.append((shape.surface_points, shape.surface_normals))
    return views_of(found)


def views_of(surfaces: Iterable[tuple[np.ndarray, np.ndarray]]) -> Views:
    """Surfaces, each points (., 3) and outward normals, canonical, as their cameras see them."""
    found: list[tuple[np.ndarray, np.ndarray, np.ndarray]] = []
    power = 1 << np.arange(len(CAMERAS), dtype=np.int64)
    for points, normals in surfaces:
        rng = np.random.default_rng(0)
        drawn = rng.choice(len(points), SURFACE_POINTS, len(points) < SURFACE_POINTS)
        points, normals = points[drawn], normals[drawn]
        seen = seen_from(points, normals, CAMERAS, steepest=math.sin(math.radians(12)))
        found.append((points, normals, power @ seen.astype(np.int64)))
    points, normals, bits = (np.stack(part) for part in zip(*found, strict=True))
    return Views(
        torch.as_tensor(points, dtype=torch.float32),
        torch.as_tensor(normals, dtype=torch.float32),
        torch.as_tensor(bits),
    )


def draw_seen(
    views: Views, chosen: Tensor, count: int, noise: float, generator: torch.Generator
) -> tuple[Tensor, Tensor]:
    """Clouds (b, count, 3) of the shapes `chosen` (b,), upright, and their normals.

    Shapes are stretched by up to a fifth and mirrored; seen by up to four cameras, or whole; the
    lowest of what is seen may go with the floor, and an end of it may be missing.
    """
    b = len(chosen)

    def uniform(*shape: int) -> Tensor:
        return torch.rand(shape, generator=generator)

    points, normals = views.points[chosen], views.normals[chosen]
    seen = _seen(views.bits[chosen], generator)
    stretch = torch.exp(0.2 * (2 * uniform(b, 1, 3) - 1))
    stretch[..., 2] *= torch.where(uniform(b, 1) < 0.5, -1.0, 1.0)
    points, normals = points * stretch, normals / stretch
    # The floor takes the lowest with it, and now and then an end is missing.
    height = points[..., 1] - points[..., 1].amin(1, keepdim=True)
    slab = 0.03 * uniform(b, 1) * (uniform(b, 1) < 0.7)
    away = functional.normalize(torch.randn(b, 1, 3, generator=generator), dim=-1)
    along = (points * away).sum(-1)
    limit = along.masked_fill(~seen, math.nan).nanquantile(0.75, dim=1, keepdim=True)
    whole = (along < limit) | (uniform(b, 1) < 0.85)
    kept = seen & (height > slab) & whole
    kept |= ~kept.any(1, keepdim=True)
    index = torch.multinomial(kept.float() + 1e-9 * ~kept, count, True, generator=generator)
    rows = torch.arange(b)[:, None]
    points, normals = points[rows, index], normals[rows, index]
    points = points + noise * torch.randn(points.shape, generator=generator)
    normals = normals + 0.1 * torch.randn(normals.shape, generator=generator)
    # Estimated normals are wrong here and there: of some clouds a part points inwards.
    inward = (uniform(b, count) < 0.15 * uniform(b, 1)) & (uniform(b, 1) < 0.3)
    normals = functional.normalize(normals, dim=-1) * torch.where(inward, -1.0, 1.0)[..., None]
    return points, normals


def _seen(bits: Tensor, generator: torch.Generator) -> Tensor:
    """(b, n) bool: what up to four cameras around each shape see of it."""
    b = len(bits)
    count = _VIEWS[torch.randint(len(_VIEWS), (b, 1), generator=generator)]
    first = torch.randint(_AROUND, (b, 1), generator=generator)
    number = torch.arange(int(_VIEWS.max()))
    apart = (number * _AROUND / count.clamp(min=1)).round().long()
    apart += torch.randint(-1, 2, (b, len(number)), generator=generator)
    height = torch.randint(len(_ELEVATIONS), (b, len(number)), generator=generator)
    camera = (first + apart) % _AROUND * len(_ELEVATIONS) + height
    masks = torch.bitwise_left_shift(torch.ones((), dtype=torch.int64), camera)
    masks = masks * (number < count)
    return (bits[..., None] & masks[:, None]).ne(0).any(-1) | (count == 0)
