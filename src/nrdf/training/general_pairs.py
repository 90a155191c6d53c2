"""Pairs of shapes with exact truth for the general field, made anew in every step.

Two sources, half of a batch each: two members of one kind (`nrdf.shapes.families`: random
assemblies and parametric families), and two deformations of one surface. A pair has a frame in
common that need not be upright, as a category may stand or lie. One of the two may lack an end or
have something grown on, and both are seen as a scan sees them: as points with noise, whose normals
are turned, or wrong in a patch.
"""

from __future__ import annotations

import logging
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import torch
from torch import Tensor
from torch.nn import functional

from nrdf.shapes.families import Member, SurfaceCoordinates, get_family
from nrdf.shapes.families.assembly import Kind
from nrdf.training.part_warp import draw_part_warp

log = logging.getLogger(__name__)

POINTS = 1024
"""Of each cloud."""
MEMBERS = 4
"""Of each kind, or group of objects of one."""
_MILD, _STRONG = (0.02, 0.12), (0.05, 0.38)  # strength of warps, of members and of surfaces
_REFRAMED, _HEADED, _TILTED = 0.6, 0.25, 0.3  # shares of the pairs, and of the shapes
_TILT = 0.05  # rad, standard deviation
_CUT, _GROWN = 0.18, 0.15  # shares of the shapes
_NOISE, _NORMAL_NOISE, _FLIPPED = 0.006, 0.3, 0.15


class Side(NamedTuple):
    """One shape of each of b pairs: points, normals (b, n, 3); where they are on the other shape:
    true_points, true_normals (b, n, 3); exists (b, n) 1 where they are there, else 0."""

    points: Tensor
    normals: Tensor
    true_points: Tensor
    true_normals: Tensor
    exists: Tensor


class Groups(NamedTuple):
    """k groups of m = `MEMBERS` objects, and the places of the own n = `POINTS` points of all of
    them on each: points, normals (k, m, m · n, 3), float16; exists (k, m, m · n), bool."""

    points: np.ndarray
    normals: np.ndarray
    exists: np.ndarray


@dataclass(frozen=True)
class PairPool:
    """What pairs are made of, in half precision to fit into memory: `Groups` as tensors, and
    surfaces, surface_normals (s, p, 3)."""

    points: Tensor
    normals: Tensor
    exists: Tensor
    surfaces: Tensor
    surface_normals: Tensor


def make_pool(
    surfaces: Sequence[tuple[np.ndarray, np.ndarray]],
    kinds: int,
    families: Sequence[str],
    family_groups: int,
    seed: int,
    progress: Callable[[int, int], None] | None = None,
    others: Groups | None = None,
) -> PairPool:
    """Random kinds, groups of members of parametric families, other groups, and surfaces (points
    and normals (p, 3), as many of each)."""
    rng = np.random.default_rng(seed)
    groups = []
    wanted = [None] * kinds + [name for name in families for _ in range(family_groups)]
    for done, name in enumerate(wanted, 1):
        groups.append(_located(_kind(rng) if name is None else _family(name, rng), rng))
        if progress is not None:
            progress(done, len(wanted))
    made = [Groups(*(np.stack(values) for values in zip(*groups, strict=True)))] if groups else []
    every = zip(*made, *([] if others is None else [others]), strict=True)
    points, normals, exists = (torch.from_numpy(np.concatenate(values)) for values in every)
    half = np.array(surfaces, np.float16).reshape(len(surfaces), 2, -1 if surfaces else 0, 3)
    return PairPool(points, normals, exists, *torch.from_numpy(half).unbind(1))


