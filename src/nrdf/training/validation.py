"""How good a field is on shapes that it was not trained on."""

from __future__ import annotations

from collections import defaultdict

import torch

from nrdf.field.base import Field
from nrdf.training.dataset import ShapeDataset

STEPS = 8
BATCH = 8
_KNOWN = 0.2  # intersection over union from which something has been learned
_AS_GOOD = 0.98


@torch.no_grad()
def validate(field: Field, dataset: ShapeDataset) -> dict[str, float]:
    """Scores on undeformed shapes, the same draw every time.

    `val/error`: mean distance between predicted and known corresponding points (canonical
    lengths); `val/copy`: that of leaving every point where it is; `val/iou`: intersection over
    union of predicted and true occupancy over the queries; `val/iou coarse`: of what descriptors
    are made of alone (`Field.coarse_occupancy`), where that is another one; `val/iou other`: the
    last of these, predicted with the embedding of another shape. With several pools, the error of
    each as well. Scores that the shapes give no ground for are left out, and errors of a field
    without an inverse.
    """
    training = {module: module.training for module in field.modules()}
    field.eval()
    sums = {pattern: _sums(field, pool) for pattern, pool in dataset.plain().items()}
    for module, mode in training.items():
        module.training = mode
    every: dict[str, float] = defaultdict(float)
    for found in sums.values():
        for name, value in found.items():
            every[name] += value
    scores = {}
    if every["weight"] > 0:
        scores["val/error"] = every["error"] / every["weight"]
        scores["val/copy"] = every["copy"] / every["weight"]
    for pattern, found in sums.items():
        if len(sums) > 1 and found["weight"] > 0:
            scores[f"val/error {pattern}"] = found["error"] / found["weight"]
    if every["either"] > 0:
        scores["val/iou"] = every["inside"] / every["either"]
        if _tells_coarsely(field):
            scores["val/iou coarse"] = every["inside coarse"] / max(every["either coarse"], 1.0)
        scores["val/iou other"] = every["inside other"] / max(every["either other"], 1.0)
    return scores


def _sums(field: Field, pool: ShapeDataset) -> dict[str, float]:
    """Numerators and denominators of the scores over one pool."""
    sums: dict[str, float] = defaultdict(float)
    size = min(BATCH, max(len(of.members) for of in pool.pools))
    for step in range(STEPS):
        batch = pool.batch(size, seed=0, step=step)
        z = field.embed(batch.points, batch.normals)
        if field.inverts:
            found = field.transfer(
                z[batch.reference], batch.source, batch.source_normals, z[batch.partner]
            ).points
            apart, copied = found - batch.target, batch.source - batch.target
            sums["error"] += float((apart.norm(dim=-1) * batch.weight).sum())
            sums["copy"] += float((copied.norm(dim=-1) * batch.weight).sum())
            sums["weight"] += float(batch.weight.sum())
        truth = batch.occupancy > 0.5
        tellings = [("", field.occupancy, z), (" other", field.coarse_occupancy, z.roll(1, 0))]
        if _tells_coarsely(field):
            tellings.append((" coarse", field.coarse_occupancy, z))
        for of, told, embedding in tellings:
            guess = told(embedding, batch.queries) > 0
            sums[f"inside{of}"] += float((guess & truth).sum())
            sums[f"either{of}"] += float((guess | truth).sum())
    return sums


def _tells_coarsely(field: Field) -> bool:
    return type(field).coarse_occupancy is not Field.coarse_occupancy


def ignores_embedding(scores: dict[str, float]) -> bool:
    """Whether occupancy is as good with the embedding of another shape: the field has learned the
    mean shape, and what rests on embeddings, such as cross reconstruction, can learn nothing."""
    own = scores.get("val/iou coarse", scores.get("val/iou", 0.0))
    other = scores.get("val/iou other", 0.0)
    return own > _KNOWN and other > _AS_GOOD * own
