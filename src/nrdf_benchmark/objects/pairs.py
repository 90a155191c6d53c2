"""Which labelled objects are paired, which of their parts are regions, and how one is scored."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from nrdf.errors import DataError
from nrdf_benchmark.objects.dataset import LabelledMesh, Labels
from nrdf_benchmark.objects.sampling import FLOOR, LabelledCloud
from nrdf_benchmark.scans import LEAST, SEEN, UNSEEN

GROUPS = ("chair+stool",)
"""Categories that share parts."""
LEAST_SHARE = 0.005
"""Share of an object's surface from which on, and from `LEAST` points on, a label is a part."""
THERE, ABSENT, HIDDEN = "there", "absent", "hidden"


def group_categories(
    categories: Iterable[str], groups: Sequence[str] = GROUPS
) -> dict[str, tuple[str, ...]]:
    """Sets of categories by name: the groups that are there, and each other category alone.

    groups: categories joined by "+". One of which a single category is there counts as that one.
    Raises DataError for a category that is in two groups.
    """
    there = list(dict.fromkeys(categories))
    joined = [[name for name in group.split("+") if name in there] for group in groups]
    every = [name for members in joined for name in members]
    if len(every) > len(set(every)):
        raise DataError(f"groups {', '.join(groups)}: each category can be in one of them only")
    alone = [[name] for name in there if name not in every]
    return {"+".join(members): tuple(members) for members in [*joined, *alone] if members}


def draw_pairs(pairs: Sequence[tuple[str, str]], count: int) -> list[tuple[str, str]]:
    """A random sample of some pairs, always the same of the same pairs, in their order."""
    chosen = np.random.default_rng(0).permutation(len(pairs))[:count]
    return [pairs[i] for i in sorted(chosen.tolist())]


def parts_of(labels: Labels, cloud: LabelledCloud) -> dict[str, np.ndarray]:
    """The parts that are large enough to be regions: name to indices (k,) of the cloud."""
    found = {name: np.flatnonzero(cloud.label == name) for name in labels.parts}
    least = max(LEAST, LEAST_SHARE * len(cloud.label))
    return {name: indices for name, indices in found.items() if len(indices) >= least}


@dataclass(frozen=True)
class Truth:
    """What is true of an object, by its whole skin. share: of each part in it; parts: those large
    enough; lacked: those that it certainly has not; mixed: share of what counts nowhere."""

    share: dict[str, float]
    parts: tuple[str, ...]
    lacked: tuple[str, ...]
    mixed: float


def truth_of(labels: Labels, mesh: LabelledMesh, cloud: LabelledCloud) -> Truth:
    """Which parts an object has and lacks.

    Lacked are those that no face carries, unless a piece that counts nowhere is as large as a part:
    it may be one.
    """
    share = {name: cloud.share(name) for name in labels.parts}
    mixed = sum(cloud.share(name) for name in labels.ignored)
    present = {*np.unique(mesh.label).tolist()}
    lacked = tuple(name for name in labels.parts if name not in present)
    parts = tuple(parts_of(labels, cloud))
    return Truth(share, parts, lacked if mixed < LEAST_SHARE else (), mixed)


def state_of(name: str, truth: Truth, seen: LabelledCloud) -> str:
    """`THERE` for a part that the target has and that was seen, `ABSENT` for one that it lacks,
    `HIDDEN` for one that it has and that was not seen, "" where it cannot be said."""
    if name in truth.lacked:
        return ABSENT
    if name not in truth.parts:
        return ""
    count = int((seen.label == name).sum())
    due = truth.share[name] * int((seen.label != FLOOR).sum())
    if count >= max(SEEN * due, LEAST):
        return THERE
    return HIDDEN if count <= UNSEEN * due else ""


def part_iou(found: np.ndarray, name: str, labels: Labels, seen: LabelledCloud) -> float:
    """Intersection over union of the points found (k,) and those of a part; points of labels that
    count nowhere are left out of both. 0 where nothing was found."""
    counted = ~np.isin(seen.label, labels.ignored)
    chosen = np.zeros(len(seen.label), bool)
    chosen[found] = True
    chosen, true = chosen[counted], (seen.label == name)[counted]
    return float((chosen & true).sum() / max((chosen | true).sum(), 1))
