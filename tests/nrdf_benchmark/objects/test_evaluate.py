"""`nrdf eval objects`: results of pairs, and what the cache has of them."""

from __future__ import annotations

from dataclasses import asdict, replace

import pytest

from builders.labelled_boxes import write_objects
from nrdf.field.zoo import find_weights
from nrdf_benchmark.methods.registry import MethodSpec
from nrdf_benchmark.objects.dataset import read_objects
from nrdf_benchmark.objects.evaluate import evaluate_objects, pairs_of
from nrdf_benchmark.objects.retrieval import Settings
from nrdf_benchmark.result_cache import LineCache

BOX, REGISTRATION = MethodSpec("box-mask"), MethodSpec("registration")
POINTS = 1500


@pytest.fixture(scope="module")
def root(tmp_path_factory):
    return write_objects(tmp_path_factory.mktemp("objects"))


@pytest.fixture(scope="module")
def settings(root):
    return Settings(root, find_weights("chair"), POINTS)


def by_part(result):
    return {part.part: part for part in result.parts}


def test_what_was_measured_is_not_measured_again(settings, root, tmp_path, monkeypatch):
    objects = read_objects(root)
    pairs = pairs_of(objects, ["chair", "stool"])

    def run(cache, **changed):
        told = []
        results = evaluate_objects(
            replace(settings, **changed), objects, pairs, [BOX], cache=cache,
            progress=lambda *words: told.append(words),
        )  # fmt: skip
        return results, told[0][1]

    first, there = run(LineCache(tmp_path))
    assert there == 0 and [(f.reference, f.target) for f in first] == pairs
    again, there = run(LineCache(tmp_path))
    assert there == 6 and [asdict(f) for f in again] == [asdict(f) for f in first]
    path = next((tmp_path / "pairs").iterdir())
    path.write_text(path.read_text()[:-20])
    assert run(LineCache(tmp_path))[1] == 5
    assert run(LineCache(tmp_path), points=POINTS + 1)[1] == 0
    monkeypatch.setattr("nrdf_benchmark.objects.evaluate.code_checksum", lambda sources: "other")
    assert run(LineCache(tmp_path))[1] == 0
    assert run(LineCache(tmp_path, overwrite=True))[1] == 0
