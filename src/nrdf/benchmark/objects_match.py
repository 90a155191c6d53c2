"""Methods on labelled objects: parts of a reference found on a target, whole or in a scan.

A `Finder` keeps what is known of each object, so that a pair costs what the pair alone needs.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from pathlib import Path

import numpy as np

import nrdf
from nrdf.benchmark.learned import FieldMatch
from nrdf.benchmark.methods import METHODS, MethodSpec, build_method
from nrdf.benchmark.objects import LabelledMesh, Labels, read_labels, read_object
from nrdf.benchmark.objects_pairs import THERE, Truth, part_iou, parts_of, state_of, truth_of
from nrdf.benchmark.objects_sample import LabelledCloud, sample_object, scan_object
from nrdf.benchmark.scans import UP, pose_error
from nrdf.cloud import PointCloud
from nrdf.errors import ConfigError, unknown_name
from nrdf.regions.embedded import Embedded
from nrdf.regions.model import MINIMUM_POINTS, Model
from nrdf.scans.judge import Judge
from nrdf.scans.target import AlignedScan, bring_in

MOST_VIEWS, MOST_POINTS = 20, 100_000
WHOLE = 0
"""Views of the whole cloud, in its own frame; otherwise the number of cameras of a scan."""


@dataclass(frozen=True)
class Settings:
    """All that a process needs to know. model: the weight file of the model that aligns."""

    folder: Path
    model: Path
    points: int = 8192
    normals: str = "estimated"
    device: str = "cpu"


@dataclass(frozen=True)
class Pose:
    """How well the target's scan was aligned: degrees of the whole rotation, relative error of the
    scale, whether the report doubted it, seconds."""

    degrees: float
    scale: float
    doubted: bool
    seconds: float


@dataclass(frozen=True)
class PartFigure:
    """One part of the reference on the target.

    state: in truth (`nrdf.benchmark.objects_pairs.state_of`). true, found: points. iou: None unless
    the part is there. Of a method that tells absence: reason ("" where it was found), score (mean
    confidence), and presence, what that was judged by: confidence, observed share, evidence.
    """

    part: str
    state: str
    true: int
    found: int
    iou: float | None
    reason: str = ""
    score: float | None = None
    confidence: float | None = None
    observed: float | None = None
    evidence: tuple[float, ...] = ()


@dataclass(frozen=True)
class PairFigure:
    """One method on one pair. views: `WHOLE`, or cameras of the target's scan; seconds: of finding
    all parts, target and reference embedded before; pose: of a scan."""

    method: str
    views: int
    reference: str
    target: str
    seconds: float
    parts: tuple[PartFigure, ...]
    pose: Pose | None = None


@dataclass(frozen=True)
class Seen:
    """A target as methods get it: points with labels, and the same as the field sees them."""

    labelled: LabelledCloud
    embedded: Embedded
    canonical: PointCloud
    pose: Pose | None = None
    aligned: AlignedScan | None = None

    def in_cloud(self, found: np.ndarray) -> np.ndarray:
        """Indices of `canonical` as those of all points of the cloud."""
        chosen = np.zeros(len(self.embedded.points), bool)
        chosen[found] = True
        indices = self.embedded.to_all(chosen)[0]
        return indices if self.aligned is None else self.aligned.cleaned.kept[indices]


class Finder:
    """Labelled objects of a folder, each read, sampled, scanned and embedded at most once."""

    def __init__(self, settings: Settings) -> None:
        self.settings = settings
        self.labels: Labels = read_labels(settings.folder)
        self.mesh: Callable[[str], LabelledMesh] = lru_cache(None)(self._mesh)
        self.whole: Callable[[str], LabelledCloud] = lru_cache(None)(self._whole)
        self.truth: Callable[[str], Truth] = lru_cache(None)(self._truth)
        self.seen: Callable[[str, int], Seen] = lru_cache(None)(self._seen)

    @cached_property
    def model(self) -> Model:
        return nrdf.load_model(str(self.settings.model), self.settings.device)

    @cached_property
    def judge(self) -> Judge:
        return Judge(self.model)

    def regions(self, key: str) -> dict[str, np.ndarray]:
        """The parts of an object that are large enough: name to indices of its whole cloud."""
        return parts_of(self.labels, self.whole(key))

    def run(self, spec: MethodSpec, views: int, reference: str, target: str) -> PairFigure:
        """Find all parts of a reference on a target by one method, and score them."""
        regions, seen = self.regions(reference), self.seen(target, views)
        match, cloud = build_method(spec), self.whole(reference).cloud
        start = time.perf_counter()
        if isinstance(match, FieldMatch):
            matches = match.find(cloud, regions, seen.embedded)
            found = {name: found.indices for name, found in matches.items()}
            if seen.aligned is not None:
                found = {name: seen.aligned.cleaned.kept[i] for name, i in found.items()}
        else:
            matches = {}
            found = match(cloud, regions, seen.canonical)
            found = {name: seen.in_cloud(indices) for name, indices in found.items()}
        seconds = time.perf_counter() - start
        truth, parts = self.truth(target), []
        for name, indices in found.items():
            state = state_of(name, truth, seen.labelled)
            true = int((seen.labelled.label == name).sum())
            iou = None
            if state == THERE:
                iou = part_iou(indices, name, self.labels, seen.labelled)
            said = matches.get(name)
            figure = PartFigure(name, state, true, len(indices), iou)
            if said is not None:
                judged = said.presence
                figure = replace(
                    figure,
                    reason=judged.reason,
                    score=said.score,
                    confidence=judged.confidence,
                    observed=judged.observed,
                    evidence=tuple(judged.evidence),
                )
            parts.append(figure)
        return PairFigure(spec.name, views, reference, target, seconds, tuple(parts), seen.pose)

    def _mesh(self, key: str) -> LabelledMesh:
        category, name = key.split("/")
        return read_object(self.settings.folder, category, name, self.labels)

    def _whole(self, key: str) -> LabelledCloud:
        return sample_object(self.mesh(key), self.settings.points, self.settings.normals)

    def _truth(self, key: str) -> Truth:
        return truth_of(self.labels, self.mesh(key), self.whole(key))

    def _seen(self, key: str, views: int) -> Seen:
        if views == WHOLE:
            labelled = self.whole(key)
            embedded = self.model.embed(labelled.cloud)
            return Seen(labelled, embedded, PointCloud(embedded.points, embedded.normals))
        labelled = scan_object(self.mesh(key), views)
        start = time.perf_counter()
        aligned = bring_in(self.judge, labelled.cloud, UP)
        seconds = time.perf_counter() - start
        degrees, scale = pose_error(aligned, labelled.pose)
        embedded = aligned.embed()
        return Seen(
            labelled,
            embedded,
            PointCloud(embedded.points, embedded.normals),
            Pose(degrees, scale, bool(aligned.doubts), seconds),
            aligned,
        )


@lru_cache(maxsize=1)
def finder(settings: Settings) -> Finder:
    """The one of this process."""
    return Finder(settings)


def check_usable(methods: Sequence[str]) -> None:
    """Raises ConfigError for a method that gives no sets of a target's points, or needs the
    target's own coordinates."""
    able = [n for n, e in METHODS.items() if not e.is_learned or n in ("nrdf", "nrdf-refined")]
    for name in methods:
        if name not in able:
            raise ConfigError(unknown_name("method for objects", name, able))


def check_views(views: Sequence[int], points: int) -> None:
    """Raises ConfigError for a number of cameras or points that makes no sense."""
    if not views or min(views) < 0 or max(views) > MOST_VIEWS or len({*views}) < len(views):
        raise ConfigError(
            f"views {', '.join(map(str, views)) or '(none)'}: give numbers of cameras from 0 (the "
            f"whole cloud) to {MOST_VIEWS}, each once"
        )
    if not MINIMUM_POINTS <= points <= MOST_POINTS:
        raise ConfigError(f"{points} points; give {MINIMUM_POINTS} to {MOST_POINTS}")
