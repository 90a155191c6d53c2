"""Whether a category is one that a model is known for, or a slip of the pen."""

from __future__ import annotations

from pathlib import Path

from nrdf.errors import ProcessError
from nrdf.io.schema import suggest_name


def known_categories() -> list[str]:
    """Categories of the zoo's models and of the parametric families."""
    from nrdf.field.zoo import list_models
    from nrdf.shapes.families import FAMILY_NAMES

    return sorted({entry.category for entry in list_models()} | set(FAMILY_NAMES))


def check_category(category: str, model: str | Path | None = None) -> None:
    """Raise ProcessError, with the nearest known name, for a category without a model.

    model: zoo name, weight file or run, which must be for the category; ModelError where it cannot
    be read.
    """
    if model is not None:
        from nrdf.field.weights import read_metadata
        from nrdf.field.zoo import find_weights

        found = read_metadata(find_weights(model))["category"]
        if found != category:
            raise ProcessError(f"category is '{category}', but the model {model} is for {found}")
        return
    known = known_categories()
    if category not in known:
        raise ProcessError(
            f"no model for the category '{category}'{suggest_name(category, known)}. With a model "
            "of your own give --model; if it is meant all the same, set allow_unusual: true at the "
            "top of the file (nrdf knowledge new --allow-unusual)"
        )
