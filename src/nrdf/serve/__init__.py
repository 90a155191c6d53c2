"""Many objects: one transferred, a queue with its store, a watched folder, a service, a cluster.

In: a cell file and objects as they come. Out: one folder and one outcome for each.
"""
