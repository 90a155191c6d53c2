"""A training run as a program of its own, to be killed or started several times at once.

Usage: train_tiny.py DATA OUT [config changes as JSON]
"""

from __future__ import annotations

import json
import logging
import sys

from builders.tiny_field import tiny_config
from nrdf.field import PRESETS
from nrdf.training import progress
from nrdf.training.loop import train

if __name__ == "__main__":
    logging.basicConfig(level=logging.INFO, format="%(message)s")
    progress._tensorboard = lambda folder, step: None  # takes seconds to import
    PRESETS["tiny"] = "builders.tiny_field:TinyField"
    changes = json.loads(sys.argv[3]) if len(sys.argv) > 3 else {}
    train(tiny_config(**changes), [sys.argv[1]], sys.argv[2], category="ball", device="cpu")
