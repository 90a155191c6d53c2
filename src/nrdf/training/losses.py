"""The paper's seven losses, and those that use known correspondences.

Equation numbers are the paper's. Where a loss differs from its equation, its docstring says so.

Every loss is a function of a `LossContext`: a batch and what the field computes from it.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property

import torch
from torch import Tensor
from torch.nn import functional

from nrdf.field.base import Field, Inverse
from nrdf.field.tokens import gather
from nrdf.training.batch import Batch
from nrdf.training.matching import (
    assign,
    distances,
    distances_to,
    local_normals,
    nearest_both_ways,
    nearest_distance,
    nearest_indices,
)

ROBUST = 0.01
"""Distance (canonical) below which `correspondence` turns from linear to quadratic."""
PATCHES = 128
"""Points of each cloud, drawn anew in every step, around which smoothness and normals are taken."""


class LossContext:
    """A batch and what the field computes from it, each part once, when a loss first needs it."""

    def __init__(
        self, field: Field, batch: Batch, generator: torch.Generator, cloud_points: int = 1024
    ) -> None:
        self.field = field
        self.batch = batch
        self.generator = generator
        self.cloud_points = min(cloud_points, batch.points.shape[1])

    @cached_property
    def z(self) -> Tensor:
        """(b, d_z) shape embeddings."""
        return self.field.embed(self.batch.points, self.batch.normals)

    @cached_property
    def logits(self) -> Tensor:
        """(b, q) occupancy of the queries."""
        return self.field.occupancy(self.z, self.batch.queries).float()

    @cached_property
    def transferred(self) -> Inverse:
        """The pairs' source points transferred to the partner: points (p, m, 3)."""
        batch = self.batch
        return self.field.transfer(
            self.z[batch.reference], batch.source, batch.source_normals, self.z[batch.partner]
        )

    @cached_property
    def cloud(self) -> Tensor:
        """(b, c, 3) points of each shape for the losses on whole clouds."""
        return self.batch.clean_points[:, : self.cloud_points]

    @cached_property
    def cloud_normals(self) -> Tensor:
        """(b, c, 3) their normals."""
        return self.batch.clean_normals[:, : self.cloud_points]

    @cached_property
    def descriptors(self) -> Tensor:
        """(b, c, d_k) of the clouds' points."""
        return self.field.describe(self.z, self.cloud, self.cloud_normals)

    @cached_property
    def prepared(self) -> Tensor:
        """What self and cross reconstruction make of the descriptors alike."""
        return self.field.prepare(self.descriptors)

    @cached_property
    def patches(self) -> Tensor:
        """(r,) rows of the clouds around which patches are taken."""
        rows = torch.randperm(self.cloud_points, generator=self.generator, device=self.z.device)
        return rows[:PATCHES]

    @cached_property
    def partner(self) -> Tensor:
        """(b,) every shape's first partner."""
        return self.batch.partner[: len(self.cloud)]

    @cached_property
    def self_reconstruction(self) -> Tensor:
        """(b, c, 3) each cloud from its own descriptors."""
        return self.field.invert_prepared(self.z, self.prepared).points.float()

    @cached_property
    def cross_reconstruction(self) -> Tensor:
        """(b, c, 3) each shape's descriptors on its partner."""
        z = self.z[self.partner]
        return self.field.invert_prepared(z, self.prepared).points.float()


def chamfer_distance(a: Tensor, b: Tensor) -> Tensor:
    """Mean squared distance to the nearest point, both directions summed: a, b (b, n|m, 3)."""
    return nearest_distance(a, b, squared=True).mean() + nearest_distance(b, a, squared=True).mean()


def earth_movers_distance(a: Tensor, b: Tensor) -> Tensor:
    """Mean distance under the best bijection between a and b (b, n, 3)."""
    difference = a - gather(b, assign(a, b))
    return (difference.square().sum(-1) + 1e-12).sqrt().mean()


def weighted_mean(values: Tensor, weight: Tensor) -> Tensor:
    """Σ w v / Σ w; zero, with zero gradient, where no weight is."""
    return (values * weight).sum() / weight.sum().clamp_min(1e-6)


def robust_distance(points: Tensor, batch: Batch) -> Tensor:
    """Weighted mean of √(d² + ε²) − ε, d from points (p, m, 3) to the batch's targets."""
    square = (points.float() - batch.target).square().sum(-1)
    return weighted_mean((square + ROBUST**2).sqrt() - ROBUST, batch.weight)


def roughness(context: LossContext, values: Tensor) -> Tensor:
    """Mean of ‖v(x) − v(y)‖ over random points x of each cloud and their 16 nearest y within 0.1;
    values v (b, c, d) at the clouds' points."""
    rows = context.patches
    apart, around = distances(context.cloud[:, rows], context.cloud).topk(
        min(17, context.cloud_points), dim=2, largest=False, sorted=True
    )
    apart, around = apart[:, :, 1:], around[:, :, 1:]
    return weighted_mean(distances_to(values, rows, around), (apart < 0.1).float())


def occupancy(context: LossContext) -> Tensor:
    """−[o log ô + (1 − o) log(1 − ô)], averaged over queries (first stage; no number)."""
    return functional.binary_cross_entropy_with_logits(context.logits, context.batch.occupancy)


def coarse_occupancy(context: LossContext) -> Tensor:
    """`occupancy`, by what descriptors are made of alone (`Field.coarse_occupancy`)."""
    logits = context.field.coarse_occupancy(context.z, context.batch.queries).float()
    return functional.binary_cross_entropy_with_logits(logits, context.batch.occupancy)


