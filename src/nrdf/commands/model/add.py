"""`nrdf model add`: a trained model goes into the model zoo."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from tyro.conf import Positional

from nrdf.commands.console import console
from nrdf.commands.options import Metavar
from nrdf.errors import ConfigError
from nrdf.io.bounds import FINITE


def add(
    weights: Positional[Annotated[Path, Metavar("FILE|FOLDER")]],
    name: str | None = None,
    scores: tuple[Annotated[str, Metavar("NAME=VALUE")], ...] = (),
    note: str = "",
) -> None:
    """Add a trained field, or a kind network, to the model zoo.

    Of this installation; a checkout's zoo is src/nrdf/zoo. Files over 8 MB are refused. The index
    gets the checksum, and from the file preset, training shapes with licences, commit and date.

    Example: nrdf model add runs/chair --scores bsrc-dev-cd-l1=0.0312

    Args:
        weights: Weight file or finished training run's folder.
        name: Name in the zoo; the category unless given.
        scores: name=value, lower is better; added to the scores of the training run.
        note: One line about this model.
    """
    from nrdf.field.zoo import ZOO, add_to_zoo
    from nrdf.io.locks import write_lock

    with write_lock(ZOO):
        entry = add_to_zoo(weights, name, _parse_scores(scores), note)
    console.print(f"'{entry.name}' is in the zoo: {entry.file}, {entry.bytes / 1e6:.2f} MB")


def _parse_scores(words: tuple[str, ...]) -> dict[str, float]:
    scores = {}
    for word in words:
        name, _, value = word.partition("=")
        try:
            scores[name] = float(value)
            FINITE.check(f"the score {name}", scores[name])
        except ValueError:
            raise ConfigError(f"a score is name=value with a number, not '{word}'") from None
    return scores
