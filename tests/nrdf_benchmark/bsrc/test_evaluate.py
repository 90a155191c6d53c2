"""Every method on every pair: in one process or several, whole or going on."""

from __future__ import annotations

import numpy as np
import pytest

from builders.bsrc_folder import member_clouds, write_bsrc
from nrdf.errors import DataError
from nrdf.tasks import TaskLost
from nrdf_benchmark.bsrc import evaluate as module
from nrdf_benchmark.bsrc.dataset import ROIS, read_bsrc
from nrdf_benchmark.bsrc.evaluate import MethodResult, evaluate, run_pair
from nrdf_benchmark.methods.registry import MethodSpec, build_method
from nrdf_benchmark.metrics import METRICS, chamfer_l1
from nrdf_benchmark.result_cache import PairCache

COPY, BOX = MethodSpec("copy"), MethodSpec("box")


@pytest.fixture(scope="module")
def benchmark(tmp_path_factory):
    root = tmp_path_factory.mktemp("bsrc")
    return read_bsrc(write_bsrc(root, "chair", member_clouds("chair", (0, 1, 2))), "chair")


@pytest.fixture(scope="module")
def copy(benchmark):
    return evaluate(benchmark, [COPY])[0]


def test_copying_to_an_identical_object_costs_nothing(tmp_path):
    clouds = member_clouds("car", (2, 2))
    same = read_bsrc(write_bsrc(tmp_path, "car", clouds), "car")
    (result,) = evaluate(same, [COPY])
    assert result.values("cd-l1").shape == (2, 8)
    assert result.mean() == pytest.approx(0, abs=1e-9) and result.mean("iou") == 1.0
    assert np.isnan(result.mean("side-accuracy"))  # a car has no such region


def test_every_pair_and_region_has_its_figures(benchmark, copy):
    pairs = [(pair.reference, pair.target) for pair in copy.pairs]
    assert pairs[:3] == [("chair1", "chair2"), ("chair1", "chair3"), ("chair2", "chair1")]
    assert copy.rois == ROIS["chair"] and copy.missed == 0
    assert copy.seconds.shape == (6,) and (copy.seconds > 0).all()
    values = copy.values("cd-l1")
    assert values.shape == (6, 8) and copy.mean() == pytest.approx(values.mean())
    np.testing.assert_allclose(copy.by_roi("cd-l1"), values.mean(0))
    first, _, third = benchmark.objects
    found = build_method(COPY)(first.cloud, first.regions, third.cloud)["2f"]
    expected = chamfer_l1(third.cloud.points[found], third.regions["2f"])
    assert values[1, ROIS["chair"].index("2f")] == pytest.approx(expected)
    assert copy.pairs[1].points["2f"] == len(found)


def test_values_that_are_not_defined_are_left_out_of_means(copy):
    by_roi = copy.by_roi("side-accuracy")
    defined = [ROIS["chair"].index(roi) for roi in ("2b", "2f")]
    assert set(np.flatnonzero(~np.isnan(by_roi))) <= set(defined)
    values = copy.values("side-accuracy")
    assert copy.mean("side-accuracy") == pytest.approx(np.nanmean(values))


def test_a_region_found_nowhere_is_counted_as_missed(benchmark):
    def match(reference, regions, target):
        everything = np.arange(len(target))
        return {roi: everything[: 0 if roi == "3" else None] for roi in regions}

    result = run_pair(match, "chair", *benchmark.objects[:2])
    assert [roi for roi, count in result.points.items() if not count] == ["3"]
    assert result.metrics["3"]["cd-l1"] == 1.0 > result.metrics["1"]["cd-l1"]
    assert set(result.metrics["3"]) == set(METRICS)


def test_confidence_divides_the_regions_into_sure_and_unsure(benchmark, copy):
    assert copy.by_confidence() is None

    class Sure:
        """Finds every region by copying; the surer, the less it misses (it knows the truth)."""

        def __init__(self):
            self.confidence = {}

        def __call__(self, reference, regions, target):
            found = build_method(COPY)(reference, regions, target)
            truth = next(item for item in benchmark.objects if item.cloud is target).regions
            self.confidence = {
                roi: -chamfer_l1(target.points[found[roi]], truth[roi]) for roi in regions
            }
            return found

    pairs = tuple(run_pair(Sure(), "chair", *pair) for pair in benchmark.pairs)
    sure, unsure = MethodResult(COPY, copy.rois, pairs).by_confidence()
    ordered = np.sort(copy.values("cd-l1"), axis=None)
    assert sure == pytest.approx(ordered[:12].mean()) and len(ordered) == 48
    assert unsure == pytest.approx(ordered[-12:].mean())


def test_several_processes_find_the_same(benchmark, copy):
    told = []
    results = evaluate(benchmark, [COPY, BOX], 2, progress=lambda *a: told.append(a))
    assert [result.spec for result in results] == [COPY, BOX]
    for metric in METRICS:
        np.testing.assert_array_equal(results[0].values(metric), copy.values(metric))
    assert told[:2] == [("copy", 0, 6), ("box", 0, 6)]
    assert {("copy", 6, 6), ("box", 6, 6)} <= set(told) and len(told) == 2 + 12


def test_an_interrupted_evaluation_goes_on(benchmark, copy, tmp_path, monkeypatch):
    runs = []
    real = module.run_pair

    def interrupted(*arguments):
        if len(runs) == 4:
            raise KeyboardInterrupt
        runs.append(arguments)
        return real(*arguments)

    monkeypatch.setattr(module, "run_pair", interrupted)
    with pytest.raises(KeyboardInterrupt):
        evaluate(benchmark, [COPY], cache=PairCache(tmp_path))
    monkeypatch.setattr(module, "run_pair", lambda *a: runs.append(a) or real(*a))
    told = []
    (result,) = evaluate(benchmark, [COPY], 1, PairCache(tmp_path), lambda *a: told.append(a))
    assert len(runs) == 6 and told == [("copy", count, 6) for count in (4, 5, 6)]
    for metric in METRICS:
        np.testing.assert_array_equal(result.values(metric), copy.values(metric))
    (again,) = evaluate(benchmark, [COPY], 1, PairCache(tmp_path))
    assert len(runs) == 6 and again == result
    evaluate(benchmark, [COPY], 1, PairCache(tmp_path, overwrite=True))
    assert len(runs) == 12


def test_what_a_method_raises_is_raised(benchmark, monkeypatch):
    def fail(error):
        def run(*arguments):
            raise error

        return run

    monkeypatch.setattr(module, "run_pair", fail(ValueError("broken")))
    with pytest.raises(ValueError, match="broken"):
        evaluate(benchmark, [COPY])
    monkeypatch.setattr(module, "run_pair", fail(TaskLost()))
    with pytest.raises(DataError, match=r"copy, chair1 to chair2: the process .* fewer --workers"):
        evaluate(benchmark, [COPY])
