"""The paper's losses on its network as a plain reading has them, to compare training steps with.

Everything is as it is written: single precision; z stands beside every point before the first layer
of decoder and inverse; descriptors are put together and brought to unit length; nearest points and
descriptors come from all distances; the bijection of the earth mover's distance is exact. The
weights are those of a `PaperField`, so both compute the same numbers.
"""

from __future__ import annotations

import numpy as np
import torch
from scipy.optimize import linear_sum_assignment
from torch import Tensor
from torch.nn import functional

from nrdf.field.paper import PaperField
from nrdf.field.point_nets import ResidualBlock
from nrdf.training.batch import Batch
from nrdf.training.losses import PATCHES
from nrdf.training.matching import local_normals


class PlainPaper:
    """Losses by name, () each, of a field on a batch; the clouds' first `cloud_points` points are
    reconstructed. Nothing is shared between losses but z, k and the two reconstructions."""

    def __init__(self, field: PaperField, cloud_points: int) -> None:
        self.field = field
        self.cloud_points = cloud_points

    def losses(
        self, batch: Batch, names: tuple[str, ...], generator: torch.Generator
    ) -> dict[str, Tensor]:
        """The named losses: occupancy, self, chamfer, emd, smoothness, normal_consistency,
        descriptor_distance."""
        z = self._embed(batch.points)
        cloud = batch.clean_points[:, : self.cloud_points]
        normals = batch.clean_normals[:, : self.cloud_points]
        found = {}
        if "occupancy" in names:
            logits = self._decode(z, batch.queries)[1][..., -1]
            found["occupancy"] = functional.binary_cross_entropy_with_logits(
                logits, batch.occupancy
            )
        if names == ("occupancy",):
            return found
        k = self._describe(z, cloud)
        if "self" in names:
            found["self"] = (self._invert(z, k) - cloud).square().sum(-1).mean()
        if names[-1] == "self":
            return found
        partner = batch.partner[: len(cloud)]
        theirs, their_normals = cloud[partner], normals[partner]
        crossed = self._invert(z[partner], k)
        apart = torch.cdist(crossed, theirs)
        found["chamfer"] = apart.min(2).values.square().mean() + apart.min(1).values.square().mean()
        order = [linear_sum_assignment(one)[1] for one in apart.detach().numpy()]
        chosen = torch.from_numpy(np.stack(order))
        found["emd"] = apart.gather(2, chosen[..., None]).mean()
        rows = torch.randperm(cloud.shape[1], generator=generator)[:PATCHES]
        near, around = torch.cdist(cloud[:, rows], cloud).topk(17, largest=False)
        shapes = torch.arange(len(cloud))[:, None, None]
        change = (k[:, rows, None] - k[shapes, around[..., 1:]]).norm(dim=-1)
        close = (near[..., 1:] < 0.1).float()
        found["smoothness"] = (change * close).sum() / close.sum().clamp_min(1e-6)
        ours = local_normals(crossed, rows, towards=normals[:, rows])
        nearest = apart.min(2).indices[:, rows]
        cosine = (ours * their_normals[torch.arange(len(cloud))[:, None], nearest]).sum(-1)
        found["normal_consistency"] = (1 - cosine).mean()
        unlike = torch.cdist(self._describe(z[partner], crossed), k)
        found["descriptor_distance"] = (
            unlike.min(2).values.mean() + unlike.min(1).values.mean()
        ) / 2
        return {name: found[name] for name in names}

    def _embed(self, points: Tensor) -> Tensor:
        encoder = self.field.encoder
        points = encoder.point_scale * points
        x = encoder.residual.enter(points)
        for number, block in enumerate(encoder.residual.blocks):
            if number:
                pooled = x.max(dim=1, keepdim=True).values
                x = torch.cat([x, pooled.expand_as(x)], dim=-1)
            x = self._block(block, x)
        residual = encoder.residual.leave(functional.relu(x.max(dim=1).values))
        y = points.transpose(1, 2)
        convolution = encoder.convolution
        for layer, norm in zip(convolution.convolutions, convolution.norms, strict=True):
            y = functional.relu(norm(layer(y)))
        y = convolution.leave(functional.relu(convolution.middle(y.max(dim=2).values)))
        return torch.cat([residual, y], dim=-1)

    def _decode(self, z: Tensor, points: Tensor) -> tuple[Tensor, Tensor]:
        decoder = self.field.decoder
        features = decoder.lift(points)
        beside = z[:, None].expand(-1, points.shape[1], -1)
        x = decoder.enter(torch.cat([features, beside], dim=-1))
        activations = [x]
        for block in decoder.blocks:
            x = self._block(block, x)
            activations.append(x)
        activations.append(decoder.leave(functional.relu(x)))
        return features, torch.cat(activations, dim=-1)

    def _describe(self, z: Tensor, points: Tensor) -> Tensor:
        features, activations = self._decode(z, points)
        beside = z[:, None].expand(-1, points.shape[1], -1)
        return functional.normalize(torch.cat([features, beside, activations], dim=-1), dim=-1)

    def _invert(self, z: Tensor, k: Tensor) -> Tensor:
        inverse = self.field.inverse
        x = inverse.enter(torch.cat([z[:, None].expand(-1, k.shape[1], -1), k], dim=-1))
        for block in inverse.blocks:
            x = self._block(block, x)
        return inverse.leave(functional.leaky_relu(x, 0.02)).tanh()

    def _block(self, block: torch.nn.Module, x: Tensor) -> Tensor:
        assert isinstance(block, ResidualBlock)
        hidden = functional.relu(block.inner(functional.relu(x)))
        return block.shortcut(x) + block.outer(hidden)
