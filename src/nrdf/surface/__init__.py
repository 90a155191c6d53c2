"""The surface to work on.

In: an object's points with outward normals, in metres, and regions as indices of those points.
Out: the smooth surface, patches of a region that lie flat, and the points that a tool can access.
"""
