"""A tiny training of three stages, whose third has every loss that can be left out."""

from __future__ import annotations

from builders.tiny_field import tiny_config

PAPER = {"chamfer": 10, "emd": 1, "smoothness": 0.1, "normal_consistency": 0.01}
WEIGHTS = {"occupancy": 10, "self": 1, **PAPER, "descriptor_distance": 0.1}
STAGES = [
    {"name": "a", "weights": {"occupancy": 1}, "steps": 2, "batch_size": 4, "rate": 0.01},
    {"name": "b", "weights": {"occupancy": 1, "self": 1}, "steps": 3, "batch_size": 4},
    {"name": "c", "weights": WEIGHTS, "steps": 4, "batch_size": 4, "rate": 0.01},
]
CONFIG = tiny_config(stages=STAGES)
