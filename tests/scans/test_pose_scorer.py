"""What all pose scorers share: subsets that stand for a cloud, and proportions."""

from __future__ import annotations

import numpy as np
import pytest

import nrdf
from builders.small_model import chair
from nrdf.scans.aligned_scan import pose_scorer
from nrdf.scans.pose_scorer import even_subset, sparse_subset


def test_subsets_are_of_the_size_asked_for_and_distinct():
    points = chair()[0].points
    for subset in (sparse_subset(points, 200), even_subset(points, 200)):
        assert 150 < len(subset) <= 200 and len(np.unique(subset)) == len(subset)
    extremes = {int(points[:, axis].argmax()) for axis in range(3)}
    assert extremes <= set(sparse_subset(points, len(points)).tolist())


def test_proportions_are_told_in_standard_deviations():
    cloud = chair()[0]
    scorer = pose_scorer(nrdf.load_model("registration"), [cloud])
    points = scorer.model.encode(cloud).points
    assert scorer.proportion_z_score(points) == pytest.approx(0.0)
    assert scorer.proportion_z_score(points * [3.0, 1.0, 1.0]) > 3
    assert scorer.name == "known object"
