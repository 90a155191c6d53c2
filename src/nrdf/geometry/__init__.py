"""Shapes in space: canonical coordinates, frames, polylines, normals, meshes, winding numbers.

In come arrays of points, normals, vertices and faces; out come arrays. Nothing here reads a file.
"""
