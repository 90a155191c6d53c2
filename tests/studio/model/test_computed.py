"""What is computed: the lines of a plan, and distances between descriptors."""

from __future__ import annotations

import numpy as np

from builders.studio_page import silent
from nrdf.studio.model.computed import CorrespondenceFeatures, Plan


def test_a_plan_has_contacts_on_the_region_that_it_was_made_for(results):
    results.make_plans(results.editor.document, silent)
    plan = results.plan(results.editor.document.region("top"), 0)
    places = np.concatenate(plan.lines)
    top = results.editor.document.reference.cloud.points[:, 1].max()
    np.testing.assert_allclose(places[:, 1], top, atol=0.004)
    assert abs(plan.region.vertices[:, 1] - top).max() < 0.01
    assert Plan("no").lines == []


def test_distances_are_from_the_working_point_of_what_was_picked():
    features = CorrespondenceFeatures(
        {"a": np.array([[0.0, 0.0], [3.0, 4.0]])}, np.array([[9.0, 9.0], [0.0, 0.0]]), np.array([1])
    )
    assert features.distances(0)["a"].tolist() == [0.0, 5.0]
