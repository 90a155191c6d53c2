"""The studio's three-dimensional scene, drawn with viser.

In: point clouds, regions, tool paths and a simulated arm. Out: what every connected browser shows.
"""