def draw_pairs(pool: PairPool, count: int, generator: torch.Generator) -> tuple[Side, Side]:
    """`count` pairs, the first half of them of kinds."""
    rng = np.random.default_rng(int(torch.randint(2**62, (1,), generator=generator)))
    own, other, exists, members = _draw_places(pool, count, rng)
    frames = _draw_frames(count, rng)
    low, high = torch.where(
        (torch.arange(count) < members)[:, None], torch.tensor(_MILD), torch.tensor(_STRONG)
    ).T
    things = []
    for side in range(2):  # what is on a shape: its own points, then the other's places
        points, normals = (torch.cat([own[side][i], other[1 - side][i]], 1) for i in range(2))
        strength = low + (high - low) * torch.rand(count, generator=generator)
        warp = draw_part_warp(points[:, :POINTS], strength, generator)
        points, normals = warp.apply(points, normals)
        turn = frames @ _draw_tilts(count, generator)
        things.append((points @ turn, normals @ turn))
    for side in range(2):
        for row in range(count):
            if rng.random() < _CUT:
                _cut(things, exists, side, row, rng)
        for row in range(count):
            if rng.random() < _GROWN:
                _grow(things, exists, side, row, rng)
    boxes = [_canonical(points[:, :POINTS]) for points, _ in things]
    found = []
    for side in range(2):
        centre, size = boxes[side]
        points = (things[side][0][:, :POINTS] - centre) / size
        points, normals = _scanned(points, things[side][1][:, :POINTS], generator)
        centre, size = boxes[1 - side]
        true = (things[1 - side][0][:, POINTS:] - centre) / size
        found.append(Side(points, normals, true, things[1 - side][1][:, POINTS:], exists[side]))
    return found[0], found[1]


def _kind(rng: np.random.Generator) -> list[Member]:
    kind = Kind(rng)
    return [kind.member(rng) for _ in range(MEMBERS)]


def _family(name: str, rng: np.random.Generator) -> list[Member]:
    found: list[Member] = []
    while len(found) < MEMBERS:
        try:
            found.append(get_family(name).member(int(rng.integers(2**31))))
        except ValueError as error:  # a few seeds of a family have no member
            log.debug("%s: %s", name, error)
    return found


