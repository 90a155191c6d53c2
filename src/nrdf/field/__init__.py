"""The network: presets by name, one interface for all of them (`nrdf.field.base.Field`)."""

from __future__ import annotations

from collections.abc import Mapping
from importlib import import_module
from typing import Any

from pydantic import ValidationError

from nrdf.errors import ConfigError, unknown_name
from nrdf.field.base import Field, Inverse

__all__ = ["PRESETS", "Field", "Inverse", "build_field", "field_class"]

PRESETS: dict[str, str] = {
    "default": "nrdf.field.default:DefaultField",
    "paper": "nrdf.field.paper:PaperField",
    "ndf": "nrdf_benchmark.presets.ndf:NDFField",
    "imdc": "nrdf_benchmark.presets.imdc:IMDCField",
}
"""Preset name to "module:class"; modules are imported when their preset is first built."""


def field_class(preset: str) -> type[Field]:
    """The class behind a preset name.

    Raises ConfigError for a name that is not in `PRESETS`.
    """
    if preset not in PRESETS:
        raise ConfigError(unknown_name("preset", preset, sorted(PRESETS)))
    module, _, name = PRESETS[preset].partition(":")
    return getattr(import_module(module), name)


def build_field(preset: str, config: Mapping[str, Any] | None = None) -> Field:
    """A field with fresh weights (from torch's global generator), sizes overridden by `config`.

    Raises ConfigError for an unknown preset, or sizes that the preset does not have or allow.
    """
    cls = field_class(preset)
    try:
        sizes = cls.Config(**dict(config or {}))
    except ValidationError as error:
        first = error.errors()[0]
        where = ".".join(str(part) for part in first["loc"])
        known = ", ".join(cls.Config.model_fields)
        raise ConfigError(
            f"preset '{preset}' cannot be built with '{where}': {first['msg']}; "
            f"it has the sizes {known}"
        ) from None
    return cls(sizes)
