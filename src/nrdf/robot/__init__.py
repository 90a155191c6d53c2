"""Tool paths on a robot arm, before anything moves.

In: a job's tool paths with their object, and an arm (URDF or MJCF). Out: what the arm reaches, its
joint trajectories, force, collisions and coverage in simulation, and a report of them.
"""
