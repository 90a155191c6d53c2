"""How an object stands, as a session's file holds it: checked when read."""

from __future__ import annotations

from typing import Annotated

import numpy as np
from pydantic import Field, model_validator

from nrdf.geometry.similarity import Similarity
from nrdf.io.schema import StrictModel
from nrdf.scans.clean import Step
from nrdf.studio.model.placing import CLEANED, Placement, Pose

_Number = Annotated[float, Field(ge=-1e9, le=1e9)]
_Row = tuple[_Number, _Number, _Number]
_Share = Annotated[float, Field(ge=0, le=1)]
_Text = Annotated[str, Field(max_length=1000)]


class _PoseContent(StrictModel):
    rotation: tuple[_Row, _Row, _Row]
    translation: _Row
    scale: Annotated[float, Field(gt=0, le=1e9)]
    probability: _Share | None
    symmetry: _Share

    @model_validator(mode="after")
    def _is_a_rotation(self) -> _PoseContent:
        matrix = np.array(self.rotation)
        if np.abs(matrix @ matrix.T - np.eye(3)).max() > 1e-6 or np.linalg.det(matrix) < 0:
            raise ValueError("rotation is none: its rows must be orthonormal and right-handed")
        return self

    @staticmethod
    def of(pose: Pose) -> _PoseContent:
        way = pose.similarity
        return _PoseContent.model_validate(
            {
                "rotation": way.rotation.tolist(),
                "translation": way.translation.tolist(),
                "scale": way.scale,
                "probability": pose.probability,
                "symmetry": min(max(pose.symmetry, 0.0), 1.0),
            }
        )

    def pose(self) -> Pose:
        way = Similarity(np.array(self.rotation), np.array(self.translation), self.scale)
        return Pose(way, self.probability, self.symmetry)


class _StepContent(StrictModel):
    name: _Text
    removed: Annotated[int, Field(ge=0)]
    note: _Text


class PlacementContent(StrictModel):
    """A `Placement` in plain values."""

    pose: _PoseContent
    poses: list[_PoseContent] = Field(min_length=1, max_length=10)
    steps: list[_StepContent] = Field(max_length=10)
    skipped: list[str] = Field(max_length=len(CLEANED))
    number: Annotated[int, Field(ge=0, le=1000)]
    count: Annotated[int, Field(ge=1, le=1001)]
    warnings: list[_Text] = Field(max_length=50)
    confirmed: bool

    @model_validator(mode="after")
    def _steps_are_known(self) -> PlacementContent:
        unknown = set(self.skipped) - set(CLEANED)
        if unknown:
            raise ValueError(f"skipped: must be of {', '.join(CLEANED)}")
        return self

    @staticmethod
    def of(placement: Placement) -> PlacementContent:
        """The content of a placement."""
        return PlacementContent(
            pose=_PoseContent.of(placement.pose),
            poses=[_PoseContent.of(pose) for pose in placement.poses],
            steps=[_StepContent(name=s.name, removed=s.removed, note=s.note)
                   for s in placement.steps],
            skipped=list(placement.skipped),
            number=placement.number,
            count=placement.count,
            warnings=[text[:1000] for text in placement.warnings],
            confirmed=placement.confirmed,
        )  # fmt: skip

    def placement(self) -> Placement:
        """The placement; a pose that is among those proposed is that one."""
        poses, pose = tuple(p.pose() for p in self.poses), self.pose.pose()
        for one, content in zip(poses, self.poses, strict=True):
            if content == self.pose:
                pose = one
        steps = tuple(Step(s.name, s.removed, s.note) for s in self.steps)
        return Placement(
            pose, poses, steps, tuple(self.skipped), self.number, self.count,
            tuple(self.warnings), self.confirmed,
        )  # fmt: skip
