"""The network of one category: shape embedding, descriptor field and inverse descriptor function.

In: a point cloud of any unit and density (`CloudEncoder`), or the name of a preset
(`build_field`). Out: an `EncodedCloud`, its points' descriptors, and where these belong on others.
"""

from __future__ import annotations

from collections.abc import Mapping
from importlib import import_module
from importlib.metadata import entry_points
from typing import Any

from pydantic import ValidationError

from nrdf.errors import ConfigError, unknown_name
from nrdf.field.base import Field, Inverse

__all__ = ["PRESETS", "PRESET_GROUP", "Field", "Inverse", "build_field", "field_class"]

PRESETS: dict[str, str] = {
    "default": "nrdf.field.default:DefaultField",
    "general": "nrdf.field.general:GeneralField",
    "paper": "nrdf.field.paper:PaperField",
    "registration": "nrdf.field.registration:RegistrationField",
}
"""Own presets: name to "module:class"; modules are imported when their preset is first built."""
PRESET_GROUP = "nrdf.presets"
"""Entry points by which other packages add presets, under names that `PRESETS` does not have."""


def field_class(preset: str) -> type[Field]:
    """The class behind a preset's name: one of `PRESETS`, or an installed package's entry point.

    Raises ConfigError for an unknown name (listing the known ones), and for a package's preset that
    cannot be imported.
    """
    if preset in PRESETS:
        module, _, name = PRESETS[preset].partition(":")
        return getattr(import_module(module), name)
    others = {point.name: point for point in entry_points(group=PRESET_GROUP)}
    if preset not in others:
        raise ConfigError(unknown_name("preset", preset, sorted({*PRESETS, *others})))
    try:
        return others[preset].load()
    except (ImportError, AttributeError) as error:
        where = others[preset].value
        raise ConfigError(f"preset '{preset}' cannot be loaded from {where}: {error}") from None


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
