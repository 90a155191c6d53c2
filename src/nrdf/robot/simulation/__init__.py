"""A job executed on the arm in MuJoCo.

In: a job's folder and an arm. Out: logs of every action, with force and collisions, and the metrics
of each tool path.
"""
