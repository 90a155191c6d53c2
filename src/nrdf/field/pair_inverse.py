"""C of the general field: where the tokens of each of two shapes are on the other one.

Five looks, each of attention to the own shape and to the other one around the places found so far
(`nrdf.field.general` says how that maps to the paper).
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import torch
from torch import Tensor, nn
from torch.nn import functional

from nrdf.field.tokens import squared_distances

_OCTAVES = 4
_KEYS = 64
_OFFSET = 0.1  # canonical length that one unit of a predicted offset counts for


class Tokens(NamedTuple):
    """Encoded shapes: points, normals (b, t, 3), features (b, t, c), low, high (b, 3)."""

    points: Tensor
    normals: Tensor
    features: Tensor
    low: Tensor
    high: Tensor


class Places(NamedTuple):
    """Where tokens (b, t) of one shape are on another: points (b, t, 3), log_error and existence
    (b, t) as of `Inverse`; looks: the points of each look, the last one included; matches (b, t, u)
    log probability of each of the other shape's tokens."""

    points: Tensor
    log_error: Tensor
    existence: Tensor
    looks: tuple[Tensor, ...]
    matches: Tensor


class PairInverse(nn.Module):
    """C: where the tokens of each shape of a pair are on the other one."""

    def __init__(self, features: int, width: int, heads: int, looks: int) -> None:
        super().__init__()
        place = 3 + 6 * _OCTAVES
        self.enter = nn.Linear(features + 3 * place + 6, width)
        self.mix = nn.Sequential(
            nn.LayerNorm(width),
            nn.Linear(width, 2 * width),
            nn.GELU("tanh"),
            nn.Linear(2 * width, width),
        )
        self.looks = nn.ModuleList(Look(width, heads) for _ in range(looks))
        self.key = nn.Linear(width, _KEYS)
        self.match_scale = nn.Parameter(torch.tensor([2.0, 4.0]))
        self.leave = nn.Linear(width, 6)
        nn.init.zeros_(self.leave.weight)
        nn.init.zeros_(self.leave.bias)
        with torch.no_grad():
            self.leave.bias[4:] = torch.tensor([-2.5, 2.0])

    def forward(self, first: Tokens, second: Tokens) -> tuple[Places, Places]:
        """Both directions are one batch: the first b rows lead there, the other b back."""
        pairs = len(first.points)

        def swap(values: Tensor) -> Tensor:
            return torch.cat([values[pairs:], values[:pairs]])

        here = Tokens(*(torch.cat(values) for values in zip(first, second, strict=True)))
        there = Tokens(*map(swap, here))
        x, place = self._enter(here, there)
        own = squared_distances(here.points, here.points)
        facing = 1 - here.normals @ there.normals.transpose(1, 2)
        looks = []
        for look in self.looks:
            # A look learns from its own error alone: steadier, as in RAFT (Teed and Deng 2020).
            place = place.detach()
            x, place = look(x, swap, place, there, own, facing)
            looks.append(place)
        x = functional.layer_norm(x, x.shape[-1:])
        key, place = self.key(x), place.detach()
        alike = (key @ swap(key).transpose(1, 2)).float() * (self.match_scale[0].exp() / _KEYS)
        far = self.match_scale[1].exp() * squared_distances(place, there.points)
        matches = (alike - far).log_softmax(-1)
        out = self.leave(x).float()
        matched = matches.exp() @ there.points
        place = place + out[..., 3:4].sigmoid() * (matched - place) + _OFFSET * out[..., :3]
        looks.append(place)
        both = Places(place, out[..., 4], out[..., 5], tuple(looks), matches)
        return _rows(both, slice(None, pairs)), _rows(both, slice(pairs, None))

    def _enter(self, here: Tokens, there: Tokens) -> tuple[Tensor, Tensor]:
        """Tokens (b, t, width), and where the search begins."""
        low, high = here.low[:, None], here.high[:, None]
        size = (high - low).clamp_min(1e-3)
        relative = 2 * (here.points - low) / size - 1
        place = half_way(here.points, here, there)
        known = [encode_place(here.points), encode_place(relative), encode_place(place)]
        known += [here.normals, size.expand_as(here.points)]
        x = self.enter(torch.cat([here.features, torch.cat(known, -1).to(here.features)], -1))
        return x + self.mix(x), place


