"""`nrdf model learn`: a model of one's own kind of object, from a folder of meshes or scans."""

from __future__ import annotations

import logging
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from tyro.conf import Positional

from nrdf.commands.console import command_line, console, progress_bar, show, table
from nrdf.commands.options import Axis, Cluster, Folder, Metavar
from nrdf.io.bounds import Count
from nrdf.tasks import chosen_workers

if TYPE_CHECKING:
    from nrdf.learn.learning import Learned, Progress

log = logging.getLogger(__name__)


def learn(
    folder: Positional[Folder],
    category: str,
    up: Axis = "y",
    forward: Annotated[str, Metavar("FILE")] | None = None,
    out: Folder | None = None,
    steps: Count | None = None,
    start: str = "general",
    workers: Count | None = None,
    cluster: Cluster | None = None,
    no_install: bool = False,
    overwrite: bool = False,
) -> None:
    """Learn your own kind of object from 3 to 60 meshes or scans of it.

    Brings them into one frame, maps most of them onto each other, trains the general model further
    on what these maps agree on, and judges it on the objects kept back, beside the general model as
    it is and registration. The best goes into your own model zoo under the category's name:
    knowledge of that category then uses it. Killed at any moment, the same command goes on. 20
    meshes take about 6 minutes of one core.

    Example: nrdf model learn meshes/ --category helmet --up z

    Args:
        folder: Meshes and scans, of one kind of object, in any unit and heading.
        category: What they are, in a word or two of your own.
        up: Axis that points up in the files.
        forward: Name of a file in which +X (or, with z up, x) is forward; the heading that most
            files have unless given.
        out: Folder of all that is made; runs/CATEGORY-learned unless given.
        steps: Steps of training, 0.8 s each on one core; 300 unless given.
        start: General model that training begins with, by name or file.
        workers: Processes; all cores unless given.
        cluster: Address of a Dask scheduler whose workers do it instead.
        no_install: Leave your zoo as it is.
        overwrite: Begin anew.
    """
    from nrdf.field.zoo import add_to_zoo, user_zoo
    from nrdf.io.atomic import write_json
    from nrdf.io.locks import write_lock
    from nrdf.learn.learning import learn as run
    from nrdf.learn.picture import draw_held_out, draw_objects
    from nrdf.process.model_choice import check_new_category
    from nrdf.training.general_field import FineTuneSettings

    check_new_category(category)
    place = out or Path("runs") / f"{category}-learned"
    settings = FineTuneSettings(start=start)
    if steps is not None:
        settings = replace(settings, steps=steps)
    cores, started = chosen_workers(workers, cluster), time.monotonic()
    with write_lock(place):
        if overwrite:
            _forget(place)
        with _steps() as progress:
            learned = run(folder, category, place, up, forward, settings, cores, progress)
        shown = {name: learned.models[name] for name in learned.shown}
        draw_objects([*learned.examples, *learned.held_out], place / "objects.png")
        draw_held_out(shown, learned.examples[0], learned.held_out[:2], place / "held-out.png")
        write_json(
            place / "report.json",
            {"command": command_line(), "category": category, **learned.describe()},
        )
        _show(learned)
        minutes = (time.monotonic() - started) / 60
        console.print(f"{minutes:.1f} min; pictures and report in {place}")
        if no_install:
            console.print(f"not installed; use it with --model {learned.weights}")
            return
        with write_lock(user_zoo(), wait=True):
            entry = add_to_zoo(learned.weights, category, note=learned.why, zoo=user_zoo())
    console.print(
        f"the model '{entry.name}' is now in your zoo ({user_zoo()}): {learned.winner}, because "
        f"{learned.why}"
    )


def _show(learned: Learned) -> None:
    """The errors on the held-out objects, and how sure the differences are."""
    from nrdf.field.registration import REGISTRATION
    from nrdf.learn.judge import difference

    found = learned.errors
    held = len(found.names)
    console.print(
        f"learned from {len(learned.used)} objects; judged on {held} kept back: "
        f"{', '.join(found.names)}"
    )
    shown = table(
        "", "model", "deformed copies, off by % of the size", "against registration, 95 %",
        "different objects, in doubt by %",
    )  # fmt: skip
    base = found.models.index(REGISTRATION)
    for n, name in enumerate(found.models):
        apart, half = difference(found.exact, n, base)
        sure = f"± {100 * half:.2f}" if held > 1 else "one object only"
        against = "" if n == base else f"{100 * apart:+.2f} {sure}"
        means = (100 * values[:, n].mean() for values in (found.exact, found.doubt))
        exact, doubt = (f"{mean:.2f}" for mean in means)
        shown.add_row(name, exact, against, doubt)
    show(shown)


@contextmanager
def _steps() -> Iterator[Progress]:
    """A bar with the remaining time for the step that is under way."""
    from nrdf.learn.learning import STEPS

    current: dict[str, Any] = {}

    def close() -> None:
        if "bar" in current:
            current.pop("bar").__exit__(None, None, None)

    def tell(step: str, done: int, total: int) -> None:
        if current.get("step") != step:
            close()
            current["step"] = step
            log.info("%s (step %d of %d)", step, STEPS.index(step) + 1, len(STEPS))
            current["bar"] = progress_bar(step)
            current["update"] = current["bar"].__enter__()
        if "bar" in current:
            current["update"](done, total)

    try:
        yield tell
    finally:
        close()


def _forget(place: Path) -> None:
    """Remove what an earlier run of this command made in its folder, and nothing else."""
    import shutil

    for name in ("read", "data", "run"):
        shutil.rmtree(place / name, ignore_errors=True)
    for name in ("model.safetensors", "report.json", "objects.png", "held-out.png"):
        (place / name).unlink(missing_ok=True)
