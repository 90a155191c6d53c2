"""The ablation of losses: the paper's Table III.

In come training data and a configuration; out go runs, each without one loss of the last stage,
and a table of their scores.
"""
