"""Process knowledge and its transfer to new objects.

In: a knowledge file (YAML or JSON) with its reference cloud, a model, and a target cloud.
Out: the regions and measured tool paths on the target (`TransferResult`), warnings and limits.
"""
