"""What a process does to a surface: the film that it lays on, the depth that it takes off.

In: tool paths on a region's mesh, a gun's spray profile or a sanding pad, a target.
Out: micrometres for every cell of the surface, how even they are, and feeds that make them so.
"""