def self_reconstruction(context: LossContext) -> Tensor:
    """(2): ‖C(z_i, θ(z_i, x)) − x‖², averaged over points x of shape i."""
    return (context.self_reconstruction - context.cloud).square().sum(-1).mean()


def chamfer(context: LossContext) -> Tensor:
    """(3): Σ over both directions of the mean of min ‖x − y‖², between x in the cross
    reconstruction C(z_j, θ(z_i, ·)) and y in shape j."""
    return chamfer_distance(context.cross_reconstruction, context.cloud[context.partner])


def emd(context: LossContext) -> Tensor:
    """(4): min over bijections φ of the mean of ‖x − φ(x)‖, from cross reconstruction to shape j;
    the bijection by auction (eps 0.005, 50 rounds)."""
    return earth_movers_distance(context.cross_reconstruction, context.cloud[context.partner])


def descriptor_smoothness(context: LossContext) -> Tensor:
    """(6): mean of ‖k(x) − k(y)‖ over random points x and their 16 nearest y within 0.1.

    The paper permutes the points of random patches, and compares each with its neighbour in the
    new order; this compares every centre with all of its patch.
    """
    return roughness(context, context.descriptors.float())


def normal_consistency(context: LossContext) -> Tensor:
    """(5): mean of 1 − n(x)·n(y) over random cross-reconstructed x and their nearest y on shape j;
    n(x) by local PCA, its sign from the normal that x had on shape i.

    The paper adds the other direction, from shape j to the reconstruction.
    """
    crossed, rows = context.cross_reconstruction, context.patches
    ours = local_normals(crossed, rows, towards=context.cloud_normals[:, rows])
    nearest = nearest_indices(crossed[:, rows], context.cloud[context.partner])
    theirs = gather(context.cloud_normals[context.partner], nearest)
    return (1 - (ours * theirs).sum(-1)).mean()


def descriptor_distance(context: LossContext) -> Tensor:
    """(7): Chamfer distance between the descriptors of the cross reconstruction, taken on shape j,
    and those of shape i that it was made from.

    The paper writes it squared, and for each point of shape j with the descriptor of the point that
    it corresponds to; as in its released code the distances are those to the nearest descriptor,
    not squared, and both directions are averaged.
    """
    ours = context.field.describe(
        context.z[context.partner], context.cross_reconstruction, context.cloud_normals
    )
    there, back = nearest_both_ways(ours, context.descriptors)
    return (there.mean() + back.mean()) / 2


def displacement_smoothness(context: LossContext) -> Tensor:
    """IMDC's smoothness (Liu & Liu 2020): of the displacements C(z_j, θ(z_i, x)) − x, as (6) has it
    of descriptors."""
    return roughness(context, context.cross_reconstruction - context.cloud)


def correspondence(context: LossContext) -> Tensor:
    """Weighted mean of √(d² + ε²) − ε, d from C(z_j, θ(z_i, x)) to the known place of x on
    shape j; ε = 0.01 keeps doubtful correspondences from ruling (not in the paper)."""
    return robust_distance(context.transferred.points, context.batch)


def coarse_correspondence(context: LossContext) -> Tensor:
    """`correspondence` of C's points before their refinement (not in the paper). Zero for a field
    that does not refine them."""
    if context.transferred.coarse_points is None:
        return context.z.new_zeros(())
    return robust_distance(context.transferred.coarse_points, context.batch)


def normal(context: LossContext) -> Tensor:
    """Weighted mean of 1 − n̂·n, n̂ predicted at the corresponding place, n known there (not in the
    paper). Zero for a field that predicts no normals."""
    if context.transferred.normals is None:
        return context.z.new_zeros(())
    cosine = functional.cosine_similarity(
        context.transferred.normals.float(), context.batch.target_normals, dim=-1
    )
    return weighted_mean(1 - cosine, context.batch.weight)


def existence(context: LossContext) -> Tensor:
    """−[e log ê + (1 − e) log(1 − ê)] over the places of which it is known whether the target has
    them at all, e = 1 where it has (not in the paper). Zero for a field that predicts no
    existence."""
    if context.transferred.existence is None:
        return context.z.new_zeros(())
    truth = (context.batch.weight > 0).float()
    each = functional.binary_cross_entropy_with_logits(
        context.transferred.existence.float(), truth, reduction="none"
    )
    return weighted_mean(each, context.batch.known.float())


def error_scale(context: LossContext) -> Tensor:
    """Weighted mean of d/s + log s, the negative logarithm of a Laplace density of scale s, of the
    distance d (without gradient) that `correspondence` measures; s predicted (not in the paper).
    Zero for a field that predicts no error."""
    if context.transferred.log_error is None:
        return context.z.new_zeros(())
    d = (context.transferred.points.float() - context.batch.target).norm(dim=-1).detach()
    log_scale = context.transferred.log_error.float().clamp(-9, 3)
    return weighted_mean(d * (-log_scale).exp() + log_scale, context.batch.weight)


LOSSES: dict[str, Callable[[LossContext], Tensor]] = {
    "occupancy": occupancy,
    "coarse_occupancy": coarse_occupancy,
    "self": self_reconstruction,
    "chamfer": chamfer,
    "emd": emd,
    "smoothness": descriptor_smoothness,
    "normal_consistency": normal_consistency,
    "descriptor_distance": descriptor_distance,
    "displacement_smoothness": displacement_smoothness,
    "correspondence": correspondence,
    "coarse_correspondence": coarse_correspondence,
    "normal": normal,
    "existence": existence,
    "error_scale": error_scale,
}
"""Loss by the name that a stage's `weights` use."""
