"""Tool paths on real meshes, judged by the mesh that was given.

Labelled furniture, cars and single meshes come in, in metres with regions. Tables with the bars
that paths are held to go out, and every region's figures as CSV and JSON.
"""
