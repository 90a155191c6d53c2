"""The content of small knowledge files."""

from __future__ import annotations

import json

from nrdf.process.knowledge_file import KNOWLEDGE_FILE

SAND = {"kind": "sand", "stepover_mm": 15, "tool": {"radius_mm": 25}, "feed_mm_s": 100}
TAUGHT = {**SAND, "trajectory": "taught", "waypoints": [{"positions_m": [[0, 0, 0], [1, 0, 0]]}]}


def content(process=SAND, region=(("indices", [1, 2]),), **changes):
    """A small file's content, its first process or region changed."""
    return {
        "version": 1,
        "category": "chair",
        "reference": {"cloud": "ref.ply"},
        "regions": [{"name": "seat", **dict(region), "processes": [process]}],
        **changes,
    }


def parsed(**changes):
    return KNOWLEDGE_FILE.parse(json.dumps(content(**changes)), "k.yaml", as_json=True)
