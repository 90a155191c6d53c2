"""`nrdf eval speed`: speed and memory of retrieval, transfer and training."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from nrdf.commands.console import console, errors, show, table, versions
from nrdf.commands.options import File
from nrdf.commands.output_lock import lock_output
from nrdf.io.bounds import Count, NonNegativeCount

if TYPE_CHECKING:
    from nrdf_benchmark.speed.large import LargeTransfer
    from nrdf_benchmark.speed.measure import Failure
    from nrdf_benchmark.speed.plain_steps import StepComparison
    from nrdf_benchmark.speed.retrieval import RetrievalSpeed
    from nrdf_benchmark.speed.training import TrainingSpeed
    from nrdf_benchmark.speed.transfer import TransferSpeed


@lock_output("out")
def speed(
    preset: tuple[str, ...] = ("default", "paper"),
    device: str = "cpu",
    repeats: Count = 7,
    steps: NonNegativeCount = 3,
    plain: tuple[str, ...] = (),
    threads: tuple[int, ...] = (1, 2),
    out: File | None = None,
) -> None:
    """Measure speed and memory of retrieval, transfer and training.

    8 regions on a target of 8192 points without normals, the reference encoded before; transfer
    with the chairs' model, also to a mesh of 100,000 faces and a scan of 1 million points. Every
    other measurement runs in a process of its own. A machine that does nothing else is needed.

    Example: nrdf eval speed --out speed.json

    Args:
        preset: Presets to measure.
        device: cpu, cuda, cuda:N or auto.
        repeats: Warm retrievals, of which the median is taken.
        steps: Training steps a stage, of which the median is taken; 0 leaves training out.
        plain: Configurations of the paper's network (paper-short) whose training steps are
            compared with a plain reading of the paper's modules, and nothing else is measured.
        threads: With --plain, on so many threads, one after the other.
        out: JSON file to write.
    """
    from nrdf.io.atomic import write_json
    from nrdf_benchmark.speed.common import in_new_process
    from nrdf_benchmark.speed.large import KINDS, measure_large
    from nrdf_benchmark.speed.measure import measure, to_json
    from nrdf_benchmark.speed.plain_steps import compare_steps
    from nrdf_benchmark.speed.transfer import measure_transfer

    if plain:
        compared = [
            one
            for name in plain
            for count in threads
            for one in in_new_process(compare_steps, name, count, steps)
        ]
        show_comparisons(compared)
        if out is not None:
            write_json(out, {"versions": versions(), "plain": [vars(one) for one in compared]})
        return
    with errors.status("measuring") as status:
        retrieval, training, failures = measure(preset, device, repeats, steps, status.update)
        status.update("transfer")
        transfer = measure_transfer(device, repeats)
        large = []
        for kind, what in KINDS.items():
            status.update(f"transfer to {what}")
            large.append(in_new_process(measure_large, kind, device))
    show_speeds(retrieval, training, failures)
    show_transfer_speed(transfer)
    show_large_transfers(large)
    if out is not None:
        content = {**to_json(retrieval, training, failures), "transfer": vars(transfer)}
        content["large"] = [vars(one) for one in large]
        write_json(out, {"versions": versions(), **content})
        console.print(f"wrote {out}")


def show_comparisons(compared: Sequence[StepComparison]) -> None:
    """A table of training steps, ours and the plain reading's side by side."""
    shown = table(
        "training steps beside a plain reading, equal work", "preset", "stage", "threads",
        "shapes", "points, queries, cloud", "steps/s", "plain", "times", "CPU s", "plain", "times",
    )  # fmt: skip
    for one in compared:
        shown.add_row(
            one.preset, one.stage, str(one.threads), str(one.shapes),
            f"{one.points}, {one.queries}, {one.cloud_points}",
            f"{1 / one.step_s:.2f}", f"{1 / one.plain_step_s:.2f}",
            f"{one.plain_step_s / one.step_s:.1f}",
            f"{one.cpu_s:.2f}", f"{one.plain_cpu_s:.2f}", f"{one.plain_cpu_s / one.cpu_s:.1f}",
        )  # fmt: skip
    show(shown)


def show_transfer_speed(transfer: TransferSpeed) -> None:
    """A table of a transfer's time by phase."""
    from nrdf_benchmark.speed.transfer import TRANSFER_BAR_S

    title = f"\ntransfer, {transfer.regions} regions, {transfer.points} points"
    shown = table(title, "", "s", "must keep to")
    shown.add_row("further targets, all files", f"{transfer.wall_s:.2f}", f"{TRANSFER_BAR_S:g}")
    for phase, seconds in transfer.phases.items():
        shown.add_row(f"  {phase}", f"{seconds:.2f}", "")
    shown.add_row("CPU time, all threads", f"{transfer.cpu_s:.2f}", "")
    show(shown)


def show_large_transfers(large: Sequence[LargeTransfer]) -> None:
    """A table of transfers to fine meshes and dense scans."""
    from nrdf_benchmark.speed.large import BARS, KINDS

    shown = table("\ntransfer, 8 regions", "", *(KINDS[one.kind] for one in large), "must keep to")
    rows = {
        "further targets, all files, s": ("wall_s", 1.0),
        "CPU time, all threads, s": ("cpu_s", 1.0),
        "nrdf transfer, cold shell, s": ("command_s", 1.0),
        "peak memory, GB": ("peak_memory_bytes", 1e9),
    }
    for title, (name, unit) in rows.items():
        values = (f"{getattr(one, name) / unit:.1f}" for one in large)
        shown.add_row(title, *values, f"{BARS[name] / unit:g}" if name in BARS else "")
    show(shown)


def show_speeds(
    retrieval: list[RetrievalSpeed], training: list[TrainingSpeed], failures: list[Failure]
) -> None:
    """Two tables, and what could not be measured."""
    from nrdf_benchmark.speed.measure import BARS

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
