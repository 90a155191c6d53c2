"""Robot programs of your own tool paths: writes the folder programs into the current one.

python examples/04_robot_programs.py
"""

from pathlib import Path

import numpy as np

from nrdf.export.options import Options
from nrdf.export.registry import export_job
from nrdf.toolpath.types import Job, Segment, ToolPath

DOWN = (1.0, 0.0, 0.0, 0.0)  # xyzw: tool z down into the table, tool x along +X
BACK = (0.0, 1.0, 0.0, 0.0)  # the same, tool x along -X

segments = []
for line, y in enumerate(np.arange(0.0, 0.1, 0.025)):  # a raster in snake order, m
    x = np.linspace(0.0, 0.3, 16)[:: 1 if line % 2 == 0 else -1]  # (16,)
    on = np.stack([x, np.full(16, y), np.zeros(16)], axis=1)  # (16, 3)
    above = on + np.array([0.0, 0.0, 0.05])  # (16, 3), 50 mm over the surface
    quaternions = np.tile(BACK if line % 2 else DOWN, (16, 1))  # (16, 4), xyzw
    segments += [  # each: positions (n, 3) and quaternions (n, 4)
        Segment("approach", line, np.stack([above[0], on[0]]), quaternions[:2], feed_m_s=0.1),
        Segment("process", line, on, quaternions, feed_m_s=0.05, force_n=15.0),
        Segment("retract", line, np.stack([on[-1], above[-1]]), quaternions[:2], feed_m_s=0.1),
    ]
sanding = ToolPath("table top", "sand", "disc", tool_radius_m=0.03, segments=tuple(segments))
job = Job("table", "fixture", (sanding,))

files = export_job(job, ["urscript", "rapid", "krl", "csv"], Path("programs"), Options(blend_mm=2))
for name, written in files.items():
    print(f"{name:9s} {', '.join(written)}")
