"""A box that processes are taught on: what the tests of transfer share."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import trimesh

from builders.solids import box
from nrdf.geometry.mesh import Mesh
from nrdf.io.cloud import PointCloud
from nrdf.process.bound_knowledge import BoundKnowledge
from nrdf.process.knowledge import Knowledge
from nrdf.process.strategy import tool_path
from nrdf.process.transfer_result import FoundRegion, PathResult, TransferResult
from nrdf.regions.match import Match
from nrdf.toolpath.metrics import ToolPathMetrics
from nrdf.toolpath.types import Segment

SIZE = np.array([0.5, 0.6, 0.9])
POINTS = 3000
SAND = {
    "kind": "sand", "stepover_mm": 40, "spacing_mm": 20, "tool": {"radius_mm": 25},
    "force_n": 10, "feed_mm_s": 100,
}  # fmt: skip


def cloud(size=SIZE, count=POINTS, seed=0):
    points, normals = box(size, count, seed)
    return PointCloud(points, normals, unit="m")


def solid(size=SIZE, count=POINTS, seed=0):
    """The same, of a box whose mesh is known."""
    box_mesh = trimesh.creation.box(size)
    mesh = Mesh(np.array(box_mesh.vertices), np.array(box_mesh.faces))
    return replace(cloud(size, count, seed), mesh=mesh)


def faces(of):
    """Indices of a box's points by face."""
    normals = of.normals
    return {
        "top": np.flatnonzero(normals[:, 1] > 0.5),
        "front": np.flatnonzero(normals[:, 0] > 0.5),
        "right": np.flatnonzero(normals[:, 2] > 0.5),
    }


METRICS = ToolPathMetrics(
    coverage=0.995,
    left_out={"no_clearance": 0.0, "edge_margin": 0.0},
    unreached=0.005,
    overlap=0.4,
    line_spacing_mean_m=0.04,
    line_spacing_worst_m=0.042,
    surface_distance_worst_m=0.0009,
    surface_distance_99_m=0.0004,
    axis_error_99_rad=0.01,
    step_worst_m=0.021,
    turn_worst_rad=0.02,
    bend_worst_rad_m=1.5,
    path_length_m=5.0,
    process_length_m=4.0,
    cycle_time_s=50.0,
    compared_with="the mesh as given (12 triangles)",
    resolution_m=0.0,
    true_distance_worst_m=0.0012,
    true_distance_99_m=0.0008,
    true_distance_95_m=0.0006,
)


def made_up(confidence=0.8, metrics=METRICS, missing="", reason="", **changes):
    """A transfer of one process, of these figures, that nobody planned."""
    taught = bound_knowledge({"top": [{**SAND, **changes}]})
    (process,) = taught.knowledge.regions[0].processes
    match = Match(taught.regions["top"], np.zeros((0, 3)), np.full(100, confidence), "mask")
    line = taught.cloud.points[taught.regions["top"]][:5]
    held = np.tile([1.0, 0.0, 0.0, 0.0], (5, 1))
    segment = Segment("process", 0, line, held, process.feed_m_s, process.force_n)
    path = None if missing or reason else tool_path("top", process, [segment])
    step = PathResult(
        "top",
        0,
        process,
        process.transfer_mode,
        path,
        metrics if path else None,
        (),
        missing or reason,
    )
    regions = {"top": FoundRegion("top", match, missing)}
    return TransferResult(taught, taught.cloud, regions, (step,), (), {"regions": 0.3})


def bound_knowledge(processes, reference=None, **changes):
    """Knowledge of processes by face, on a box."""
    reference = cloud() if reference is None else reference
    regions = {name: faces(reference)[name] for name in processes}
    rows = [
        {"name": name, "indices": regions[name].tolist(), "processes": given}
        for name, given in processes.items()
    ]
    content = {"category": "chair", "reference": {"cloud": "box.ply"}, "regions": rows, **changes}
    return BoundKnowledge(Knowledge.model_validate(content), reference, regions)
