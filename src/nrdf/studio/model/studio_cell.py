"""What a studio's simulations and programs are for: an arm, or the cell of a cell file."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from nrdf.cell.file import read_cell
from nrdf.cell.placement import job_in_base, object_pose, require_limits
from nrdf.cell.work_cell import WorkCell
from nrdf.errors import ProcessError
from nrdf.export.options import Options, options_of_cell
from nrdf.studio.model.cell_upload import CELL, cell_in
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

    @staticmethod
    def kept(session: Path) -> StudioCell | None:
        """The one that was sent to the page of a session, in its folder; None for none, or for one
        that cannot be read any more."""
        try:
            file, described = cell_in(session / CELL, CELL)
        except ProcessError:
            return None
        return StudioCell(described=described, folder=file.parent)

    @property
    def words(self) -> str:
        """Which arm it is, and of what cell, in Markdown."""
        if self.described is None:
            return "the bundled arm" if self.robot is None else f"the arm of `{self.robot.name}`"
        arm = self.described.robot.model or "the bundled arm"
        tools = ", ".join(tool.name for tool in self.described.tools)
        return f"the cell **{self.described.name}**: {arm}; tools {tools}"

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
