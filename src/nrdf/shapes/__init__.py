"""Where training shapes come from: meshes, parametric families, boxes; and their files.

In come mesh files or random seeds; out come folders of shapes with surface points, occupancy
queries and correspondences.
"""
