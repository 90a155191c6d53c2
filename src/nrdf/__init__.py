"""Neural Region Descriptor Fields: teach a region once, find it on every such object.

    model = nrdf.load_model("chair")
    taught = model.set_reference(nrdf.read_cloud("reference.ply"))
    match = taught.retrieve(region, nrdf.read_cloud("target.ply"))

Everything is imported when it is first used, so `import nrdf` is cheap.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from pathlib import Path

    from nrdf.cloud import PointCloud, read_cloud, write_cloud
    from nrdf.errors import (
        CloudError,
        ConfigError,
        DataError,
        ModelError,
        NrdfError,
        OutputError,
        RegionError,
        TrainingError,
    )
    from nrdf.regions.match import Match
    from nrdf.regions.model import Model, Taught
    from nrdf.scans.target import align

__all__ = [
    "CloudError",
    "ConfigError",
    "DataError",
    "Match",
    "Model",
    "ModelError",
    "NrdfError",
    "OutputError",
    "PointCloud",
    "RegionError",
    "Taught",
    "TrainingError",
    "__version__",
    "align",
    "load_model",
    "read_cloud",
    "write_cloud",
]

__version__ = "0.1.0"

_HOMES = {
    **dict.fromkeys(("PointCloud", "read_cloud", "write_cloud"), "nrdf.cloud"),
    **dict.fromkeys(("Match", "Model", "Taught"), "nrdf.regions.model"),
    "align": "nrdf.scans.target",
    **dict.fromkeys((name for name in __all__ if name.endswith("Error")), "nrdf.errors"),
}


def load_model(name: str | Path, device: str = "cpu") -> Model:
    """The model of a zoo name ("chair"), of a weight file, or of a finished training run's folder.

    `device` is "cpu", "cuda", "cuda:1", … or "auto" (CUDA where there is one). Raises ModelError
    for a name that is not known (listing those that are) and for a truncated or altered file,
    ConfigError for a device that this machine does not have.
    """
    from nrdf.field.zoo import load_field
    from nrdf.regions.model import Model
    from nrdf.training.distributed import choose_device

    field, metadata = load_field(name)
    return Model(field, metadata, device=choose_device(device))


def __getattr__(name: str) -> Any:
    if name in _HOMES:
        return getattr(import_module(_HOMES[name]), name)
    raise AttributeError(f"module 'nrdf' has no attribute '{name}'")


def __dir__() -> list[str]:
    return sorted(__all__)
