"""Which model finds the regions of a knowledge: the named one, the category's, or the general one.

A category is free text. One that no model is known for is served by the general model; but where
its name is nearly that of one that has a model, it is taken for a slip of the pen, and asked back.
"""

from __future__ import annotations

import difflib
import logging
from dataclasses import dataclass
from pathlib import Path

from nrdf.errors import ProcessError
from nrdf.field.general import GENERAL
from nrdf.field.registration import REGISTRATION
from nrdf.field.weights import read_metadata
from nrdf.field.zoo import find_weights, list_models
from nrdf.io.file_names import file_name_problem
from nrdf.process.knowledge import Knowledge

log = logging.getLogger(__name__)

ANY_CATEGORY = (GENERAL, REGISTRATION)
"""Models that serve objects of every category; the first does where none is named."""
_ALIKE = 0.65  # similarity of names from which one is taken for the other, misspelt


@dataclass(frozen=True)
class ModelChoice:
    """A model for a category. name: as `nrdf.load_model` takes it; note: a sentence to be shown
    where the general model stands in, "" otherwise."""

    name: str
    note: str = ""


def choose_model(
    category: str, model: str | Path | None = None, allow_unusual: bool = False
) -> ModelChoice:
    """The model for a category, or the one that is given for it.

    model: zoo name, weight file or run, which must be for the category or for every one, or
    registration.
    allow_unusual: the category is meant, even if it is nearly called like a known one.

    Raises ProcessError for a model of another category, and, with the nearest known name, for a
    category that looks misspelt; ModelError for a model that cannot be read.
    """
    if model == REGISTRATION:
        return ModelChoice(REGISTRATION)
    if model is not None:
        found = read_metadata(find_weights(model))["category"]
        if found not in (category, ""):
            raise ProcessError(
                f"category is '{category}', but the model {model} is for {found}; give another, or "
                f"{GENERAL} or {REGISTRATION}, which serve any category"
            )
        return ModelChoice(str(model))
    models = {entry.name for entry in list_models() if entry.category == category}
    if models:
        return ModelChoice(category if category in models else min(models))
    alike = nearly_called(category)
    if alike and not allow_unusual:
        raise ProcessError(
            f"no model for the category '{category}'; did you mean '{alike}'? If it is another "
            f"kind of object, --model {GENERAL} serves any category (in a knowledge file: "
            f"model: {GENERAL})"
        )
    return ModelChoice(
        GENERAL,
        f"there is no model for the category '{category}': its regions are found by the general "
        "model, which serves any category",
    )


def nearly_called(category: str) -> str:
    """The known category that is nearly called so, "" where none is, or where it is one itself."""
    known = sorted({entry.category for entry in list_models()} - {""})
    if category in known:
        return ""
    alike = difflib.get_close_matches(category.lower(), known, n=1, cutoff=_ALIKE)
    return alike[0] if alike else ""


def check_new_category(category: str) -> None:
    """Check a category that a model is to be made for.

    Raises ProcessError for a name that no file can have, or that is that of a model for any
    category; warns of one that is nearly called like a known one.
    """
    fault = file_name_problem(category) or (
        ""
        if category.isprintable() and category and category == Path(category).name
        else "it may have no separators, because it becomes a file name"
    )
    if fault:
        raise ProcessError(f"'{category}' is no name for a category: {fault}")
    if category in ANY_CATEGORY:
        raise ProcessError(f"'{category}' is the name of a model for any category: give another")
    alike = nearly_called(category)
    if alike:
        log.warning("the category '%s' is nearly called like '%s'", category, alike)


def model_name_for(knowledge: Knowledge) -> str:
    """The model that a knowledge is transferred with; logged where the general one stands in.

    Raises as `choose_model` does.
    """
    chosen = choose_model(knowledge.category, knowledge.model, knowledge.allow_unusual)
    if chosen.note:
        log.info("%s", chosen.note)
    return chosen.name
