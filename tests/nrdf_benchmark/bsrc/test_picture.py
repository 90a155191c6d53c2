"""The picture of retrieved and true regions."""

from __future__ import annotations

import matplotlib.image
import numpy as np
import pytest

from builders.bsrc_folder import member_clouds, write_bsrc
from nrdf.errors import OutputError
from nrdf.viz.palette import region_colours
from nrdf.viz.sheet import legend_height
from nrdf_benchmark.bsrc import picture as module
from nrdf_benchmark.bsrc.dataset import read_bsrc
from nrdf_benchmark.bsrc.picture import draw_comparison


@pytest.fixture(scope="module")
def benchmark(tmp_path_factory):
    clouds = member_clouds("chair", (0, 1, 2), 2000)
    return read_bsrc(write_bsrc(tmp_path_factory.mktemp("bsrc"), "chair", clouds), "chair")


def drawn(benchmark, match, path):
    draw_comparison(benchmark, "mine", match, path, 160)
    return matplotlib.image.imread(path)[..., :3]


def like(image, colour):
    """How many pixels have a colour's hue."""
    cosine = image @ (colour / np.linalg.norm(colour)) / np.linalg.norm(image, axis=-1).clip(1e-9)
    return ((cosine > 0.98) & (np.ptp(image, axis=-1) > 0.15)).sum()


def test_retrieved_regions_are_above_the_true_ones(benchmark, tmp_path):
    asked = []

    def only_first(reference, regions, target):
        asked.append((reference, target))
        item = next(item for item in benchmark.objects if item.cloud is target)
        return {roi: item.truth[roi] if roi == "1" else np.zeros(0, int) for roi in regions}

    image = drawn(benchmark, only_first, tmp_path / "figure.png")
    first, second, third = benchmark.objects
    assert [target for _, target in asked] == [second.cloud, third.cloud]
    assert all(reference is first.cloud for reference, _ in asked)
    assert image.shape[1] == 3 * 160 + module._LABELS
    # Above the legend, the targets' columns hold one line of retrieved and one of true regions.
    colours = region_colours(benchmark.rois)
    legend = legend_height(colours, image.shape[1])
    body = image[module._HEADER : -legend, 160 + module._LABELS :]
    lines = np.array_split(body, 4 if len(body) > 700 else 2)
    counts = np.array([[like(line, c) for c in colours.values()] for line in lines])
    retrieved, true = counts[0::2].sum(0), counts[1::2].sum(0)
    assert retrieved[0] > 0 and true[0] > 0
    others = [1, 2, 3, 4, 7]  # of hues unlike the first
    assert true[others].sum() > 200 > 20 * retrieved[others].sum()


def test_no_more_than_some_targets_are_shown(benchmark, tmp_path, monkeypatch):
    monkeypatch.setattr(module, "TARGETS", 1)
    everything = lambda reference, regions, target: dict.fromkeys(  # noqa: E731
        regions, np.arange(len(target))
    )
    image = drawn(benchmark, everything, tmp_path / "figure.png")
    assert image.shape[1] == 2 * 160 + module._LABELS


def test_a_place_that_cannot_be_written_is_refused(benchmark, tmp_path):
    nothing = lambda reference, regions, target: dict.fromkeys(  # noqa: E731
        regions, np.zeros(0, int)
    )
    with pytest.raises(OutputError, match=r"cannot write .*figure.png"):
        draw_comparison(benchmark, "mine", nothing, tmp_path / "nowhere" / "figure.png", 80)
