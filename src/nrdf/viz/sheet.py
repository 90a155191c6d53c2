"""A white picture that drawn objects and texts are put on: what is written beside renderings.

Pillow draws it: matplotlib takes most of a second to be imported, in each command that ends with a
picture. Only its font is used, DejaVu Sans, which has letters of most languages.
"""

from __future__ import annotations

import io
from collections.abc import Mapping
from functools import cache
from importlib.util import find_spec
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from nrdf.errors import OutputError
from nrdf.io.atomic import write_atomically

DARK, GREY = "#222", "#666"  # of titles, and of notes
_LEGEND_ROW = 26  # pixels
_LEGEND_TEXT = 16
_EDGE = 12  # above a legend, and below what stands last
_SWATCH, _GAP, _APART = 18, 8, 26  # a colour's side, its distance from the name, from the next


class Sheet:
    """A picture of `width` and `height` pixels, white; x goes right from 0, y down from 0."""

    def __init__(self, width: int, height: int) -> None:
        self._image = Image.new("RGB", (width, height), "white")
        self._draw = ImageDraw.Draw(self._image)

    def paste(self, image: np.ndarray, x: int, y: int) -> None:
        """Put a picture (h, w, 3) in [0, 1] with its upper left corner at (x, y)."""
        self._image.paste(_as_image(image), (x, y))

    def write(
        self,
        text: str,
        x: float,
        y: float,
        size: float,
        colour: str = DARK,
        bold: bool = False,
        anchor: str = "ma",
    ) -> None:
        """Write a line of text, `size` pixels high; anchor: what of it is at (x, y), as Pillow has
        it ("ma": the middle of its upper edge)."""
        self._draw.text((x, y), text, colour, _font(size, bold), anchor)

    def write_upwards(self, text: str, x: int, y: int, size: float, colour: str = DARK) -> None:
        """Write a line of text that is read from below, its middle at (x, y)."""
        left, top, right, bottom = _font(size, False).getbbox(text)
        line = Image.new("RGB", (int(right - left) + 2, int(bottom - top) + 2), "white")
        ImageDraw.Draw(line).text((1 - left, 1 - top), text, colour, _font(size, False))
        line = line.transpose(Image.Transpose.ROTATE_90)
        self._image.paste(line, (x - line.width // 2, y - line.height // 2))

    def add_legend(self, colours: Mapping[str, np.ndarray]) -> None:
        """Each region's name beside its colour (3,) in [0, 1], along the lower edge: as high as
        `legend_height` says."""
        font = _font(_LEGEND_TEXT, False)
        rows = _legend_rows(list(colours), self._image.width)
        y = self._image.height - _EDGE // 2 - _LEGEND_ROW * len(rows)
        for row in rows:
            x = max(_GAP, (self._image.width - sum(map(_entry_width, row)) + _APART) / 2)
            for name in row:
                filled = tuple((255 * np.asarray(colours[name])).round().astype(int).tolist())
                self._draw.rectangle((x, y, x + _SWATCH - 1, y + _SWATCH - 1), filled)
                middle = (x + _SWATCH + _GAP, y + _SWATCH / 2)
                self._draw.text(middle, name, DARK, font, "lm")
                x += _entry_width(name)
            y += _LEGEND_ROW

    def save(self, path: Path) -> None:
        """Write the picture, whole or not at all; its ending tells the format (.png, .jpg).

        Raises OutputError if it cannot be written, or for an ending that no format has.
        """
        write_atomically(path, [_encoded(self._image, path.suffix or ".png")])


def legend_height(colours: Mapping[str, np.ndarray], width: int) -> int:
    """Pixels to leave for a legend of these colours at the lower edge of a picture so wide."""
    rows = len(_legend_rows(list(colours), width))
    return _EDGE + (_EDGE + _LEGEND_ROW * rows if rows else 0)


def png_of(image: np.ndarray) -> bytes:
    """A picture (h, w, 3) in [0, 1] as a PNG file's content."""
    return _encoded(_as_image(image), ".png")


def _encoded(image: Image.Image, ending: str) -> bytes:
    """A picture as the content of a file with that ending. Raises OutputError for one that no
    picture has."""
    Image.preinit()  # the usual formats; all of Pillow's take longer
    kind = Image.EXTENSION.get(ending.lower())
    if kind not in Image.SAVE:
        raise OutputError(f"no picture can be written as '{ending}'; use .png or .jpg")
    file = io.BytesIO()
    image.save(file, kind, compress_level=4)
    return file.getvalue()


def _as_image(image: np.ndarray) -> Image.Image:
    return Image.fromarray((255 * image).clip(0, 255).astype(np.uint8))


def _legend_rows(names: list[str], width: int) -> list[list[str]]:
    """The names of each row, as many as fit beside one another."""
    rows: list[list[str]] = []
    left = 0.0
    for name in names:
        needed = _entry_width(name)
        if not rows or needed > left:
            rows.append([])
            left = width - _APART
        rows[-1].append(name)
        left -= needed
    return rows


def _entry_width(name: str) -> float:
    return _SWATCH + _GAP + _font(_LEGEND_TEXT, False).getlength(name) + _APART


@cache
def _font(size: float, bold: bool) -> ImageFont.FreeTypeFont:
    """DejaVu Sans, so many pixels high."""
    package = find_spec("matplotlib")  # where its fonts are; this does not import it
    assert package is not None and package.origin is not None
    fonts = Path(package.origin).parent / "mpl-data" / "fonts" / "ttf"
    return ImageFont.truetype(fonts / ("DejaVuSans-Bold.ttf" if bold else "DejaVuSans.ttf"), size)
