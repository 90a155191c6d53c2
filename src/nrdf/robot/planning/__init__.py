"""From tool paths to timed joint trajectories.

In: a cell and the segment groups of a tool path. Out: joint paths that cover them, and a program of
actions with the free moves between them.
"""
