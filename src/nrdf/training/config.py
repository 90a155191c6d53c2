"""What a training run is, as data: read from YAML, checked, saved beside the results."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Literal

from pydantic import Field, ValidationError, field_validator, model_validator

from nrdf.errors import ConfigError
from nrdf.io.files import read_file
from nrdf.io.schema import StrictModel, suggest_name, validation_messages
from nrdf.io.yaml_json import read_yaml
from nrdf.training.losses import LOSSES


class AugmentConfig(StrictModel):
    """Random changes of the shapes; 0 switches one off."""

    scaling: float = Field(default=0.0, ge=0)
    """Standard deviation of the logarithm of each axis's scale."""
    warp: float = Field(default=0.0, ge=0)
    """Standard deviation of each of the low-frequency waves' displacement (canonical lengths)."""
    stretch: float = Field(default=0.0, ge=0)
    """Standard deviation of the steepest stretch of parts along each axis: a longer nose, a higher
    seat, so that places are told by the shape around them and not by where they are."""
    mirror: bool = False
    """Mirror left and right, both shapes of a pair alike."""
    density: float = Field(default=0.0, ge=0)
    """Largest standard deviation of the logarithm of the encoder points' density."""
    noise: float = Field(default=0.0, ge=0)
    """Largest standard deviation of the encoder points' noise (canonical lengths)."""
    normal_noise: float = Field(default=0.0, ge=0)
    """Largest standard deviation added to each coordinate of the encoder's normals."""
    holes: int = Field(default=0, ge=0)
    hole_radius: float = Field(default=0.1, ge=0)
    views: float = Field(default=0.0, ge=0, le=1)
    """Probability that the encoder sees only what 1 to 4 depth cameras see of a shape."""
    view_frame: float = Field(default=0.0, ge=0)
    """Standard deviation of the frame's error (centre in canonical lengths, logarithm of the scale)
    of shapes that are seen in part: their frame comes from an alignment, not from their box."""
    cut: float = Field(default=0.0, ge=0, le=1)
    """Probability that a shape lacks one of its ends, mostly what is above a random height: a
    chair becomes a stool. Its bounding box is that of the rest, and what is cut off does not exist.
    """


class DataConfig(StrictModel):
    """How many points of what a batch holds, and which shapes meet in it."""

    encoder_points: int = Field(default=1024, ge=1)
    queries: int = Field(default=256, ge=0)
    """Occupancy queries a shape."""
    inside: float | None = Field(default=None, ge=0, le=1)
    """Share of the queries that is drawn from those inside the shape; None: as they are stored."""
    correspondences: int = Field(default=256, ge=0)
    """Corresponding points a pair."""
    rolls: int = Field(default=1, ge=1)
    """Partners that each encoded shape is paired with: the next, the one after it, ..."""
    cloud_points: int = Field(default=1024, ge=2)
    """Points a shape for the losses on whole clouds (self, chamfer, emd, ...)."""
    surface_points: int = Field(default=8192, ge=1)
    """Surface points a shape kept in memory to draw from."""
    stored_queries: int = Field(default=20000, ge=1)
    pools: dict[str, float] = Field(default={})
    """Pattern of shape sources (first match counts) to its share of each batch; pairs are formed
    within a pool. Empty: one pool of all shapes."""
    exact_groups: list[str] = Field(default=["family-*", "shared-*"])
    """Patterns of correspondence groups whose weight 0 means "no such place", not "uncertain"."""
    weight_threshold: float = Field(default=0.05, ge=0, le=1)
    """Correspondences of less confidence are not drawn."""
    augment: AugmentConfig = AugmentConfig()


