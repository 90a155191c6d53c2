"""New knowledge to fill in: the reference, its regions, and default values for each kind."""

from __future__ import annotations

import logging
import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, get_args

from nrdf.errors import ProcessError, unknown_name
from nrdf.field.cloud_encoder import MINIMUM_POINTS
from nrdf.io.cloud import check_cloud, read_cloud
from nrdf.process.bound_knowledge import checksum, known_unit, overlaps, resolve
from nrdf.process.knowledge import Knowledge
from nrdf.process.knowledge_file import KNOWLEDGE_FILE
from nrdf.process.model_choice import choose_model
from nrdf.process.process import Kind
from nrdf.regions.files import read_regions

log = logging.getLogger(__name__)

KINDS: tuple[Kind, ...] = get_args(Kind)
PLACEHOLDER = "my-region"

_PAD = {"name": "pad", "radius_mm": 25, "clearance_mm": 20}
DEFAULTS: Mapping[Kind, Mapping[str, Any]] = {
    "sand": {
        "tool": {"name": "sanding disc", "radius_mm": 25, "clearance_mm": 20},
        "overlap": 0.4, "edge_margin_mm": 10, "lead_deg": 3,
        "line_order": "zigzag", "lead_in_radius_mm": 15, "lead_out_radius_mm": 15,
        "force_n": 20, "force_tolerance_n": 5, "feed_mm_s": 100, "spindle_rpm": 6000,
    },
    "polish": {
        "tool": {"name": "polishing pad", "radius_mm": 25, "clearance_mm": 20},
        "trajectory": "cross-hatch", "overlap": 0.5, "edge_margin_mm": 5,
        "line_order": "zigzag", "lead_in_radius_mm": 15, "lead_out_radius_mm": 15,
        "force_n": 10, "force_tolerance_n": 3, "feed_mm_s": 80, "spindle_rpm": 2000,
    },
    "oil": {
        "tool": {"name": "oil pad", "radius_mm": 25, "clearance_mm": 20},
        "overlap": 0.2, "line_order": "zigzag",
        "force_n": 5, "force_tolerance_n": 2, "feed_mm_s": 150,
    },
    "paint": {
        "tool": {"name": "spray gun", "radius_mm": 60},
        "overlap": 0.5, "line_order": "snake", "run_off_mm": 60,
        "standoff_mm": 200, "feed_mm_s": 300, "constant_speed": True,
        "approach": {"distance_mm": 50, "feed_mm_s": 300},
        "retract": {"distance_mm": 50, "feed_mm_s": 300},
    },
    "clean": {
        "tool": {"name": "brush", "radius_mm": 30, "clearance_mm": 20},
        "overlap": 0.3, "line_order": "zigzag",
        "force_n": 5, "force_tolerance_n": 2, "feed_mm_s": 150,
    },
    "inspect": {
        "tool": {"name": "camera", "radius_mm": 80},
        "overlap": 0.3, "line_order": "snake", "heading": "fixed",
        "standoff_mm": 300, "feed_mm_s": 50, "spacing_mm": 40,
    },
    "custom": {"name": "what is done", "tool": _PAD, "overlap": 0.3, "feed_mm_s": 100},
}  # fmt: skip
"""Default values for each kind of process; docs/guides/teach.md says why."""


def new_knowledge(
    reference: Path,
    category: str,
    folder: Path,
    regions: Sequence[Path] = (),
    kinds: Sequence[str] = ("sand",),
    unit: str | None = None,
    model: str | None = None,
    allow_unusual: bool = False,
) -> Knowledge:
    """Knowledge to fill in, for a file in `folder`.

    regions: region files, warned about where they overlap; without them there is one placeholder,
    whose file has still to be made. kinds: of the process on each region, or one for all. unit:
    of the reference, where its file does not say. model: of the category, instead of the zoo's.
    allow_unusual: take a category that is nearly called like a known one.

    Raises ProcessError for an unknown kind or category, kinds that do not fit the regions and an
    unknown unit; RegionError and CloudError for files that cannot be read, or regions that are not
    on the reference.
    """
    for kind in kinds:
        if kind not in KINDS:
            raise ProcessError(unknown_name("process kind", kind, KINDS))
    chosen = choose_model(category, model, allow_unusual)
    if chosen.note:
        log.info("%s", chosen.note)
    named = chosen.name != category and not Path(chosen.name).exists()
    cloud = read_cloud(reference)
    check_cloud(cloud, MINIMUM_POINTS)
    known = known_unit(cloud, unit, category, str(reference), "--unit")
    rows = []
    for path in regions:
        found = read_regions([path], known)
        rows += [{"name": name, "file": _relative(path, folder)} for name in found]
    rows = rows or [{"name": PLACEHOLDER, "file": f"{PLACEHOLDER}.ply"}]
    if len(kinds) not in (1, len(rows)):
        raise ProcessError(
            f"{len(kinds)} kinds for {len(rows)} regions; give one for each, or one for all"
        )
    every = list(kinds) * (len(rows) // len(kinds))
    content = {
        "category": category,
        "model": chosen.name if named else None,
        "allow_unusual": allow_unusual,
        "reference": {
            "cloud": _relative(reference, folder),
            "sha256": checksum(reference),
            "unit": None if cloud.unit else known,
        },
        "regions": [
            {**row, "processes": [{"kind": kind, **DEFAULTS[kind]}]}  # type: ignore[index]
            for row, kind in zip(rows, every, strict=True)
        ],
    }
    knowledge = KNOWLEDGE_FILE.validated(content, "the new file")
    if regions:
        bound_knowledge = resolve(
            knowledge.model_copy(update={"allow_overlap": True}), folder, "the new file"
        )
        for line in overlaps(bound_knowledge.regions):
            log.warning("%s", line)
    return knowledge


def _relative(path: Path, folder: Path) -> str:
    """The path as seen from a folder, with forward slashes on every system."""
    return Path(os.path.relpath(path.absolute(), folder.absolute())).as_posix()
