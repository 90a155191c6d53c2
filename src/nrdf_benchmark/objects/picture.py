"""Pictures of the worst pairs of labelled objects."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from nrdf.viz.picture import Panel, draw_regions
from nrdf_benchmark.methods.registry import MethodSpec
from nrdf_benchmark.objects.dataset import Labels
from nrdf_benchmark.objects.pairs import THERE
from nrdf_benchmark.objects.retrieval import ObjectPairResult, ObjectRetrieval
from nrdf_benchmark.objects.sampling import FLOOR, LabelledCloud

WORST = 10


def worst_pairs(results: Sequence[ObjectPairResult], count: int = WORST) -> list[ObjectPairResult]:
    """The pairs of least mean part IoU, the worst first, of equal ones those with most parts; those
    without a part in common are left out."""
    known = [(result, found) for result in results if (found := _found(result))]
    known.sort(key=lambda item: (np.mean(item[1]), -len(item[1])))
    return [result for result, _ in known[:count]]


def draw_pair(
    retrieval: ObjectRetrieval, spec: MethodSpec, result: ObjectPairResult, path: Path
) -> None:
    """The reference with its labels, and the target with what a method found and with its own.

    Pieces that count nowhere are drawn in a colour of their own. Raises OutputError.
    """
    found = retrieval.find(spec, result.views, result.reference, result.target)[0]
    whole, seen = (
        retrieval.whole_cloud(result.reference),
        retrieval.target_cloud(result.target, result.views).labelled,
    )
    parts = {part.part: part for part in result.parts}
    said = []
    for name, part in parts.items():
        text = part.reason or ("" if part.found else "nowhere")
        value = (part.state or "not counted") if part.iou is None else f"{part.iou:.2f}"
        said.append(f"{name} {value}" + f" ({text})" * bool(text))
    own = _true(retrieval.labels, whole)
    drawn = {name: own[name] for name in (*parts, *retrieval.labels.ignored) if name in own}
    panels = [
        _panel(f"reference: {result.reference}", whole, drawn),
        _panel(f"found: {result.target}", seen, found, ", ".join(said)),
        _panel(f"true: {result.target}", seen, _true(retrieval.labels, seen)),
    ]
    draw_regions(panels, path)


def draw_worst(
    retrieval: ObjectRetrieval, spec: MethodSpec, results: Sequence[ObjectPairResult], folder: Path
) -> list[Path]:
    """A picture of each of the worst pairs, in a folder that is made; their paths."""
    folder.mkdir(exist_ok=True)
    paths = []
    for number, result in enumerate(worst_pairs(results), 1):
        names = f"{result.reference}-to-{result.target}".replace("/", "_")
        paths.append(folder / f"{number:02d}-{names}.png")
        draw_pair(retrieval, spec, result, paths[-1])
    return paths


def _found(result: ObjectPairResult) -> list[float]:
    return [part.iou or 0.0 for part in result.parts if part.state == THERE]


def _true(labels: Labels, seen: LabelledCloud) -> dict[str, np.ndarray]:
    names = (*labels.parts, *labels.ignored)
    found = {name: np.flatnonzero(seen.label == name) for name in names}
    return {name: indices for name, indices in found.items() if len(indices)}


def _panel(
    title: str, seen: LabelledCloud, regions: Mapping[str, np.ndarray], note: str = ""
) -> Panel:
    """The object alone, upright, its front as it is in truth."""
    kept = seen.label != FLOOR
    number = np.cumsum(kept) - 1
    chosen = {name: number[i[kept[i]]] for name, i in regions.items()}
    points = seen.pose.to_canonical(seen.cloud.points[kept])
    normals = None if seen.cloud.normals is None else seen.cloud.normals[kept] @ seen.pose.rotation
    return Panel(title, points, normals, chosen, note)
