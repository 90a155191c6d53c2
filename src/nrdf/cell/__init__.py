"""The cell that programs are for: robot, tools and what switches them, where objects stand, limits.

In: a cell file, and jobs. Out: jobs in the robot's base frame, with the cell's tools.
"""
