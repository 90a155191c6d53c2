"""The studio's cell: an arm, or that of a file."""

from __future__ import annotations

import numpy as np
import pytest

from builders.cells import cell_of
from builders.export_jobs import small_job
from nrdf.cell.file import write_cell
from nrdf.errors import LimitError
from nrdf.studio.model.studio_cell import StudioCell


def test_without_a_cell_file_jobs_stay_as_they_are():
    job = small_job()
    assert StudioCell().placed(job, np.zeros((1, 3))) == (job, None)


def test_jobs_are_placed_in_the_cell_of_a_file_and_within_its_limits(tmp_path):
    points = np.random.default_rng(0).uniform(-0.2, 0.3, (50, 3))
    write_cell(tmp_path / "cell.yaml", cell_of(robot={"base_frame": "world"}))
    cell = StudioCell.of(tmp_path / "cell.yaml")
    job, options = cell.placed(small_job(), points)
    assert job.frame == "world" and options.cell == cell.described and cell.folder == tmp_path
    write_cell(tmp_path / "slow.yaml", cell_of(robot={"max_feed_m_s": 0.001}))
    with pytest.raises(LimitError, match=r"above the cell's 1.0 mm/s"):
        StudioCell.of(tmp_path / "slow.yaml").placed(small_job(), points)
