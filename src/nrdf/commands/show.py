"""`nrdf demo`: regions of a bundled chair, found on three others, beside the exact truth."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from nrdf.commands.console import (
    command_line,
    console,
    provenance,
    show,
    table,
    versions,
    write_report,
)

if TYPE_CHECKING:
    import numpy as np

    from nrdf.regions.model import Match


def demo(
    out: Path = Path("demo"), model: str = "chair", device: str = "cpu", overwrite: bool = False
) -> None:
    """Find five regions of a bundled chair on three other chairs.

    The chairs are members of the parametric family that no training set holds, so the true
    regions are known exactly; the table shows found against true. Writes a picture, a report and
    PLY files that `nrdf retrieve` takes.

    Example: nrdf demo --out demo --overwrite

    Args:
        out: Folder to write; made if missing.
        model: Zoo name, weight file or run of the category chair.
        device: cpu, cuda, cuda:N or auto.
        overwrite: Replace an earlier demo in the output folder.
    """
    from nrdf.bundled import REFERENCE, TARGETS
    from nrdf.output import output_folder

    with output_folder(out, overwrite) as folder:
        results = _run(folder, model, device)
    _show(results)
    ply = f"{out}/{REFERENCE}"
    console.print(
        f"\npicture, report and PLY files in {out}; next, for instance:\n"
        f"nrdf retrieve --model {model} --reference {ply}.ply --region {ply}/seat.ply "
        f"{ply}/legs.ply --target {out}/{TARGETS[0]}.ply --out result",
    )


@dataclass(frozen=True)
class Found:
    """One region on one chair: points found and true, intersection over union, confidence."""

    chair: str
    region: str
    found: int
    true: int
    iou: float
    confidence: float
    seconds: float


def overlap(indices: np.ndarray, truth: np.ndarray) -> float:
    """Intersection over union of found indices (k,) and a true mask (n,); 1 if both are empty."""
    common = int(truth[indices].sum())
    union = len(indices) + int(truth.sum()) - common
    return common / union if union else 1.0


def _run(folder: Path, model: str, device: str) -> list[Found]:
    import time

    import nrdf
    from nrdf.bundled import REFERENCE, TARGETS, bundled_chair
    from nrdf.commands.retrieve import region_panel, write_matches
    from nrdf.picture import draw_regions

    loaded = nrdf.load_model(model, device)
    reference, regions = bundled_chair(REFERENCE)
    taught = loaded.set_reference(reference)
    nrdf.write_cloud(folder / f"{REFERENCE}.ply", reference)
    (folder / REFERENCE).mkdir()
    for name, mask in regions.items():
        nrdf.write_cloud(folder / REFERENCE / f"{name}.ply", reference.select(mask))
    panels = [region_panel(REFERENCE, reference, regions, "its five regions, given")]
    results: list[Found] = []
    for chair in TARGETS:
        target, truth = bundled_chair(chair)
        start = time.perf_counter()
        matches = taught.retrieve_all(regions, target)
        seconds = time.perf_counter() - start
        found = _compare(chair, matches, truth, seconds)
        results += found
        mean = sum(row.iou for row in found) / len(found)
        note = f"found in {seconds:.2f} s · mean IoU {mean:.2f}"
        panels.append(region_panel(chair, target, {n: m.indices for n, m in matches.items()}, note))
        nrdf.write_cloud(folder / f"{chair}.ply", target)
        (folder / chair).mkdir()
        write_matches(folder / chair, target, matches)
    draw_regions(panels, folder / "picture.png")
    report = {
        "command": command_line(),
        "model": provenance(loaded.metadata),
        "unit": "m",
        "found": [vars(row) for row in results],
        "versions": versions(),
    }
    write_report(folder, report)
    return results


def _compare(
    chair: str, matches: dict[str, Match], truth: dict[str, np.ndarray], seconds: float
) -> list[Found]:
    return [
        Found(
            chair=chair,
            region=name,
            found=len(match.indices),
            true=int(truth[name].sum()),
            iou=round(overlap(match.indices, truth[name]), 4),
            confidence=round(match.score, 4),
            seconds=round(seconds, 4),
        )
        for name, match in matches.items()
    ]


def _show(results: list[Found]) -> None:
    shown = table("", "chair", "region", "points found", "true", "IoU", "confidence", "s")
    before = None
    for row in results:
        first = row.chair != before
        if first and before is not None:
            shown.add_section()
        before = row.chair
        shown.add_row(
            row.chair if first else "", row.region, str(row.found), str(row.true),
            f"{row.iou:.2f}", f"{row.confidence:.2f}", f"{row.seconds:.2f}" if first else "",
        )  # fmt: skip
    show(shown)
