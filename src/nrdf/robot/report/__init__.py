"""A simulation as files.

In: a simulation's result. Out: a folder with joint trajectories, report.json, report.html, pictures
and a film.
"""
