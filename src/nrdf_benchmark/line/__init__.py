"""A line under load: objects a minute, memory, `kill -9`, hostile clients, a cluster's size.

In: a cell file and objects, or light ones that it makes itself. Out: figures, and line.json.
"""
