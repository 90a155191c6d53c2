"""Weight files for inference: one safetensors file in half precision that says what it is."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, ClassVar, Protocol, TypeVar

import torch
from pydantic import BaseModel, ConfigDict, ValidationError
from safetensors import safe_open
from safetensors.torch import save
from torch import Tensor, nn

from nrdf.errors import ModelError
from nrdf.field import build_field
from nrdf.field.base import Field
from nrdf.io.atomic import write_atomically
from nrdf.io.files import require_file
from nrdf.io.schema import validation_messages

FORMAT = "nrdf-weights-1"
LARGEST = 500_000_000
"""Bytes that a weight file may have."""
_TYPES = {torch.float16, torch.float32, torch.float64, torch.int64, torch.int32, torch.uint8}
_Module = TypeVar("_Module", bound=nn.Module)


class Network(Protocol):
    """What can be saved: named weights, the name of their kind, and the sizes to build it by."""

    preset: ClassVar[str]
    config: Any

    def state_dict(self) -> Mapping[str, Tensor]: ...


def save_weights(path: str | Path, field: Network, metadata: Mapping[str, Any]) -> None:
    """Write a network's weights in float16, atomically (temporary file, then renamed).

    `metadata` needs a `category` and may hold anything that JSON can; preset and sizes are added.
    Raises OutputError when the file cannot be written.
    """
    if "category" not in metadata:
        raise ValueError("metadata needs a category")
    tensors = {name: _half(value) for name, value in field.state_dict().items()}
    content = {
        **metadata,
        "format": FORMAT,
        "preset": field.preset,
        "field": field.config.model_dump(mode="json"),
    }
    text = {key: json.dumps(value, sort_keys=True) for key, value in content.items()}
    text["sha256"] = _digest(tensors, text)
    write_atomically(Path(path), [save(tensors, metadata=text)])


def load_weights(
    path: str | Path, preset: str | None = None, category: str | None = None
) -> tuple[Field, dict[str, Any]]:
    """The field of a weight file, in float32 on the CPU and in evaluation mode, and its metadata.

    Raises ModelError for a file that is missing, truncated, altered or no weight file of ours, for
    one of another preset or category than asked for, and for tensors that do not fit the preset.
    """
    path = Path(path)
    metadata, tensors = load_tensors(path)
    for key, wanted in (("preset", preset), ("category", category)):
        if wanted is not None and metadata.get(key) != wanted:
            raise ModelError(
                f"{path} holds weights of {key} '{metadata.get(key)}', not '{wanted}'; "
                f"load it as '{metadata.get(key)}' or give another file"
            )
    name = metadata["preset"]
    return fill(path, name, tensors, lambda: build_field(name, metadata["field"])), metadata


def fill(
    path: Path, preset: str, tensors: Mapping[str, Tensor], build: Callable[[], _Module]
) -> _Module:
    """The network that `build` makes of a weight file's sizes, with the file's tensors in it, in
    evaluation mode.

    Raises ModelError if it cannot be built or the tensors do not fit it. Sizes that the tensors do
    not have take no memory.
    """
    try:
        # Initial weights are overwritten: building must not disturb the caller's random numbers.
        with torch.random.fork_rng(devices=[]):
            with torch.device("meta"):
                sizes = {name: value.shape for name, value in build().state_dict().items()}
            if sizes != {name: value.shape for name, value in tensors.items()}:
                raise ValueError(_difference(sizes, tensors))
            network = build()
        network.load_state_dict(tensors)
    except Exception as error:  # sizes that no layer has end in whatever torch raises
        raise ModelError(
            f"the weights in {path} do not fit preset '{preset}' of this version of nrdf: "
            f"{str(error) or type(error).__name__}"
        ) from None
    return network.eval()


def _difference(sizes: Mapping[str, torch.Size], tensors: Mapping[str, Tensor]) -> str:
    names = [n for n in sorted({*sizes, *tensors}) if sizes.get(n) != _shape(tensors.get(n))]
    first = names[0]
    given = tuple(_shape(tensors.get(first)) or ()) if first in tensors else "nothing"
    wanted = tuple(sizes[first]) if first in sizes else "nothing"
    return f"'{first}' is {given}, not {wanted}, and {len(names) - 1} further tensors differ"


def _shape(value: Tensor | None) -> torch.Size | None:
    return None if value is None else value.shape


def read_metadata(path: str | Path) -> dict[str, Any]:
    """What a weight file says of itself, checked against its checksum (errors: `load_weights`)."""
    return load_tensors(Path(path))[0]


def load_tensors(path: Path) -> tuple[dict[str, Any], dict[str, Tensor]]:
    """A weight file's metadata and tensors by name, whatever network they are of.

    Raises ModelError for a file that is missing, truncated, altered or no weight file of ours, that
    does not say what it is, or has values that are not finite.
    """
    if path.is_dir() or not path.exists():
        raise ModelError(f"no weight file {path}")
    size = require_file(path, ModelError)
    if size > LARGEST:
        raise ModelError(f"{path} has {size / 1e6:.0f} MB; at most {LARGEST / 1e6:.0f} are read")
    try:
        with safe_open(str(path), framework="pt") as file:
            text: dict[str, str] = file.metadata() or {}
            tensors = {name: file.get_tensor(name) for name in file.keys()}  # noqa: SIM118
    except Exception as error:  # of safetensors, or of torch for types that it does not know
        raise ModelError(
            f"{path} is no weight file, or it is truncated ({error}); get it again"
        ) from None
    if text.get("format") != json.dumps(FORMAT):
        raise ModelError(
            f"{path} is no weight file of nrdf (a training checkpoint is exported to "
            "weights.safetensors when its run ends)"
        )
    strange = [name for name, value in tensors.items() if value.dtype not in _TYPES]
    if strange or text.pop("sha256", None) != _digest(tensors, text):
        raise ModelError(f"{path} was altered or damaged: its checksum differs; get it again")
    try:
        metadata = {key: json.loads(value) for key, value in text.items()}
        _Metadata.model_validate(metadata)
    except ValidationError as error:
        why = "; ".join(validation_messages(error, _Metadata))
        raise ModelError(f"{path} does not say what it is: {why}; get it again") from None
    except (ValueError, RecursionError) as error:
        raise ModelError(f"{path} does not say what it is ({error}); get it again") from None
    for name, value in tensors.items():
        if not bool(value.isfinite().all()):
            raise ModelError(
                f"{path}: its tensor '{name}' has values that are NaN or infinite: its training "
                "went wrong; train again, or take other weights"
            )
    return metadata, tensors


class _Metadata(BaseModel):
    """What every weight file must say of itself; it may say more."""

    model_config = ConfigDict(extra="allow")

    preset: str
    category: str
    field: dict[str, Any]
    scores: dict[str, float] = {}
    shapes: dict[str, Any] = {}


def _half(value: Tensor) -> Tensor:
    """Float16, except for what float16 cannot hold."""
    value = value.detach().cpu().contiguous()
    if not value.is_floating_point():
        return value
    half = value.half()
    return half if bool(half.isfinite().all()) else value


def _digest(tensors: Mapping[str, Tensor], text: Mapping[str, str]) -> str:
    """SHA-256 over all tensors and the metadata, in order of their names."""
    digest = hashlib.sha256()
    for key in sorted(text):
        digest.update(f"{key}={text[key]}\n".encode())
    for name in sorted(tensors):
        value = tensors[name]
        digest.update(f"{name} {value.dtype} {tuple(value.shape)}\n".encode())
        digest.update(value.contiguous().numpy().tobytes())
    return digest.hexdigest()
