"""Methods on labelled objects: parts of a reference found on a target, whole or in a scan.

`ObjectRetrieval` reads, samples, scans and encodes each object only once for all its pairs.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from pathlib import Path

import numpy as np

import nrdf
from nrdf.errors import ConfigError, unknown_name
from nrdf.field.encoded_cloud import EncodedCloud
from nrdf.field.general import GENERAL
from nrdf.io.cloud import PointCloud
from nrdf.regions.match import Match
from nrdf.regions.model import Model
from nrdf.scans.aligned_scan import AlignedScan, clean_and_align
from nrdf.scans.pose_scorer import PoseScorer
from nrdf_benchmark.methods.learned import FieldMethod
from nrdf_benchmark.methods.registry import METHODS, MethodSpec, build_method
from nrdf_benchmark.objects.dataset import (
    LabelledMesh,
    Labels,
    list_objects,
    read_labels,
    read_object,
)
from nrdf_benchmark.objects.pairs import THERE, Truth, part_iou, parts_of, state_of, truth_of
from nrdf_benchmark.objects.sampling import LabelledCloud, sample_object, scan_object
from nrdf_benchmark.scans import UP, has_pose_warning, pose_error

WHOLE = 0
"""Views of the whole cloud, in its own frame; otherwise the number of cameras of a scan."""


@dataclass(frozen=True)
class Settings:
    """All that a process needs to begin. model: the weight file of the model that aligns."""

    folder: Path
    model: Path
    points: int = 8192
    normals: str = "estimated"
    device: str = "cpu"


@dataclass(frozen=True)
class Pose:
    """How well the target's scan was aligned: degrees of the whole rotation, None where it is not
    known which side of the target is the front; relative error of the scale; whether the report
    warns of the pose; seconds."""

    degrees: float | None
    scale: float
    warned: bool
    seconds: float


@dataclass(frozen=True)
class PartResult:
    """One part of the reference on the target.

    state: in truth (`nrdf_benchmark.objects.pairs.state_of`). true, found: points. iou: None unless
    the part is there. Of a method that tells absence: reason ("" where it was found), score (mean
    confidence), and what absence was told from: confidence of presence, observed share, evidence.
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
class ObjectPairResult:
    """One method on one pair. views: `WHOLE`, or cameras of the target's scan; seconds: of finding
    all parts, target and reference encoded before; mixed: share of the reference's and of the
    target's surface that counts nowhere; pose: of a scan."""

    method: str
    views: int
    reference: str
    target: str
    seconds: float
    parts: tuple[PartResult, ...]
    mixed: tuple[float, float]
    pose: Pose | None = None


@dataclass(frozen=True)
class TargetCloud:
    """A target as methods get it: points with labels, and the same encoded."""

    labelled: LabelledCloud
    encoded: EncodedCloud
    canonical: PointCloud
    pose: Pose | None = None
    aligned: AlignedScan | None = None

    def seen_by(self, model: Model) -> EncodedCloud:
        """The target as a model sees it, in the pose that was found for all: its embedding is of
        the general field where that maps, and of the model that aligned it otherwise."""
        if model.preset == GENERAL:
            return model.encode(self.encoded.cloud, self.encoded.pose)
        return self.encoded

    def in_cloud(self, found: np.ndarray) -> np.ndarray:
        """Indices of `canonical` as those of all points of the cloud."""
        chosen = np.zeros(len(self.encoded.points), bool)
        chosen[found] = True
        indices = self.encoded.to_all(chosen)[0]
        return indices if self.aligned is None else self.aligned.cleaned.kept[indices]


