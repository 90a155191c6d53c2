"""Nearest neighbours, local normals and optimal assignment in plain PyTorch, chunked."""

from __future__ import annotations

import torch
from scipy.optimize import linear_sum_assignment
from torch import Tensor

from nrdf.field.tokens import gather

PAIRS_AT_ONCE = 1 << 24
"""Distances held in memory at a time (64 MiB of float32)."""
REST_BLOCK = 512
"""How many of those that an auction leaves over are assigned exactly at a time."""


def distances(a: Tensor, b: Tensor) -> Tensor:
    """Euclidean distances (b, n, m) between a (b, n, d) and b (b, m, d), in float32.

    Few dimensions are subtracted rather than expanded into a product: exact for near points.
    """
    mode = "donot_use_mm_for_euclid_dist" if a.shape[-1] <= 8 else "use_mm_for_euclid_dist"
    return torch.cdist(a.float(), b.float(), compute_mode=mode)


def with_normals(points: Tensor, normals: Tensor, weight: float) -> Tensor:
    """Features (x, λn) (..., 6): near in them means near in position *and* in normal."""
    return torch.cat([points, weight * normals], dim=-1)


def _chunks(rows: int, columns: int, batch: int) -> list[slice]:
    step = max(1, PAIRS_AT_ONCE // max(1, columns * batch))
    return [slice(start, min(start + step, rows)) for start in range(0, rows, step)]


@torch.no_grad()
def nearest_indices(query: Tensor, reference: Tensor) -> Tensor:
    """Index (b, n) of the nearest of reference (b, m, d) to each of query (b, n, d)."""
    b, n, _ = query.shape
    found = [
        distances(query[:, rows], reference).min(dim=2).indices
        for rows in _chunks(n, reference.shape[1], b)
    ]
    return torch.cat(found, dim=1)


@torch.no_grad()
def neighbour_indices(query: Tensor, reference: Tensor, count: int) -> Tensor:
    """Indices (b, n, count) of the nearest `count` of reference (b, m, d), nearest first."""
    b, n, _ = query.shape
    found = [
        distances(query[:, rows], reference).topk(count, dim=2, largest=False).indices
        for rows in _chunks(n, reference.shape[1], b)
    ]
    return torch.cat(found, dim=1)


def nearest_distance(query: Tensor, reference: Tensor, squared: bool = False) -> Tensor:
    """Distance (b, n) from query (b, n, d) to its nearest in reference (b, m, d).

    Which one is nearest is found without gradient; the distance to it has one, to both sides.
    """
    difference = query - gather(reference, nearest_indices(query, reference))
    square = difference.float().square().sum(-1)
    return square if squared else (square + 1e-12).sqrt()


def nearest_both_ways(a: Tensor, b: Tensor) -> tuple[Tensor, Tensor]:
    """Distance (b, n) from each of a (b, n, d) to its nearest in b (b, m, d), and (b, m) from each
    of b to its nearest in a; d is large.

    Which are nearest is found for both at once, without gradient, in the precision that the values
    have.
    """
    with torch.no_grad():
        # What all have in common would drown the differences in the product's rounding.
        common = b.float().mean(dim=1, keepdim=True)
        x, y = (a - common).to(a.dtype), (b - common).to(b.dtype)
        apart = (x @ y.transpose(1, 2)).float().mul_(-2)
        apart += x.float().square().sum(-1)[..., None]
        apart += y.float().square().sum(-1)[:, None]
        there, back = apart.min(dim=2).indices, apart.min(dim=1).indices

    def measure(difference: Tensor) -> Tensor:
        return (difference.float().square().sum(-1) + 1e-12).sqrt()

    return measure(a - gather(b, there)), measure(b - gather(a, back))


def distances_to(values: Tensor, rows: Tensor, others: Tensor) -> Tensor:
    """Distances (b, r, k) from values (b, c, d) at `rows` (r,) to those at `others` (b, r, k).

    By products of all pairs, |x|² + |y|² − 2 x·y in float32, about the mean: gathering the others'
    values would take k·d numbers a row, which for descriptors is most of a training step.
    """
    values = values.float()
    values = values - values.mean(dim=1, keepdim=True)
    with torch.autocast(values.device.type, enabled=False):
        norms = values.square().sum(-1)
        product = values[:, rows] @ values.transpose(1, 2)
        square = norms[:, rows, None] + norms[:, None] - 2 * product
    return (square.gather(2, others).clamp_min(0) + 1e-12).sqrt()


def local_normals(
    points: Tensor,
    rows: Tensor | None = None,
    neighbours: int = 16,
    towards: Tensor | None = None,
) -> Tensor:
    """Unit normals (b, r, 3) of points (b, n, 3), of those at `rows` (r,) if given, from the plane
    through their neighbours.

    The normal is the covariance's eigenvector of least eigenvalue. Its derivative is written as
    first-order perturbation with the eigenvalue gaps bounded from below, because the derivative
    of `eigh` is infinite where two eigenvalues meet (lines, corners). Signs are those that agree
    with `towards` (b, r, 3), or arbitrary.
    """
    points = points.float()
    asked = points if rows is None else points[:, rows]
    indices = neighbour_indices(asked, points, min(neighbours, points.shape[1]))
    around = gather(points, indices)
    around = around - around.mean(dim=2, keepdim=True)
    covariance = around.transpose(2, 3) @ around
    values, vectors = torch.linalg.eigh(covariance.detach().double())
    values, vectors = values.float(), vectors.float()
    normal = vectors[..., 0]
    gap = values[..., 1:] - values[..., :1] + 0.01 * values[..., 2:] + 1e-9
    # (b, n, 2): zero in value, but its derivative turns the normal towards the other axes.
    turn = torch.einsum("bnij,bnjk,bni->bnk", covariance, vectors[..., 1:], normal) / gap
    turn = turn - turn.detach()
    normal = normal - torch.einsum("bnik,bnk->bni", vectors[..., 1:], turn)
    if towards is not None:
        sign = (normal.detach() * towards).sum(-1, keepdim=True)
        normal = torch.where(sign < 0, -normal, normal)
    return torch.nn.functional.normalize(normal, dim=-1)


@torch.no_grad()
def assign(a: Tensor, b: Tensor, eps: float = 0.005, iterations: int = 50) -> Tensor:
    """A bijection (b, n) from a (b, n, 3) to b (b, n, 3) of nearly least total distance.

    Auction (Bertsekas 1988), all batch elements at once: every bidder without an object bids for
    its best one, by what it is better than its second best plus `eps`; the highest bid takes the
    object. Those left after `iterations` rounds share the objects left (`_assign_rest`). The mean
    distance is within `eps` of the optimum once the auction has ended, which takes some 1000 rounds
    for 1000 unrelated points; after 50 it is 1 to 20 % too large.
    """
    count, n, _ = a.shape
    if b.shape != a.shape:
        raise ValueError(f"a bijection needs equal sizes; {tuple(a.shape)} and {tuple(b.shape)}")
    if n == 1:
        return torch.zeros(count, 1, dtype=torch.long, device=a.device)
    cost = distances(a, b).reshape(count * n, n)
    # Any prices may start a symmetric auction. These keep a cloud that is still shrunk to a point
    # from bidding for one object at a time.
    price = -cost.view(count, n, n).mean(dim=1).flatten()
    owner = torch.full((count * n,), -1, dtype=torch.long, device=a.device)
    chosen = torch.full((count * n,), -1, dtype=torch.long, device=a.device)
    for _ in range(iterations):
        bidder = (chosen < 0).nonzero().squeeze(1)
        if len(bidder) == 0:
            break
        element = bidder // n
        wanted, margin = _best_objects(cost, price.view(count, n), bidder, element)
        wanted = wanted + element * n
        bid = price[wanted] + margin + eps
        highest = torch.full_like(price, -torch.inf).scatter_reduce_(0, wanted, bid, "amax")
        high = bid == highest[wanted]
        winner = torch.full_like(owner, -1).scatter_reduce_(0, wanted[high], bidder[high], "amax")
        sold = winner >= 0
        loser = owner[sold & (owner >= 0)]
        chosen[loser] = -1
        owner = torch.where(sold, winner, owner)
        price = torch.where(sold, highest, price)
        chosen[winner[sold]] = sold.nonzero().squeeze(1)
    chosen = torch.where(chosen >= 0, chosen % n, chosen).view(count, n)
    _assign_rest(a, b, chosen)
    return chosen


def _best_objects(
    cost: Tensor, price: Tensor, bidder: Tensor, element: Tensor
) -> tuple[Tensor, Tensor]:
    """Index of each bidder's best object, and its lead over the second best."""
    parts = []
    for rows in _chunks(len(bidder), cost.shape[1], 1):
        value = -cost[bidder[rows]] - price[element[rows]]
        best, wanted = value.max(dim=1)
        value.scatter_(1, wanted[:, None], -torch.inf)
        parts.append((wanted, best - value.max(dim=1).values))
    wanted, margin = (torch.cat(column) for column in zip(*parts, strict=True))
    return wanted, margin


def _assign_rest(a: Tensor, b: Tensor, chosen: Tensor) -> None:
    """Fill the -1 entries of chosen (b, n) with the objects left.

    Bidders and objects are sorted along the objects' longest axis and matched at least cost in
    blocks: the exact assignment of all of them takes seconds when nearly all are left.
    """
    n = chosen.shape[1]
    for element in range(len(chosen)):
        bidder = (chosen[element] < 0).nonzero().squeeze(1)
        if len(bidder) == 0:
            continue
        free = torch.ones(n, dtype=torch.bool, device=chosen.device)
        free[chosen[element][chosen[element] >= 0]] = False
        left = free.nonzero().squeeze(1)
        extent = b[element, left].max(dim=0).values - b[element, left].min(dim=0).values
        axis = int(extent.argmax())
        bidder = bidder[a[element, bidder, axis].argsort(stable=True)]
        left = left[b[element, left, axis].argsort(stable=True)]
        for start in range(0, len(bidder), REST_BLOCK):
            ours, theirs = bidder[start : start + REST_BLOCK], left[start : start + REST_BLOCK]
            cost = distances(a[None, element, ours], b[None, element, theirs])[0]
            # Changes nothing about the optimum, and makes finding it up to 20 times faster.
            cost = cost - cost.mean(dim=0)
            order = torch.as_tensor(linear_sum_assignment(cost.cpu().numpy())[1])
            chosen[element, ours] = theirs[order.to(chosen.device)]
