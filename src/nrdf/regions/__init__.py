"""Regions of a reference, found on targets.

In: encoded clouds and regions of a reference (masks, indices or points). Out: a `Match` for each
region: the target's points in it, how sure that is, and whether the target has it at all.
"""
