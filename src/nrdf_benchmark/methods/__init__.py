"""Everything that finds regions of a reference on a target, ours and the rivals', under one call.

In come two clouds and the reference's regions; out go indices of the target's points, by region.
"""
