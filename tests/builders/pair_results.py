"""Results of pairs of labelled objects, as an evaluation gives them."""

from __future__ import annotations

from nrdf_benchmark.objects.retrieval import ObjectPairResult, PartResult


def part(name, state="there", iou=None, reason="", score=None):
    told = {} if score is None else {"confidence": 0.5, "observed": 1.0, "evidence": (1.0, 2.0)}
    return PartResult(name, state, 100, 90, iou, reason, score, **told)


def pair(method, reference, target, *parts, views=0, mixed=(0.0, 0.0), pose=None):
    return ObjectPairResult(method, views, reference, target, 0.5, parts, mixed, pose)


RESULTS = [
    pair(
        "nrdf", "a/1", "a/2",
        part("seat", iou=0.8, score=0.7), part("leg", iou=0.0, reason="absent", score=0.0),
        part("back", "absent", reason="not observed", score=0.0), part("arm", "", score=0.9),
    ),
    pair(
        "nrdf", "a/2", "a/1",
        part("seat", iou=0.4, score=0.1), part("back", "absent", score=0.1),
        part("rail", "absent", score=0.5), mixed=(0.2, 0.0),
    ),
    pair("registration", "a/1", "a/2", part("seat", iou=0.9), part("leg", iou=0.5)),
    pair("registration", "a/2", "a/1", part("seat", iou=0.6), mixed=(0.2, 0.0)),
]  # fmt: skip
SETS = {"a": [("a/1", "a/2"), ("a/2", "a/1")]}
