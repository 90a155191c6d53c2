"""From a document to process knowledge, by the rules of the knowledge file."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, get_args

import numpy as np

from nrdf.errors import ProcessError
from nrdf.geometry.units import OTHER_UNITS, to_si
from nrdf.process.bound_knowledge import BoundKnowledge, checksum, overlaps, resolve
from nrdf.process.knowledge import Knowledge
from nrdf.process.knowledge_file import KNOWLEDGE_FILE
from nrdf.process.new_knowledge import DEFAULTS
from nrdf.process.process import Process, Trajectory
from nrdf.studio.model.document import Document, PaintedRegion

PATTERNS = tuple(name for name in get_args(Trajectory) if name != "taught")
NUMBERS = (
    "stepover_mm", "spacing_mm", "edge_margin_mm", "passes", "force_n", "force_tolerance_n",
    "feed_mm_s", "lead_deg", "tilt_deg", "standoff_mm", "spindle_rpm",
)  # fmt: skip
"""The numbers of a process that the page asks for, by their names in a knowledge file."""
_OPTIONAL = ("force_n", "force_tolerance_n", "spindle_rpm")  # 0 on the page: there is none
ORIGIN = "the studio"


def new_step(kind: str) -> dict[str, Any]:
    """A process of a kind with the values that `nrdf teach` gives it."""
    content = {"kind": kind, **DEFAULTS[kind]}  # type: ignore[index]
    return plain_step(Process.model_validate(content))


def plain_step(process: Process) -> dict[str, Any]:
    """A process as a knowledge file holds it, in SI, with the stepover in place of the overlap."""
    content = process.model_dump(mode="json", exclude_defaults=True)
    if process.trajectory != "taught":
        content.pop("overlap", None)
        content["stepover_m"] = process.distance_between_lines_m
    return content


def shown_numbers(step: Mapping[str, Any]) -> dict[str, float]:
    """The numbers of a step as the page shows them, by the names of `NUMBERS`."""
    defaults = {"spacing_m": 0.01, "passes": 1}
    shown = {}
    for name in NUMBERS:
        si, factor = _si(name)
        value = step.get(si, defaults.get(si, 0.0))
        shown[name] = float(f"{value / factor:.6g}")
    return shown


def changed_step(step: Mapping[str, Any], shown: Mapping[str, float]) -> dict[str, Any]:
    """The step with numbers as the page shows them."""
    content = dict(step)
    for name, value in shown.items():
        si, _ = _si(name)
        if name in _OPTIONAL and value == 0:
            content.pop(si, None)
        else:
            number = int(value) if name == "passes" else float(value)
            content |= to_si({name: number}, [si])
    return content


def process_of(region: PaintedRegion, number: int) -> Process:
    """One step of a region. Raises ProcessError naming region, field and value."""
    content = _content("chair", {"points_m": [(0.0, 0.0, 0.0)]}, (region,))
    return KNOWLEDGE_FILE.validated(content, ORIGIN).regions[0].processes[number]


def knowledge_of(clouds: Path, document: Document) -> Knowledge:
    """The document as process knowledge, whose file belongs into the folder of the clouds.

    Raises ProcessError for a document without reference or regions, and as `ModelFile.validated`.
    """
    if document.reference is None:
        raise ProcessError("there is no reference yet: load one in step 1")
    drawn = tuple(region for region in document.regions if region.mask.any())
    if not drawn:
        raise ProcessError("no region is painted yet: paint one in step 2")
    path = clouds / document.reference.file
    reference = {"cloud": document.reference.file, "sha256": checksum(path)}
    return KNOWLEDGE_FILE.validated(
        {
            "model": document.model,
            "allow_overlap": document.allow_overlap,
            "allow_unusual": document.allow_unusual,
            "origin": dict(document.origin),
            **_content(document.category, reference, drawn),
        },
        ORIGIN,
    )


def bound_knowledge_of(clouds: Path, document: Document) -> BoundKnowledge:
    """The document as knowledge bound to its reference.

    Raises ProcessError for regions that overlap, and what `knowledge_of` and
    `nrdf.process.bound_knowledge.resolve` raise.
    """
    regions = {r.name: np.flatnonzero(r.mask) for r in document.regions if r.mask.any()}
    for line in [] if document.allow_overlap else overlaps(regions):
        raise ProcessError(
            f"{line.partition(';')[0]}; erase those points, which are dark, from one of them in "
            "step 2, or tick 'Regions may overlap' there"
        )
    return resolve(knowledge_of(clouds, document), clouds, ORIGIN)


def _content(
    category: str, reference: Mapping[str, Any], regions: tuple[PaintedRegion, ...]
) -> dict[str, Any]:
    return {
        "category": category,
        "reference": dict(reference),
        "regions": [
            {
                "name": region.name,
                "indices": np.flatnonzero(region.mask).tolist(),
                "fill_holes": region.fill_holes,
                "processes": [dict(step) for step in region.steps],
            }
            for region in regions
        ],
    }


def painted_regions_of(
    bound_knowledge: BoundKnowledge, colours: Mapping[str, tuple[int, int, int]]
) -> tuple[PaintedRegion, ...]:
    """The regions and process steps of knowledge, to be changed on the page."""
    painted = []
    for region in bound_knowledge.knowledge.regions:
        mask = np.zeros(len(bound_knowledge.cloud), bool)
        mask[bound_knowledge.regions[region.name]] = True
        steps = tuple(plain_step(process) for process in region.processes)
        colour = colours[region.name]
        painted.append(PaintedRegion(region.name, colour, mask, steps, region.fill_holes))
    return tuple(painted)


def si_name(name: str) -> str:
    """The name that an SI knowledge file has for a number that the page asks for."""
    return _si(name)[0]


def _si(name: str) -> tuple[str, float]:
    """The SI name of a field in a file's unit, and the factor to it."""
    for other, (si, factor) in OTHER_UNITS.items():
        if name.endswith(other):
            return name.removesuffix(other) + si, factor
    return name, 1.0
