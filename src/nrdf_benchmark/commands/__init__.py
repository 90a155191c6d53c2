"""The benchmark's commands, `nrdf eval ...` and `nrdf ablate`, one module each.

They come in as entry points of the group `nrdf.commands` (pyproject.toml). What goes out are tables
on the terminal and, with `--out`, files. Nothing heavy is imported before a command runs.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any


def evaluations() -> dict[str, Callable[..., Any]]:
    """Measure how good and how fast: benchmarks, exact truth, speed.

    Example: nrdf eval bsrc --data bsrc/ --category chair --method nrdf copy box --out results/
    """
    from nrdf_benchmark.commands.arm import arm
    from nrdf_benchmark.commands.bsrc import bsrc
    from nrdf_benchmark.commands.families import families
    from nrdf_benchmark.commands.kind import kind
    from nrdf_benchmark.commands.line import line
    from nrdf_benchmark.commands.objects import objects
    from nrdf_benchmark.commands.presence import presence
    from nrdf_benchmark.commands.process import process
    from nrdf_benchmark.commands.scans import scans
    from nrdf_benchmark.commands.shape import shape
    from nrdf_benchmark.commands.speed import speed
    from nrdf_benchmark.commands.toolpaths import toolpaths
    from nrdf_benchmark.commands.unseen import unseen
    from nrdf_benchmark.commands.warp import warp

    return {
        "bsrc": bsrc,
        "objects": objects,
        "unseen": unseen,
        "families": families,
        "warp": warp,
        "scans": scans,
        "shape": shape,
        "kind": kind,
        "presence": presence,
        "toolpaths": toolpaths,
        "process": process,
        "speed": speed,
        "line": line,
        "arm": arm,
    }
