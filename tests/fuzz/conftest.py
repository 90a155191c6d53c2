"""Registers the profile "fuzz" before any test asks for it."""

import fuzzing  # noqa: F401