def _located(
    members: Sequence[Member], rng: np.random.Generator
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The places of all members' points on each member: points, normals (m, m · n, 3), exists."""
    listed = [member.sample_surface(POINTS, rng).coordinates for member in members]
    places = [member.locate(SurfaceCoordinates.concatenate(listed)) for member in members]
    points = np.stack([np.nan_to_num(place.points) for place in places])
    normals = np.stack([np.nan_to_num(place.normals) for place in places])
    exists = np.stack([place.exists for place in places])
    return points.astype(np.float16), normals.astype(np.float16), exists


def _draw_places(
    pool: PairPool, count: int, rng: np.random.Generator
) -> tuple[list[tuple[Tensor, Tensor]], list[tuple[Tensor, Tensor]], list[Tensor], int]:
    """For both sides the own points and normals (b, n, 3), their places on the other shape, and
    which of these exist (b, n); how many of the pairs are of members."""
    members = count // 2 if len(pool.points) else 0
    if not len(pool.surfaces):
        members = count
    own, other, exists = [], [], []
    kinds = torch.from_numpy(rng.integers(len(pool.points), size=members)) if members else None
    which = torch.from_numpy(np.stack([rng.permutation(MEMBERS)[:2] for _ in range(count)]))
    rows = torch.from_numpy(rng.integers(max(len(pool.surfaces), 1), size=count - members))
    for side in range(2):
        here, there = [], []
        there_is = [torch.ones(count - members, POINTS)]
        if kinds is not None:
            mine, its = which[:members, side], which[:members, 1 - side]
            block = mine[:, None] * POINTS + torch.arange(POINTS)
            here.append(
                [v[kinds[:, None], mine[:, None], block] for v in (pool.points, pool.normals)]
            )
            there.append(
                [v[kinds[:, None], its[:, None], block] for v in (pool.points, pool.normals)]
            )
            there_is.insert(0, pool.exists[kinds[:, None], its[:, None], block].float())
        if len(rows):
            size = pool.surfaces.shape[1]
            chosen = torch.from_numpy(np.stack([rng.permutation(size)[:POINTS] for _ in rows]))
            surface = [v[rows[:, None], chosen] for v in (pool.surfaces, pool.surface_normals)]
            here.append(surface)
            there.append(surface)
        own.append(_joined(here))
        other.append(_joined(there))
        exists.append(torch.cat(there_is))
    return own, other, exists, members


def _joined(parts: list[list[Tensor]]) -> tuple[Tensor, Tensor]:
    points, normals = (torch.cat(values).float() for values in zip(*parts, strict=True))
    return points, normals


def _draw_frames(count: int, rng: np.random.Generator) -> Tensor:
    """Rotations and mirror images (b, 3, 3) that a pair has in common."""
    frames = np.tile(np.eye(3), (count, 1, 1))
    for frame in frames:
        if rng.random() < _REFRAMED:
            frame[:] = np.eye(3)[rng.permutation(3)] * rng.choice([-1.0, 1.0], 3)
        if rng.random() < _HEADED:
            angle = rng.uniform(0, 2 * np.pi)
            cosine, sine = np.cos(angle), np.sin(angle)
            frame[:] = frame @ np.array([[cosine, 0, -sine], [0, 1, 0], [sine, 0, cosine]])
    return torch.from_numpy(frames).float()


def _draw_tilts(count: int, generator: torch.Generator) -> Tensor:
    """Small rotations (b, 3, 3) of some of the shapes."""
    angle = _TILT * torch.randn(count, 3, generator=generator)
    angle = angle * (torch.rand(count, 1, generator=generator) < _TILTED)
    skew = torch.zeros(count, 3, 3)
    skew[:, 0, 1], skew[:, 0, 2], skew[:, 1, 2] = angle.T
    return torch.linalg.matrix_exp(skew - skew.transpose(1, 2))


def _cut(
    things: list[tuple[Tensor, Tensor]],
    exists: list[Tensor],
    side: int,
    row: int,
    rng: np.random.Generator,
) -> None:
    """Take an end off a shape: its own points there are replaced by others of it."""
    axis, sign = int(rng.integers(3)), float(rng.choice([-1.0, 1.0]))
    along = things[side][0][row, :, axis] * sign
    low, high = along[:POINTS].min(), along[:POINTS].max()
    limit = low + (high - low) * rng.uniform(0.45, 0.92)
    kept = torch.nonzero(along[:POINTS] <= limit)[:, 0]
    if len(kept) <= POINTS // 4:
        return
    chosen = kept[torch.from_numpy(rng.integers(len(kept), size=POINTS))]
    chosen[: len(kept)] = kept
    for values in things[side]:
        values[row, :POINTS] = values[row, chosen]
    for values in things[1 - side]:  # where its own points are on the other shape
        values[row, POINTS:] = values[row, POINTS + chosen]
    exists[side][row] = exists[side][row, chosen]
    exists[1 - side][row] *= (along[POINTS:] <= limit).float()


def _grow(
    things: list[tuple[Tensor, Tensor]],
    exists: list[Tensor],
    side: int,
    row: int,
    rng: np.random.Generator,
) -> None:
    """Put a small copy of another shape of the batch onto a shape; it is nowhere on the other."""
    points, normals = things[side]
    count = int(POINTS * rng.uniform(0.05, 0.25))
    other = (row + 1 + int(rng.integers(max(len(points) - 1, 1)))) % len(points)
    source = torch.from_numpy(rng.permutation(POINTS)[:count])
    size = rng.uniform(0.15, 0.5) * np.exp(rng.normal(0, 0.4, 3))
    grown = points[other, source] - points[other, source].mean(0)
    at = points[row, int(rng.integers(POINTS))] + torch.from_numpy(rng.normal(0, 0.1, 3)).float()
    replaced = torch.from_numpy(rng.permutation(POINTS)[:count])
    points[row, replaced] = grown * torch.from_numpy(size).float() + at
    normals[row, replaced] = normals[other, source]
    exists[side][row, replaced] = 0.0


def _canonical(points: Tensor) -> tuple[Tensor, Tensor]:
    """Centre (b, 1, 3) and longest side (b, 1, 1) of the bounding boxes of (b, n, 3)."""
    low, high = points.amin(1, keepdim=True), points.amax(1, keepdim=True)
    return (low + high) / 2, (high - low).amax(2, keepdim=True)


def _scanned(points: Tensor, normals: Tensor, generator: torch.Generator) -> tuple[Tensor, Tensor]:
    """Points (b, n, 3) with noise; normals with more, and turned over in a patch of some shapes."""
    b = len(points)

    def uniform() -> Tensor:
        return torch.rand(b, 1, 1, generator=generator)

    noise = torch.randn(2, *points.shape, generator=generator)
    points = points + _NOISE * uniform() * noise[0]
    normals = normals + _NORMAL_NOISE * uniform().square() * noise[1]
    near = (points - points[:, :1]).norm(dim=-1, keepdim=True) < 0.15 * uniform()
    over = near & (uniform() < _FLIPPED)
    return points, functional.normalize(torch.where(over, -normals, normals), dim=-1)
