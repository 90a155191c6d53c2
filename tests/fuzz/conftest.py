"""Registers the profile "fuzz" before any test asks for it."""

from builders import fuzzing  # noqa: F401