class Look(nn.Module):
    """Attention to the own shape, then to the other one around the places found so far."""

    def __init__(self, width: int, heads: int) -> None:
        super().__init__()
        self.heads, self.size = heads, width // heads
        self.norm_own, self.norm_other, self.norm = (nn.LayerNorm(width) for _ in range(3))
        self.own = nn.Linear(width, 3 * width)
        self.own_out = nn.Linear(width, width)
        self.ask = nn.Linear(width, width)
        self.answer = nn.Linear(width, 2 * width)
        self.other_out = nn.Linear(width + 6 * heads, width)
        self.widen, self.narrow = nn.Linear(width, 2 * width), nn.Linear(2 * width, width)
        # Logarithms of what a squared distance, or a turn of the normal, counts for in each head.
        self.own_distance = nn.Parameter(torch.linspace(0.0, 3.5, heads))
        self.other_distance = nn.Parameter(torch.linspace(1.5, 5.0, heads))
        self.other_normal = nn.Parameter(torch.full((heads,), 0.7))
        self.step, self.offset = nn.Linear(width, heads), nn.Linear(width, 3)
        for layer in (self.own_out, self.other_out, self.narrow):
            nn.init.normal_(layer.weight, std=0.01)
        nn.init.zeros_(self.step.weight)
        nn.init.constant_(self.step.bias, 0.08)
        nn.init.zeros_(self.offset.weight)
        nn.init.zeros_(self.offset.bias)

    def forward(
        self, x: Tensor, swap: Any, place: Tensor, there: Tokens, own: Tensor, facing: Tensor
    ) -> tuple[Tensor, Tensor]:
        """x (b, t, width) and the places (b, t, 3) after the look.

        own: squared distances (b, t, t) on the shape itself; facing: (b, t, t) 1 - cosine between
        the normals of its tokens and the other's.
        """
        q, k, v = map(self._split, self.own(self.norm_own(x)).chunk(3, -1))
        weights = self._attend(q, k, -_per_head(self.own_distance) * own[:, None])
        x = x + self.own_out((weights @ v).transpose(1, 2).flatten(2))

        y = self.norm_other(x)
        q = self._split(self.ask(y))
        k, v = map(self._split, self.answer(swap(y)).chunk(2, -1))
        distance = squared_distances(place, there.points)[:, None]
        bias = -_per_head(self.other_distance) * distance
        bias = bias - _per_head(self.other_normal) * facing[:, None]
        geometry = torch.cat([there.points, there.normals], -1)[:, None]
        geometry = geometry.expand(-1, self.heads, -1, -1).to(v.dtype)
        found = self._attend(q, k, bias) @ torch.cat([v, geometry], -1)
        message = found[..., : self.size].transpose(1, 2).flatten(2)
        towards = found[..., self.size : self.size + 3].float() - place[:, None]  # (b, h, t, 3)
        normal = found[..., self.size + 3 :].float()
        moves = torch.cat([4 * towards, normal], -1).transpose(1, 2).flatten(2)
        x = x + self.other_out(torch.cat([message, moves.to(message.dtype)], -1))

        x = x + self.narrow(functional.gelu(self.widen(self.norm(x)), approximate="tanh"))
        y = functional.layer_norm(x, x.shape[-1:])
        step = self.step(y).float()
        place = place + torch.einsum("bth,bhta->bta", step, towards)
        return x, place + _OFFSET * self.offset(y).float()

    def _split(self, values: Tensor) -> Tensor:
        """(b, heads, t, size) of (b, t, width)."""
        return values.unflatten(-1, (self.heads, -1)).transpose(1, 2)

    def _attend(self, q: Tensor, k: Tensor, bias: Tensor) -> Tensor:
        return (q @ k.transpose(-1, -2) * self.size**-0.5 + bias).softmax(-1)


def half_way(points: Tensor, source: Tokens, target: Tokens) -> Tensor:
    """Points (b, m, 3) of sources half-way to their copies in the targets' bounding boxes."""
    size = (source.high - source.low).clamp_min(1e-3)[:, None]
    wanted = (target.high - target.low).clamp_min(1e-3)[:, None]
    copy = (points - source.low[:, None]) / size * wanted + target.low[:, None]
    return (points + copy) / 2


def encode_place(points: Tensor) -> Tensor:
    """Coordinates (b, t, 3) with their sines and cosines at `_OCTAVES` frequencies."""
    octaves = math.pi * 2.0 ** torch.arange(_OCTAVES, device=points.device)
    turns = points[..., None] * octaves
    return torch.cat([points, turns.sin().flatten(-2), turns.cos().flatten(-2)], -1)


def _per_head(logarithms: Tensor) -> Tensor:
    return logarithms.exp()[None, :, None, None]


def _rows(both: Places, chosen: slice) -> Places:
    looks = tuple(look[chosen] for look in both.looks)
    return Places(
        both.points[chosen], both.log_error[chosen], both.existence[chosen], looks,
        both.matches[chosen],
    )  # fmt: skip
