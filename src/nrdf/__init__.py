"""Neural Region Descriptor Fields: teach a region once, find it on every such object.

    model = nrdf.load_model("chair")
    encoded = model.set_reference(nrdf.read_cloud("reference.ply"))
    match = encoded.retrieve(region, "target.ply")  # or an array (n, 3), a mesh, ...

    process = nrdf.load_process("chair.yaml")  # process knowledge: regions and their processes
    result = process.transfer("target.ply")
    nrdf.write_job("job/", result)  # tool paths, report and pictures

Everything is imported when it is first used, so `import nrdf` is cheap.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from nrdf.errors import (
        CloudError,
        ConfigError,
        DataError,
        LimitError,
        ModelError,
        NothingFoundError,
        NrdfError,
        OutputError,
        ProcessError,
        RegionError,
        TrainingError,
    )
    from nrdf.io.cloud import PointCloud, read_cloud, write_cloud
    from nrdf.io.inputs import as_cloud
    from nrdf.process.knowledge import Knowledge
    from nrdf.process.transfer import ProcessTransfer, load_process
    from nrdf.process.transfer_result import TransferResult
    from nrdf.regions.match import Match
    from nrdf.regions.model import Model, load_model
    from nrdf.regions.reference import EncodedReference
    from nrdf.reports.job_folder import write_job
    from nrdf.scans.aligned_scan import align

__all__ = [
    "CloudError",
    "ConfigError",
    "DataError",
    "EncodedReference",
    "Knowledge",
    "LimitError",
    "Match",
    "Model",
    "ModelError",
    "NothingFoundError",
    "NrdfError",
    "OutputError",
    "PointCloud",
    "ProcessError",
    "ProcessTransfer",
    "RegionError",
    "TrainingError",
    "TransferResult",
    "__version__",
    "align",
    "as_cloud",
    "load_model",
    "load_process",
    "read_cloud",
    "write_cloud",
    "write_job",
]

__version__ = "0.1.0"

_HOMES = {
    **dict.fromkeys(("PointCloud", "read_cloud", "write_cloud"), "nrdf.io.cloud"),
    "as_cloud": "nrdf.io.inputs",
    "Match": "nrdf.regions.match",
    **dict.fromkeys(("Model", "load_model"), "nrdf.regions.model"),
    "EncodedReference": "nrdf.regions.reference",
    **dict.fromkeys(("ProcessTransfer", "load_process"), "nrdf.process.transfer"),
    "TransferResult": "nrdf.process.transfer_result",
    "Knowledge": "nrdf.process.knowledge",
    "align": "nrdf.scans.aligned_scan",
    "write_job": "nrdf.reports.job_folder",
    **dict.fromkeys((name for name in __all__ if name.endswith("Error")), "nrdf.errors"),
}


def __getattr__(name: str) -> Any:
    if name in _HOMES:
        return getattr(import_module(_HOMES[name]), name)
    raise AttributeError(f"module 'nrdf' has no attribute '{name}'")


def __dir__() -> list[str]:
    return sorted(__all__)
