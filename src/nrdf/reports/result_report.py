"""What a transfer's report says of the film or depth that its processes leave."""

from __future__ import annotations

import itertools
from collections.abc import Mapping
from typing import Any, Literal

import numpy as np

from nrdf.process.result_target import ResultSettings, result_settings
from nrdf.process.transfer_result import PathResult, TransferResult
from nrdf.process_model.cells import Cells
from nrdf.process_model.result import ResultMetrics
from nrdf.process_model.worst_places import worst_places
from nrdf.viz.heat_map import COLOURS, LEVELS, HeatMap, heat_map


def result_content(step: PathResult, up: np.ndarray, forward: np.ndarray) -> dict[str, Any] | None:
    """A path's result as plain values, in SI; None for a process without a target.

    up, forward: (3,) of the object, by which the worst places are named.
    """
    settings = result_settings(step.process)
    if step.result is None or settings is None:
        return None
    model, target = step.result.model, settings.target
    inside = model.cells.inside
    places = worst_places(
        model.cells.centres[inside], model.region_areas_m2, model.values()[inside], target, up,
        forward,
    )  # fmt: skip
    feeds = model.moves.feeds_m_s
    return {
        "what": "film" if step.process.thickness_um else "depth",
        "target_m": target.value_m,
        "tolerance_m": target.tolerance_m,
        "planned": vars(step.result.metrics),
        "taught": vars(step.result.taught),
        "feed_least_m_s": float(feeds.min()),
        "feed_most_m_s": float(feeds.max()),
        "worst": [vars(place) for place in places],
    }


def result_lines(content: Mapping[str, Any]) -> list[tuple[str, str]]:
    """A result by name and value, as people read it."""
    planned, taught = content["planned"], content["taught"]
    lines = [
        (f"{content['what']} wanted", _wanted(content)),
        ("within it, planned · at one feed", f"{planned['within']:.1%} · {taught['within']:.1%}"),
        ("mean, 99 % between", _range(planned)),
        ("variation, planned · at one feed",
         f"{planned['variation']:.1%} · {taught['variation']:.1%}"),
        ("feeds", _feeds(content)),
    ]  # fmt: skip
    if content["what"] == "film":
        both = f"{planned['overspray']:.1%} · {taught['overspray']:.1%}"
        lines.append(("overspray, planned · at one feed", both))
    return [*lines, ("worst places", _worst(content))]


def feed_in_words(path: Mapping[str, Any], taught: str) -> str:
    """The feeds of a path, as its report has them: `taught`, unless its result has others."""
    return _feeds(path["result"]) if path.get("result") else taught


def _feeds(content: Mapping[str, Any]) -> str:
    return f"{1e3 * content['feed_least_m_s']:.0f} to {1e3 * content['feed_most_m_s']:.0f} mm/s"


def result_heat_maps(result: TransferResult) -> list[HeatMap | None]:
    """A picture of each path's result; None for those without."""
    turn = np.eye(3) if result.pose is None else result.pose.rotation
    drawn: list[HeatMap | None] = []
    for step in result.paths:
        settings = result_settings(step.process)
        if step.result is None or settings is None or result.surface is None:
            drawn.append(None)
            continue
        model, target = step.result.model, settings.target
        values = model.cells.of_region(model.values())
        drawn.append(
            heat_map(
                result.surface, model.cells.fine, values, target.value_m, target.tolerance_m, turn
            )
        )
    return drawn


def executed_content(
    settings: ResultSettings,
    what: Literal["film", "depth"],
    cells: Cells,
    values_m: np.ndarray,
    executed: ResultMetrics,
    planned: ResultMetrics,
    upright: np.ndarray,
) -> dict[str, Any]:
    """What an arm really left, as plain values, in SI. upright: (3, 3), whose rows are ahead, left
    and up of the object."""
    target, inside = settings.target, cells.inside
    places = worst_places(
        cells.centres[inside], cells.areas_m2[inside], values_m[inside], target, upright[2],
        upright[0],
    )  # fmt: skip
    return {
        "what": what,
        "target_m": target.value_m,
        "tolerance_m": target.tolerance_m,
        "executed": vars(executed),
        "planned": vars(planned),
        "worst": [vars(place) for place in places],
    }


def executed_lines(content: Mapping[str, Any]) -> list[tuple[str, str]]:
    """What an arm really left, by name and value, as people read it."""
    done, planned = content["executed"], content["planned"]

    def both(name: str) -> str:
        return f"{done[name]:.1%} · {planned[name]:.1%}"

    lines = [
        (f"{content['what']} wanted", _wanted(content)),
        ("within it, executed · planned", both("within")),
        ("less, more than it", f"{done['below']:.1%}, {done['above']:.1%}"),
        ("mean, 99 % between", _range(done)),
        ("variation, executed · planned", both("variation")),
        ("at work, executed · planned", f"{done['seconds']:.1f} · {planned['seconds']:.1f} s"),
    ]
    if content["what"] == "film":
        lines.append(("overspray, executed · planned", both("overspray")))
    return [*lines, ("worst places", _worst(content))]


def _wanted(content: Mapping[str, Any]) -> str:
    return f"{1e6 * content['target_m']:.4g} ± {1e6 * content['tolerance_m']:.4g} µm"


def _range(metrics: Mapping[str, Any]) -> str:
    mean, least, most = (1e6 * metrics[f"{name}_m"] for name in ("mean", "least", "most"))
    return f"{mean:.3g} µm, {least:.3g} to {most:.3g} µm"


def _worst(content: Mapping[str, Any]) -> str:
    places = [f"{place['where']}: {1e6 * place['value_m']:.3g} µm" for place in content["worst"]]
    return "; ".join(places) or "none beyond the tolerance"


def histogram(shares: tuple[float, ...], target_m: float, tolerance_m: float) -> list[Any]:
    """Range in µm, share of the area and colour of each of a heat map's ranges."""
    ends = [1e6 * (target_m + level * tolerance_m) for level in LEVELS[1:-1]]
    names = [f"below {ends[0]:.3g}"]
    names += [f"{low:.3g} to {high:.3g}" for low, high in itertools.pairwise(ends)]
    names += [f"above {ends[-1]:.3g}"]
    return list(zip(names, shares, COLOURS, strict=True))
