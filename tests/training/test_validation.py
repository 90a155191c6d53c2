"""Scores of a field on shapes that it was not trained on."""

from __future__ import annotations

import torch

from builders.tiny_field import Ball, TinyField, balls, tiny_dataset
from nrdf.training.validation import validate


def field() -> TinyField:
    torch.manual_seed(0)
    return TinyField()


def test_the_same_field_has_the_same_scores_and_keeps_its_mode():
    one = field().train()
    scores = validate(one, tiny_dataset())
    assert one.training and scores == validate(one, tiny_dataset())
    assert set(scores) == {"val/error", "val/copy", "val/iou"}
    assert 0 < scores["val/copy"] < 0.5 and 0 <= scores["val/iou"] <= 1


def test_each_pool_has_an_error_and_what_cannot_be_measured_is_left_out():
    shapes = [*balls(4), *(Ball(f"real-{i}", source="scan") for i in range(3))]
    scores = validate(field(), tiny_dataset(shapes, pools={"family-*": 0.5, "*": 0.5}))
    assert {"val/error family-*", "val/error *"} < set(scores)
    bare = [Ball(f"b{i}", groups=()) for i in range(3)]
    assert set(validate(field(), tiny_dataset(bare))) == {"val/iou"}


def test_a_field_without_an_inverse_has_no_error():
    one = field()
    one.inverts = False
    assert set(validate(one, tiny_dataset())) == {"val/iou"}
