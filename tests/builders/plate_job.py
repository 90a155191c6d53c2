"""A job on a plate, in its folder."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.spatial.transform import Rotation

from nrdf.toolpath.types import Segment


def write_job_on(folder, points, normals, region, segments):
    """A job on an object (n, 3), (n, 3) whose first points, so many, are the region 'top'."""
    import nrdf
    from nrdf.process.knowledge import Knowledge, Reference, Region
    from nrdf.process.knowledge_file import write_knowledge
    from nrdf.process.process import Process
    from nrdf.process.strategy import tool_path
    from nrdf.process.tool_keys import Tool
    from nrdf.toolpath.file import write_toolpaths
    from nrdf.toolpath.types import Job

    nrdf.write_cloud(folder / "target.ply", nrdf.PointCloud(points, normals, unit="m"))
    process = Process(
        kind="sand",
        stepover_m=0.03,
        feed_m_s=0.1,
        force_n=10.0,
        tool=Tool(name="disc", radius_m=0.025),
    )
    region = Region(name="top", indices=list(range(region)), processes=[process])
    knowledge = Knowledge(
        category="chair", reference=Reference(cloud="target.ply"), regions=[region]
    )
    write_knowledge(folder / "knowledge.yaml", knowledge)
    path = tool_path("top", process, segments)
    write_toolpaths(folder, Job("chair", "target", (path,)))
    return folder


def write_plate_job(folder):
    """A plate of 0.3 m with one region, in its folder."""
    rng = np.random.default_rng(0)
    flat = rng.uniform(-0.15, 0.15, (2500, 2))
    top = np.stack([flat[:, 0], np.full(2500, 0.42), flat[:, 1]], axis=1)
    below = top - [0.0, 0.03, 0.0]
    up = np.tile([0.0, 1.0, 0.0], (2500, 1))
    turned = np.tile([np.sqrt(0.5), 0.0, 0.0, np.sqrt(0.5)], (9, 1))
    segments = []
    for number, z in enumerate((-0.05, 0.0, 0.05)):
        line = np.stack([np.linspace(-0.1, 0.1, 9), np.full(9, 0.42), np.full(9, z)], axis=1)
        segments.append(Segment("process", number, line, turned, 0.1, 10.0))
    whole = np.concatenate([top, below]), np.concatenate([up, -up])
    return write_job_on(folder, *whole, 2500, segments)


def turned_job(job, folder, pose):
    """The job of one folder, its object and tool paths, in another frame and folder."""
    import nrdf
    from nrdf.toolpath.file import read_toolpaths, write_toolpaths

    def turned(segment):
        held = Rotation.from_matrix(pose.rotation) * Rotation.from_quat(segment.quaternions_xyzw)
        positions = pose.to_scan(segment.positions)
        return replace(segment, positions=positions, quaternions_xyzw=held.as_quat())

    (folder / "knowledge.yaml").write_text((job / "knowledge.yaml").read_text())
    cloud = nrdf.read_cloud(job / "target.ply")
    normals = cloud.normals @ pose.rotation.T
    nrdf.write_cloud(
        folder / "target.ply", replace(cloud, points=pose.to_scan(cloud.points), normals=normals)
    )
    whole = read_toolpaths(job)
    paths = tuple(replace(p, segments=tuple(map(turned, p.segments))) for p in whole.paths)
    write_toolpaths(folder, replace(whole, paths=paths, pose=pose))
    return folder
