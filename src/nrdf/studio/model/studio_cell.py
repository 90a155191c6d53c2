"""What a studio's simulations and programs are for: an arm, or the cell of a cell file."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from nrdf.cell.file import read_cell
from nrdf.cell.placement import job_in_base, object_pose, require_limits
from nrdf.cell.work_cell import WorkCell
from nrdf.export.options import Options, options_of_cell
from nrdf.toolpath.types import Job


@dataclass(frozen=True)
class StudioCell:
    """robot, tool_frame: of `nrdf.robot.model.arm.load_arm`, the bundled arm unless given.

    described: instead, the cell of a file in `folder`.
    """

    robot: Path | None = None
    tool_frame: str | None = None
    described: WorkCell | None = None
    folder: Path = Path()

    @staticmethod
    def of(file: Path) -> StudioCell:
        """Of a cell file. Raises ProcessError."""
        return StudioCell(described=read_cell(file), folder=file.parent)

    def placed(self, job: Job, points: np.ndarray) -> tuple[Job, Options | None]:
        """A job as it is exported: in the robot's base frame where there is a cell file; options.

        points: (n, 3) of the object, m. Raises ProcessError where the cell lacks what the job
        needs, LimitError for limits that it does not meet.
        """
        cell = self.described
        if cell is None:
            return job, None
        placed = job_in_base(cell, job, object_pose(cell, job, points))
        require_limits(cell.robot, cell.keep_out, placed)
        return placed, options_of_cell(cell)
