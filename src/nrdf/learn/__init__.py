"""A model of one's own kind of object, from a folder of meshes and scans, in one command.

In: files of 3 or more objects of one kind, in any heading. Out: a model in the user's own zoo, the
best of the general model trained further on them, the general model as it is, and registration,
with the errors of all on objects kept out of training.
"""
