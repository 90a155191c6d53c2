"""Training of fields, and of the small networks beside them.

In: folders of prepared shapes (`nrdf.shapes.dataset`) and a configuration. Out: a run's folder with
checkpoints, metrics and, at the end, a weight file that says what it was trained on.
"""
