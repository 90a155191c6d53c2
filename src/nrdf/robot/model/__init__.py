"""The work cell as geometry: arm, tool, object and floor.

In: a robot file, a tool path's tool, the object's points or mesh. Out: kinematics, and distances
from everything that must not be touched.
"""