class Stage(StrictModel):
    """A stretch of training: which losses at which weights, which parts train, for how long."""

    name: str
    weights: dict[str, float] = Field(min_length=1)
    """Loss name to weight (`nrdf.training.losses.LOSSES`)."""
    epochs: float | None = Field(default=None, gt=0)
    steps: int | None = Field(default=None, gt=0)
    batch_size: int = Field(default=8, ge=2)
    """Shapes a step, on each process."""
    parts: list[str] | Literal["all"] = "all"
    """Names of the field's parts that train; the others are frozen."""
    rate: float = Field(default=1e-4, gt=0)
    pools: dict[str, float] | None = None
    """Shares of the sources in this stage's batches, instead of `data.pools`."""
    encoder_points: int | None = Field(default=None, ge=1)
    queries: int | None = Field(default=None, ge=0)
    inside: float | None = Field(default=None, ge=0, le=1)
    """Points and queries a shape in this stage, and the share of these that is inside, instead of
    those of `data`."""
    schedule: Literal["constant", "cosine"] = "constant"
    warmup: int = Field(default=0, ge=0)
    """Steps over which the rate rises linearly from zero."""
    seed: int | None = Field(default=None, ge=0)
    """Of what this stage draws, instead of the run's: what chance does from the same beginning."""

    @field_validator("weights")
    @classmethod
    def _known_losses(cls, weights: dict[str, float]) -> dict[str, float]:
        for name in weights:
            if name not in LOSSES:
                raise ValueError(f"no loss '{name}'{suggest_name(name, LOSSES)}")
        return weights

    @model_validator(mode="after")
    def _one_length(self) -> Stage:
        if (self.epochs is None) == (self.steps is None):
            raise ValueError("give either epochs or steps")
        return self


class OptimizerConfig(StrictModel):
    name: Literal["adam", "adamw"] = "adam"
    betas: tuple[float, float] = (0.9, 0.999)
    weight_decay: float = Field(default=0.0, ge=0)
    clip: float | None = Field(default=None, gt=0)
    """Bound on the gradient's norm."""
    muon: list[str] = Field(default=[])
    """Parts of the field whose weight matrices are stepped by Muon (`nrdf.training.optimizer`); the
    rest is stepped by adam, without decay."""

    @model_validator(mode="after")
    def _rest_by_adam(self) -> OptimizerConfig:
        if self.muon and (self.name != "adam" or self.weight_decay):
            raise ValueError("muon goes with name: adam and weight_decay: 0")
        return self


class TrainConfig(StrictModel):
    """One training run, except for the data folders, the category and the device."""

    preset: str
    field: dict[str, Any] = Field(default={})
    """Sizes that differ from the preset's."""
    start_parts: dict[str, str] = Field(default={})
    """Part of the field to the model (zoo name, weight file or run) whose part it starts as."""
    stages: list[Stage] = Field(min_length=1)
    data: DataConfig = DataConfig()
    optimizer: OptimizerConfig = OptimizerConfig()
    seed: int = Field(default=0, ge=0)
    precision: Literal["auto", "float32", "bfloat16"] = "auto"
    """auto: bfloat16 where it pays (CUDA; CPUs with AMX or AVX-512 BF16)."""
    ema: float | None = Field(default=None, gt=0, lt=1)
    """Decay of the moving average of the weights, which is what is exported; None: no average."""
    checkpoint_every: int = Field(default=500, ge=1)
    validate_every: int = Field(default=500, ge=1)
    log_every: int = Field(default=20, ge=1)


_LARGEST_FILE = 1 << 20
CONFIG_FOLDER = Path(__file__).resolve().parents[1] / "configs"


def load_config(source: str | Path | Mapping[str, Any]) -> TrainConfig:
    """A training configuration from a YAML file, a preset's name (its file in `configs/`), or a
    mapping.

    Raises ConfigError for a file that is missing or no YAML mapping, unknown keys (naming the
    nearest known one) and values out of range.
    """
    if isinstance(source, Mapping):
        return _validated(source, "configuration")
    path = Path(source)
    if not path.exists() and path.suffix == "" and path.name == str(source):
        path = CONFIG_FOLDER / f"{source}.yaml"
    if not path.is_file():
        known = sorted(file.stem for file in CONFIG_FOLDER.glob("*.yaml"))
        raise ConfigError(
            f"no configuration file '{source}'; give a YAML file or one of: {', '.join(known)}"
        )
    try:
        content = read_yaml(read_file(path, ConfigError, _LARGEST_FILE).decode("utf-8-sig"))
    except ValueError as error:
        raise ConfigError(f"{path} is not valid YAML: {error}") from None
    if not isinstance(content, dict):
        raise ConfigError(f"{path} must hold a mapping (preset: …, stages: […], …)")
    return _validated(content, str(path))


def _validated(content: Mapping[str, Any], origin: str) -> TrainConfig:
    try:
        return TrainConfig.model_validate(dict(content))
    except ValidationError as error:
        raise ConfigError(
            f"{origin}: " + "; ".join(validation_messages(error, TrainConfig))
        ) from None
