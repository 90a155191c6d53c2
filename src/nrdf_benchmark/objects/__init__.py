"""Real objects, meshes whose faces carry the names of their parts.

In come a folder of such meshes and methods that find regions; out go the overlap of every part
with its label, by pair, and how many pairs come from a mesh file to robot programs.
"""
