"""What a process really left: film or depth of a tool's recorded motion, sample by sample in time.

A plan's model is linear in the slowness of its moves. What an arm did is not told by moves: its
speed at every moment, where the tool waited, and the force that was really there, count here.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from nrdf.process_model.cells import Cells
from nrdf.process_model.deposition import deposition
from nrdf.process_model.moves import ToolSamples
from nrdf.process_model.removal import removal
from nrdf.process_model.result import ResultMetrics, Target, measure_result
from nrdf.process_model.result_model import Tool
from nrdf.process_model.spray_profile import SprayProfile
from nrdf.surface.target_mesh import TargetMesh


@dataclass(frozen=True)
class ExecutedMotion:
    """A tool's motion while it worked. samples: (k,), whose weights are times, s; speeds_m_s: (k,)
    of the tool centre point; force_n: (k,) along the tool's axis, 0 where nothing was pressed."""

    samples: ToolSamples
    speeds_m_s: np.ndarray
    force_n: np.ndarray


def executed_values(
    cells: Cells, motion: ExecutedMotion, tool: Tool, blocking: TargetMesh
) -> np.ndarray:
    """Film or depth (n,), m, of cells after a motion. blocking: what may hide a cell from a gun."""
    samples = motion.samples
    if isinstance(tool, SprayProfile):
        matrix = deposition(cells, samples, 1, tool, blocking)
    else:
        pressed = motion.force_n > 0.0
        matrix = removal(
            cells, samples.select(pressed), 1, tool, motion.speeds_m_s[pressed],
            motion.force_n[pressed],
        )  # fmt: skip
    return np.asarray(matrix.sum(axis=1)).ravel()


def measure_executed(
    cells: Cells, values_m: np.ndarray, motion: ExecutedMotion, tool: Tool, target: Target
) -> ResultMetrics:
    """Metrics of film or depth (n,), m, of cells after a motion."""
    seconds = float(motion.samples.weights.sum())
    inside, spray = cells.inside, isinstance(tool, SprayProfile)
    beside = float(cells.areas_m2[~inside] @ values_m[~inside]) if spray else 0.0
    spent = tool.flow_m3_s * seconds if isinstance(tool, SprayProfile) else 0.0
    return measure_result(values_m[inside], cells.areas_m2[inside], target, spent, beside, seconds)