class ObjectRetrieval:
    """Labelled objects of a folder, each read, sampled, scanned and encoded at most once."""

    def __init__(self, settings: Settings) -> None:
        self.settings = settings
        self.labels: Labels = read_labels(settings.folder)
        self._listed = {item.key: item for item in list_objects(settings.folder)}
        self.mesh: Callable[[str], LabelledMesh] = lru_cache(None)(self._mesh)
        self.whole_cloud: Callable[[str], LabelledCloud] = lru_cache(None)(self._whole_cloud)
        self.truth: Callable[[str], Truth] = lru_cache(None)(self._truth)
        self.target_cloud: Callable[[str, int], TargetCloud] = lru_cache(None)(self._target_cloud)

    @cached_property
    def model(self) -> Model:
        return nrdf.load_model(str(self.settings.model), self.settings.device)

    @cached_property
    def scorer(self) -> PoseScorer:
        return PoseScorer(self.model)

    def regions(self, key: str) -> dict[str, np.ndarray]:
        """The parts of an object that are large enough: name to indices of its whole cloud."""
        return parts_of(self.labels, self.whole_cloud(key))

    def find(
        self, spec: MethodSpec, views: int, reference: str, target: str
    ) -> tuple[dict[str, np.ndarray], dict[str, Match], float]:
        """All parts of a reference on a target by one method: name to indices (k,) of the target's
        cloud; what a method that tells absence returned of each; seconds."""
        regions, target_cloud = self.regions(reference), self.target_cloud(target, views)
        match, cloud = build_method(spec), self.whole_cloud(reference).cloud
        matches: dict[str, Match] = {}
        encoded = target_cloud.encoded
        if isinstance(match, FieldMethod):
            encoded = target_cloud.seen_by(match.model)
        start = time.perf_counter()
        if isinstance(match, FieldMethod):
            matches = match.find(cloud, regions, encoded)
            if target_cloud.aligned is not None:
                matches = {name: m.in_scan(target_cloud.aligned) for name, m in matches.items()}
            found = {name: m.indices for name, m in matches.items()}
        else:
            found = match(cloud, regions, target_cloud.canonical)
            found = {name: target_cloud.in_cloud(indices) for name, indices in found.items()}
        return found, matches, time.perf_counter() - start

    def run(self, spec: MethodSpec, views: int, reference: str, target: str) -> ObjectPairResult:
        """Find all parts of a reference on a target by one method, and score them."""
        found, matches, seconds = self.find(spec, views, reference, target)
        target_cloud, truth = self.target_cloud(target, views), self.truth(target)
        parts = []
        for name, indices in found.items():
            state = state_of(name, truth, target_cloud.labelled)
            true = int((target_cloud.labelled.label == name).sum())
            iou = None
            if state == THERE:
                iou = part_iou(indices, name, self.labels, target_cloud.labelled)
            result = PartResult(name, state, true, len(indices), iou)
            if name in matches:
                presence = matches[name].presence
                result = replace(
                    result,
                    reason=presence.reason,
                    score=matches[name].score,
                    confidence=presence.confidence,
                    observed=presence.observed,
                    evidence=tuple(presence.evidence or ()),
                )
            parts.append(result)
        mixed = self.truth(reference).mixed, truth.mixed
        return ObjectPairResult(
            spec.name, views, reference, target, seconds, tuple(parts), mixed, target_cloud.pose
        )

    def _mesh(self, key: str) -> LabelledMesh:
        return read_object(self.settings.folder, self._listed[key], self.labels)

    def _whole_cloud(self, key: str) -> LabelledCloud:
        return sample_object(self.mesh(key), self.settings.points, self.settings.normals)

    def _truth(self, key: str) -> Truth:
        return truth_of(self.labels, self.mesh(key), self.whole_cloud(key))

    def _target_cloud(self, key: str, views: int) -> TargetCloud:
        if views == WHOLE:
            labelled = self.whole_cloud(key)
            encoded = self.model.encode(labelled.cloud)
            return TargetCloud(labelled, encoded, PointCloud(encoded.points, encoded.normals))
        labelled = scan_object(self.mesh(key), views)
        start = time.perf_counter()
        aligned = clean_and_align(self.scorer, labelled.cloud, UP)
        seconds = time.perf_counter() - start
        degrees, scale = pose_error(aligned, labelled.pose)
        sure, encoded = self._listed[key].forward_sure, aligned.encode()
        return TargetCloud(
            labelled,
            encoded,
            PointCloud(encoded.points, encoded.normals),
            Pose(degrees if sure else None, scale, has_pose_warning(aligned), seconds),
            aligned,
        )


@lru_cache(maxsize=1)
def shared_retrieval(settings: Settings) -> ObjectRetrieval:
    """The one that the tasks of this process share."""
    return ObjectRetrieval(settings)


def check_choice(methods: Sequence[str], views: Sequence[int]) -> None:
    """Raises ConfigError for a method that gives no sets of a target's points, and for no views or
    the same twice."""
    masks = ("nrdf", "nrdf-refined", GENERAL)
    able = [name for name, entry in METHODS.items() if not entry.is_learned or name in masks]
    for name in methods:
        if name not in able:
            raise ConfigError(unknown_name("method for objects", name, able))
    if len({*views}) < max(len(views), 1):
        raise ConfigError(
            f"views {', '.join(map(str, views)) or '(none)'}: give numbers of cameras, each once; "
            "0 is the whole cloud"
        )
