"""Samples of a tool's way."""

from __future__ import annotations

import numpy as np
import pytest

from nrdf.errors import ProcessError
from nrdf.process_model.moves import Moves
from nrdf.toolpath.types import Segment

DOWN = [1.0, 0.0, 0.0, 0.0]  # tool z down, tool x along x


def a_segment(positions, **more):
    count = len(positions)
    return Segment("process", 0, np.array(positions, float), np.tile(DOWN, (count, 1)), 0.1, **more)


def test_samples_stand_for_the_whole_way_and_for_the_dwell():
    corner = a_segment([(0, 0, 0), (0.05, 0, 0), (0.05, 0.02, 0)], dwell_s=0.5)
    moves = Moves.of([corner, a_segment([(1, 0, 0), (1.01, 0, 0)])], 0.01)
    assert moves.lengths_m == pytest.approx([0.05, 0.02, 0.01])
    assert np.bincount(moves.samples.column, moves.samples.weights) == pytest.approx(
        moves.lengths_m
    )
    assert moves.segment.tolist() == [0, 0, 1]
    assert moves.turns_rad == pytest.approx([np.pi / 2, 0.0, 0.0])
    assert moves.samples.axes == pytest.approx(np.tile([0, 0, -1.0], (8, 1)))
    assert moves.stops.weights.tolist() == [0.5]
    assert moves.seconds == pytest.approx(0.8 + 0.5)


def test_every_move_has_its_own_feed():
    line = a_segment([(0, 0, 0), (0.1, 0, 0), (0.2, 0, 0)], feeds_m_s=np.array([0.1, 0.1, 0.2]))
    moves = Moves.of([line], 0.1)
    assert moves.slowness == pytest.approx([10.0, 5.0])
    assert moves.seconds == pytest.approx(line.seconds) == pytest.approx(1.5)


def test_a_path_that_works_nothing_is_refused():
    with pytest.raises(ProcessError, match="without a process segment"):
        Moves.of([], 0.01)
