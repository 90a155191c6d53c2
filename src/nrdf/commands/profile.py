"""`nrdf profile`: a spray gun's profile from a strip that was measured."""

from __future__ import annotations

import io
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from tyro.conf import Positional

from nrdf.commands.console import console, errors
from nrdf.commands.options import File, Metavar
from nrdf.io.atomic import write_atomically
from nrdf.io.bounds import Positive

if TYPE_CHECKING:
    from nrdf.process_model.profile_fit import FittedProfile, Strip

_POOR = 0.05  # root of the mean square, of the largest thickness


def profile(
    strip: Positional[File],
    feed_mm_s: Annotated[Positive, Metavar("MM_S")],
    standoff_mm: Annotated[Positive, Metavar("MM")],
    along: File | None = None,
    along_feed_mm_s: Annotated[Positive, Metavar("MM_S")] | None = None,
    shape: Literal["beta", "gaussian"] = "beta",
    out: Annotated[Path, Metavar("FILE.yaml")] | None = None,
    picture: Annotated[Path, Metavar("FILE.png")] | None = None,
) -> None:
    """Fit a spray gun's profile to a measured strip.

    The strip is the film's thickness across one straight pass over a plate, at even speed. Prints
    the profile as a knowledge file has it in `tool.profile`, and how far off the fit is.

    Example: nrdf profile strip.csv --feed-mm-s 300 --standoff-mm 150 --out gun.yaml

    Args:
        strip: CSV file with the columns offset_mm, from anywhere, and thickness_um.
        feed_mm_s: Speed of the gun over the plate.
        standoff_mm: From the gun's tool centre point to the plate.
        along: A second strip, with the gun turned by 90° about its axis, which tells the half-width
            along the travel; the fan is taken to be round unless given.
        along_feed_mm_s: Speed in that pass; --feed-mm-s unless given.
        shape: beta ends at its half-widths; those of a gaussian are standard deviations.
        out: YAML file to write the profile to.
        picture: PNG file to draw strip and fit into.
    """
    from nrdf.io.atomic import write_atomically
    from nrdf.io.output import output_file
    from nrdf.process_model.profile_fit import fit_profile, read_strip

    across = read_strip(strip, 1e-3 * feed_mm_s)
    second = read_strip(along, 1e-3 * (along_feed_mm_s or feed_mm_s)) if along else None
    fitted = fit_profile(across, 1e-3 * standoff_mm, shape, second)
    text = profile_text(fitted)
    console.print(text, end="", highlight=False)
    console.print(f"off the strip by {fitted.error:.1%} of its largest thickness, in the mean")
    if fitted.error > _POOR:
        other = "gaussian" if shape == "beta" else "beta"
        errors.print(
            f"the strip has another form than a {shape}: look at --picture, or try --shape {other}",
            style="yellow",
        )
    for path, content in ((out, text.encode()), (picture, None)):
        with output_file(path, [strip, along]):
            if path is None:
                continue
            if content is None:
                draw_strip(path, across, fitted)
            else:
                write_atomically(path, [content])
            console.print(f"wrote {path}")


def profile_text(fitted: FittedProfile) -> str:
    """A profile as the keys of `tool.profile`, in YAML."""
    gun = fitted.profile
    lines = [
        "profile:",
        f"  shape: {gun.shape}",
        f"  across_mm: {1e3 * gun.across_m:.4g}",
        f"  along_mm: {1e3 * gun.along_m:.4g}",
        f"  flow_mm3_s: {1e9 * gun.flow_m3_s:.4g}",
        f"  standoff_mm: {1e3 * gun.standoff_m:.4g}",
    ]
    if gun.shape == "beta":
        lines += [
            f"  across_exponent: {gun.across_exponent:.4g}",
            f"  along_exponent: {gun.along_exponent:.4g}",
        ]
    return "\n".join(lines) + "\n"


def draw_strip(path: Path, strip: Strip, fitted: FittedProfile) -> None:
    """Draw a measured strip and the fitted one. Raises OutputError."""
    import numpy as np
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure((7.0, 4.0), dpi=100, facecolor="white", layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.add_subplot()
    end = 1.1 * max(fitted.profile.ends_m[0], float(np.abs(strip.offset_m - fitted.middle_m).max()))
    away = np.linspace(-end, end, 601)
    film = fitted.profile.strip(away, strip.feed_m_s)
    axes.plot(1e3 * (away + fitted.middle_m), 1e6 * film, color="#3f6fb5", label="fitted")
    axes.plot(
        1e3 * strip.offset_m, 1e6 * strip.thickness_m, "o", color="#d9532c", markersize=4.5,
        label="measured",
    )  # fmt: skip
    axes.set_xlabel("offset across the pass, mm")
    axes.set_ylabel("thickness, µm")
    axes.set_title(f"{fitted.profile.shape}, off by {fitted.error:.1%} in the mean", fontsize=11)
    axes.set_ylim(bottom=0.0)
    axes.spines[["top", "right"]].set_visible(False)
    axes.legend(frameon=False)
    drawn = io.BytesIO()
    figure.savefig(drawn, format=path.suffix.removeprefix(".") or "png")
    write_atomically(path, [drawn.getbuffer()])
