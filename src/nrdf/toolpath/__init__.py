"""Tool paths on a surface.

In: a surface, a region as indices of its points, and a strategy: the planner's settings.
Out: segments of waypoints, their metrics, and the file of a job's tool paths.
"""
