"""`nrdf bench --robot`: the demonstration on the bundled arm."""

from __future__ import annotations

from pathlib import Path

from nrdf.commands.console import console, errors, show, table, versions


def bench_robot(folder: Path, out: Path | None) -> None:
    """Drive the demonstration's chairs, and print figures against their bars."""
    from nrdf.io.output import write_json
    from nrdf_benchmark.robot import drive, figures, together

    with errors.status("simulation") as status:
        reports = drive(folder, status.update)
    columns = {**reports, "all": together(reports)}
    shown = table("the demonstration on the bundled arm", "", "bar", *columns)
    for figure in figures(columns):
        cells = [
            f"{value:.2f}" + ("" if met else " ✗")
            for value, met in zip(figure.values, figure.met, strict=True)
        ]
        shown.add_row(figure.name, figure.bar, *cells)
    show(shown)
    if out is not None:
        write_json(out, {"versions": versions(), "reports": reports})
        console.print(f"wrote {out}")
