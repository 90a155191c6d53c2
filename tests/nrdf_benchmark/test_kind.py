"""The measurement of the check of the kind of object."""

from __future__ import annotations

import numpy as np
import pytest

from builders.kinds import Saying, member
from nrdf.errors import DataError
from nrdf.field.kind_network import OTHER, orientation_of
from nrdf.training.kind_network import is_held_out
from nrdf_benchmark import kind as benchmark

TETRAHEDRON = """
v 0 0 0
v 1 0 0
v 0 1 0
v 0 0 1
f 1 3 2
f 1 2 4
f 2 3 4
f 1 4 3
"""


def test_the_measurement_counts_what_is_doubted_and_leaves_out_what_is_of_the_kind(tmp_path):
    right = [("made", str(seed), member("chair", seed)) for seed in (1_000_003, 1_000_010)]
    for name in ("vase", "red_vase", "park_bench", "jar", "tin", "oar", "lid", "box", "rod"):
        (tmp_path / f"{name}.obj").write_text(TETRAHEDRON)
    with pytest.raises(DataError, match=r"holds \d meshes of other kinds, not 20"):
        benchmark.other_objects(tmp_path, "chair", 20)
    held = [p for p in tmp_path.iterdir() if is_held_out(p.stem) and p.stem != "park_bench"]
    others = benchmark.other_objects(tmp_path, "chair", len(held))
    assert {p.stem for p in others} == {p.stem for p in held} and 0 < len(held) < 8
    figures = benchmark.evaluate_kind(Saying(0), "chair", right, others)
    rows = {what: (doubted, of) for what, doubted, of, _ in benchmark.summary(figures)}
    assert rows["made"] == (0, 2) and rows["all turned objects"] == (0, 18)
    assert rows[benchmark.OTHERS] == (0, len(held)) and rows[benchmark.PAIRS] == (2, 2)
    figures = benchmark.evaluate_kind(Saying(OTHER), "chair", right, others)
    rows = {what: (doubted, of) for what, doubted, of, _ in benchmark.summary(figures)}
    assert rows["made"] == (2, 2) and rows["all turned objects"] == (18, 18)


def test_the_rotations_measured_are_a_quarter_or_a_half_turn():
    for rotations in benchmark.turns().values():
        assert all(0 < orientation_of(r) < 24 and np.allclose(r, np.round(r)) for r in rotations)
    (back,) = benchmark.turns()[benchmark.BACKWARDS]
    np.testing.assert_allclose(back, np.diag([-1.0, 1.0, -1.0]), atol=1e-9)
