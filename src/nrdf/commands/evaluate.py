"""`nrdf eval` and `nrdf bench`: how good, and how fast."""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from nrdf.commands.console import console, errors, progress_bar, show, table, versions

if TYPE_CHECKING:
    from nrdf.benchmark.latency import Failure, RetrievalSpeed, TrainingSpeed


def evaluations() -> dict[str, Callable[..., Any]]:
    """Score methods: on scans (bsrc), on exact truth (families), on the shapes themselves (shape).

    Example: nrdf eval bsrc --data bsrc/ --category chair --method nrdf copy box --out results/
    """
    found: dict[str, Callable[..., Any]] = {"bsrc": bsrc, "families": families}
    if find_spec("nrdf.commands.evaluate_shape"):
        found["shape"] = import_module("nrdf.commands.evaluate_shape").shape
    return found


def bsrc(
    data: Path,
    category: Literal["chair", "car", "plane"],
    out: Path | None = None,
    method: tuple[str, ...] = ("nrdf", "nrdf-points", "copy", "box"),
    model: str | None = None,
    labels: Literal["published", "corrected"] = "published",
    device: str = "cpu",
) -> None:
    """The paper's Table II: regions found on the benchmark's scans.

    On the Benchmark for Surface Region Correspondence (BSRC). CD-L1 in the paper's convention: for
    every point the Manhattan distance to its nearest neighbour in the other set, averaged, summed
    over both directions. Lower is better.

    Example: nrdf eval bsrc --data bsrc/ --category chair --method nrdf copy box --out results/

    Args:
        data: BSRC's folder, with Chair, Car and plane in it.
        category: chair, car or plane.
        out: Folder for the table (Markdown) and every pair's figures (JSON).
        method: nrdf, nrdf-points, copy, box, copy-normals, box-normals, registration.
        model: Zoo name, weight file or run; the category's model in the zoo unless given.
        labels: As published, or corrected (plane5's wing regions are swapped as published).
        device: cpu, cuda, cuda:N or auto.
    """
    import nrdf
    from nrdf.benchmark.bsrc import read_bsrc
    from nrdf.benchmark.evaluate import evaluate as run
    from nrdf.benchmark.evaluate import table as markdown
    from nrdf.benchmark.evaluate import write_results
    from nrdf.benchmark.methods import get_method

    objects = read_bsrc(data, category, labels)
    learned = any(name.startswith("nrdf") for name in method)
    loaded = nrdf.load_model(model or category, device) if learned else None
    methods = {name: get_method(name, loaded) for name in method}
    results = []
    for name, find in methods.items():
        with progress_bar(name) as progress:
            results.append(run(name, find, objects, category, progress))
    if out is not None:
        write_results(results, category, labels, out)
    console.print(markdown(results, category))


def families(
    category: Literal["chair", "car", "plane", "table"],
    model: str | None = None,
    pairs: int = 50,
    device: str = "cpu",
) -> None:
    """The field against the exact truth of the parametric families.

    Mean distance of C's prediction from the exact corresponding point, on pairs of parametric
    shapes that no training set holds, beside that of a bounding-box copy.

    Example: nrdf eval families --category chair

    Args:
        category: chair, car, plane or table.
        model: Zoo name, weight file or run; the category's model in the zoo unless given.
        pairs: Pairs of members.
        device: cpu, cuda, cuda:N or auto.
    """
    import numpy as np

    import nrdf
    from nrdf.benchmark.family import evaluate_family

    loaded = nrdf.load_model(model or category, device)
    with progress_bar(f"pairs of {category}s") as progress:
        found = evaluate_family(loaded, category, pairs, progress)
    shown = table("", f"{pairs} pairs, {category}", "mean error", "median pair", "worst pair")
    for name, error in (("C", found.field), ("bounding-box copy", found.box)):
        shown.add_row(name, *(f"{f(error):.4f}" for f in (np.mean, np.median, np.max)))
    show(shown)
    console.print(
        f"C is {found.ratio:.1f} times closer; lengths are shares of the longest side. "
        f"{found.shared.mean():.0%} of a reference's surface exists on its target."
    )


def bench(
    preset: tuple[str, ...] = ("default", "paper"),
    device: str = "cpu",
    repeats: int = 7,
    steps: int = 3,
    out: Path | None = None,
) -> None:
    """Measure speed and memory of retrieval and training.

    8 regions on a target of 8192 points without normals, the reference embedded before. Every
    measurement runs in a process of its own.

    Example: nrdf bench --out bench.json

    Args:
        preset: Presets to measure.
        device: cpu, cuda, cuda:N or auto.
        repeats: Warm retrievals, of which the median is taken.
        steps: Training steps a stage, of which the median is taken; 0 leaves training out.
        out: JSON file to write.
    """
    from nrdf.benchmark.latency import measure, to_json
    from nrdf.output import write_json

    with errors.status("measuring") as status:
        retrieval, training, failures = measure(preset, device, repeats, steps, status.update)
    show_speeds(retrieval, training, failures)
    if out is not None:
        write_json(out, {"versions": versions(), **to_json(retrieval, training, failures)})
        console.print(f"wrote {out}")


def show_speeds(
    retrieval: list[RetrievalSpeed], training: list[TrainingSpeed], failures: list[Failure]
) -> None:
    """Two tables, and what could not be measured."""
    from nrdf.benchmark.latency import BARS

    names = (f"{s.preset} ({s.model}, {s.device})" for s in retrieval)
    shown = table("retrieval", "", *names, "default must keep to")
    bars = {
        "further targets, 8 regions, s": BARS["warm_s"],
        "nrdf retrieve, cold shell, s": BARS["command_s"],
        "peak memory, GB": BARS["peak_memory_bytes"] / 1e9,
    }
    rows = [("load weights, s", [s.load_s for s in retrieval])]
    rows.append(("reference, s", [s.reference_s for s in retrieval]))
    rows.append(("first target, 8 regions, s", [s.cold_s for s in retrieval]))
    rows.append(("further targets, 8 regions, s", [s.warm_s for s in retrieval]))
    for phase in retrieval[0].warm_phases if retrieval else ():
        rows.append((f"  {phase}", [s.warm_phases[phase] for s in retrieval]))
    rows.append(("nrdf retrieve, cold shell, s", [s.command_s or 0.0 for s in retrieval]))
    rows.append(("peak memory, GB", [s.peak_memory_bytes / 1e9 for s in retrieval]))
    for name, values in rows:
        bar = f"{bars[name]:g}" if name in bars else ""
        shown.add_row(name, *(f"{value:.3f}" for value in values), bar)
    show(shown)
    shown = table(
        "\ntraining", "preset", "stage", "batch", "precision", "s/step", "points/s", "memory, GB"
    )
    for t in training:
        memory = (t.device_memory_bytes or t.peak_memory_bytes) / 1e9
        shown.add_row(
            f"{t.preset} ({t.device})", t.stage, str(t.batch_size), t.precision,
            f"{t.step_s:.3f}", f"{t.points_per_s:,.0f}", f"{memory:.2f}",
        )  # fmt: skip
    if training:
        show(shown)
    for failure in failures:
        console.print(f"{failure.preset}, {failure.what}: {failure.reason}", style="yellow")
