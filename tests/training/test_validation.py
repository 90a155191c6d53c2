"""Scores of a field on shapes that it was not trained on."""

from __future__ import annotations

import torch

from builders.tiny_field import Ball, TinyField, balls, tiny_dataset
from nrdf.training.validation import ignores_embedding, validate


def field() -> TinyField:
    torch.manual_seed(0)
    return TinyField()


def test_the_same_field_has_the_same_scores_and_keeps_its_mode():
    one = field().train()
    scores = validate(one, tiny_dataset())
    assert one.training and scores == validate(one, tiny_dataset())
    assert set(scores) == {"val/error", "val/copy", "val/iou", "val/iou other"}
    assert 0 < scores["val/copy"] < 0.5 and 0 <= scores["val/iou"] <= 1


def test_each_pool_has_an_error_and_what_cannot_be_measured_is_left_out():
    shapes = [*balls(4), *(Ball(f"real-{i}", source="scan") for i in range(3))]
    scores = validate(field(), tiny_dataset(shapes, pools={"family-*": 0.5, "*": 0.5}))
    assert {"val/error family-*", "val/error *"} < set(scores)
    bare = [Ball(f"b{i}", groups=()) for i in range(3)]
    assert set(validate(field(), tiny_dataset(bare))) == {"val/iou", "val/iou other"}


def test_a_field_without_an_inverse_has_no_error():
    one = field()
    one.inverts = False
    assert set(validate(one, tiny_dataset())) == {"val/iou", "val/iou other"}


class KnowsExtents(TinyField):
    """Predicts the ellipsoid of the extents that it sees."""

    inverts = False

    def embed(self, points, normals):
        return points.abs().amax(dim=1)

    def occupancy(self, z, queries):
        return 1 - (queries / z[:, None]).pow(2).sum(-1)


class KnowsTheMean(KnowsExtents):
    """Predicts one ellipsoid, whatever it sees."""

    def embed(self, points, normals):
        return super().embed(points, normals).mean(0, keepdim=True).expand(len(points), -1)


def test_a_field_that_ignores_what_it_encodes_is_told():
    shapes = [Ball(f"b{i}", radii=(0.5, 0.15 + 0.1 * i, 0.45 - 0.1 * i)) for i in range(4)]
    knowing, mean = (
        validate(kind(), tiny_dataset(shapes)) for kind in (KnowsExtents, KnowsTheMean)
    )
    assert knowing["val/iou"] > 0.8 > 0.7 > knowing["val/iou other"]
    assert mean["val/iou"] == mean["val/iou other"] > 0.2
    assert ignores_embedding(mean) and not ignores_embedding(knowing)
    assert not ignores_embedding({"val/error": 0.1})


class KnowsTheMeanBesides(KnowsExtents):
    """Its descriptors are made of one ellipsoid; the occupancy that it tells is right."""

    def coarse_occupancy(self, z, queries):
        return self.occupancy(z.mean(0, keepdim=True).expand(len(z), -1), queries)


def test_what_descriptors_are_made_of_is_scored_where_it_is_another_occupancy():
    shapes = [Ball(f"b{i}", radii=(0.5, 0.15 + 0.1 * i, 0.45 - 0.1 * i)) for i in range(4)]
    scores = validate(KnowsTheMeanBesides(), tiny_dataset(shapes))
    assert scores["val/iou"] > 0.8 > scores["val/iou coarse"] == scores["val/iou other"]
    assert ignores_embedding(scores)
