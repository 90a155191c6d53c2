from __future__ import annotations

import numpy as np
import pytest
import yaml
from scipy.spatial.transform import Rotation

from builders.export_checks import (
    HALF_TURN_ABOUT_X,
    compare,
    with_first_feed_unknown,
    written,
)
from builders.read_programs import (
    Read,
    read_lines,
)
from nrdf.export.options import Options


@pytest.mark.parametrize("tool_z", [None, "into"])
def test_noether_has_a_tool_path_for_each_line_and_a_segment_for_each_contact(
    wild, tmp_path, tool_z
):
    path = written(wild, "noether", tmp_path, Options(tool_z=tool_z))
    of_paths = yaml.safe_load("\n".join(read_lines(path)))
    # Line 1 has two process segments, so two contacts.
    assert [[len(line) for line in lines] for lines in of_paths] == [[1, 2], [1]]
    segments = [segment for lines in of_paths for line in lines for segment in line]
    assert [len(segment) for segment in segments] == [30, 27, 8, 9]
    kinds = iter([s.kind for p in wild.paths for s in p.segments for _ in s.positions])
    feeds = iter([feed for p in wild.paths for s in p.segments for feed in s.speeds_m_s])
    reads = []
    for pose in (pose for segment in segments for pose in segment):
        assert set(pose) == {"x", "y", "z", "qx", "qy", "qz", "qw"}
        x, y, z, qx, qy, qz, qw = (pose[key] for key in ["x", "y", "z", "qx", "qy", "qz", "qw"])
        turn = Rotation.from_quat([qx, qy, qz, qw]).as_matrix()
        reads.append(Read(next(kinds), np.array([x, y, z]), turn, next(feeds)))
    paths = with_first_feed_unknown([reads[:65], reads[65:]])
    compare(wild, paths, dwell=False, turn=HALF_TURN_ABOUT_X if tool_z is None else None)
