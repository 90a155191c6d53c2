"""Reading and writing files that may come from anybody.

In come paths, or objects of other libraries; out come checked clouds, meshes and plain values. What
is written appears whole or not at all.
"""
