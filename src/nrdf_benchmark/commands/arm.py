"""`nrdf eval arm`: the demonstration, simulated on the bundled arm."""

from __future__ import annotations

from tyro.conf import Positional

from nrdf.commands.console import console, errors, show, table, versions
from nrdf.commands.options import File, Folder
from nrdf.commands.output_lock import lock_output


@lock_output("out")
def arm(demo: Positional[Folder], out: File | None = None) -> None:
    """Simulate the demonstration's chairs on the bundled arm, against the bars of
    docs/evidence/robot.md.

    Reach, accuracy, collisions, force, coverage and speed, by chair and of all of them.
    Needs MuJoCo: pip install 'nrdf[robot]'.

    Example: nrdf eval arm demo/

    Args:
        demo: Folder that `nrdf demo` wrote.
        out: JSON file to write, with the report of every chair.
    """
    from nrdf.io.atomic import write_json
    from nrdf_benchmark.arm import combine_reports, measure, simulate_demo

    with errors.status("simulation") as status:
        reports = simulate_demo(demo, status.update)
    columns = {**reports, "all": combine_reports(reports)}
    shown = table("the demonstration on the bundled arm", "", "bar", *columns)
    for metric in measure(columns):
        cells = [
            f"{value:.2f}" + ("" if met else " ✗")
            for value, met in zip(metric.values, metric.met, strict=True)
        ]
        shown.add_row(metric.name, metric.bar, *cells)
    show(shown)
    if out is not None:
        write_json(out, {"versions": versions(), "reports": reports})
        console.print(f"wrote {out}")
