"""The tools of the mouse, and what can be done to a region at once: names, keys, meanings."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

Key = Literal["O", "G", "B", "L", "R", "D", "S", "M", "X", "F", "T", "1", "2"]


@dataclass(frozen=True)
class Tool:
    """A tool or an act, by its button's name; `key` takes it, `hint` says what it does."""

    name: str
    key: Key
    hint: str


TOOLS = (
    Tool("Orbit", "O", "Drag to orbit, use the wheel to zoom, drag with the right button to pan."),
    Tool("Grow", "G", "Click the surface: a patch grows from there. Its **radius** is in step 2."),
    Tool("Brush", "B", "Drag over the surface to paint; drag beside the object to orbit."),
    Tool("Lasso", "L", "Draw around the points that you see."),
    Tool("Rectangle", "R", "Drag a rectangle over the points; take Orbit to orbit again."),
    Tool("Direction", "D", "Drag on the reference along the direction of the tool path's lines."),
    Tool("Similarity", "S", "Click the reference, or move over it with the button held: points "
         "with similar descriptors are coloured on every object. How similar: in step 4."),
    Tool("Measure", "M", "Click a point: its regions, confidence and place, in the object's own "
         "frame. Click another one: how far it is from the first."),
)  # fmt: skip
ERASE = Tool("Erase", "X", "Painting takes away instead.")
ACTS = (
    Tool("Fill holes", "F", "Fill what the region encloses."),
    Tool("Smooth border", "T", "Smooth the region's border."),
    Tool("−1 mm", "1", "Move the region's border inward by a millimetre."),
    Tool("+1 mm", "2", "Move the region's border outward by a millimetre."),
)
"""What is done to the selected region, on the object that was painted on last."""


def tool(name: str) -> Tool:
    """The tool of that name. Raises KeyError for none."""
    return {each.name: each for each in TOOLS}[name]
