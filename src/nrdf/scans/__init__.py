"""Scans in any pose, with floor, noise and other objects in view.

In: a cloud as a sensor gives it, and a trained encoder of the category. Out: an `AlignedScan`: the
object alone, its poses with probabilities, its unit and kind, and warnings in words.
"""
