"""What is written beside renderings: texts, legends, and files that are whole or not there."""

from __future__ import annotations

import io

import numpy as np
import pytest
from PIL import Image

from nrdf.errors import OutputError
from nrdf.viz.sheet import Sheet, legend_height, png_of

RED, BLUE = np.array([0.8, 0.1, 0.1]), np.array([0.1, 0.2, 0.8])


def saved(sheet, tmp_path):
    path = tmp_path / "sheet.png"
    sheet.save(path)
    return np.asarray(Image.open(path)) / 255


def extent(image, channel_range=0.5):
    """Rows and columns, first and last, of what is not white."""
    rows, columns = np.nonzero((image < channel_range).any(axis=-1))
    return rows.min(), rows.max(), columns.min(), columns.max()


def test_pictures_are_put_where_they_should_be(tmp_path):
    sheet = Sheet(60, 40)
    sheet.paste(np.tile(RED, (10, 20, 1)), 30, 5)
    image = saved(sheet, tmp_path)
    assert image.shape == (40, 60, 3)
    assert extent(image) == (5, 14, 30, 49)
    np.testing.assert_allclose(image[5:15, 30:50], np.broadcast_to(RED, (10, 20, 3)), atol=0.01)


def test_text_is_centred_and_as_high_as_asked(tmp_path):
    sheet = Sheet(400, 60)
    sheet.write("Backrest Ünterseite", 200, 10, 20, bold=True)
    first, last, left, right = extent(saved(sheet, tmp_path))
    assert first >= 8 and last < 40 and 14 <= last - first <= 26
    assert abs((left + right) / 2 - 200) < 3


def test_text_upwards_is_turned_about_its_middle(tmp_path):
    sheet = Sheet(60, 200)
    sheet.write_upwards("retrieved", 30, 100, 17)
    first, last, left, right = extent(saved(sheet, tmp_path))
    assert last - first > 3 * (right - left)
    assert abs((first + last) / 2 - 100) < 3 and abs((left + right) / 2 - 30) < 4


def test_a_legend_has_every_colour_and_takes_the_rows_it_needs(tmp_path):
    few = {"seat": RED, "back": BLUE}
    many = {f"a region of the object {i}": np.array([0.02 * i, 0.5, 0.1]) for i in range(12)}
    assert legend_height({}, 300) < legend_height(few, 300) < legend_height(many, 300)
    for colours in (few, many):
        high = legend_height(colours, 600)
        sheet = Sheet(600, high + 50)
        sheet.add_legend(colours)
        image = saved(sheet, tmp_path)
        assert (image[:50] == 1).all()
        for colour in colours.values():
            assert (np.abs(image - colour).max(axis=-1) < 0.01).sum() >= 18 * 18
        assert extent(image)[3] < 599


def test_a_name_wider_than_the_picture_has_a_row_of_its_own(tmp_path):
    colours = {"x" * 80: RED, "seat": BLUE}
    assert legend_height(colours, 200) > legend_height({"seat": BLUE}, 200)
    sheet = Sheet(200, 60)
    sheet.add_legend(colours)
    image = saved(sheet, tmp_path)
    for colour in (RED, BLUE):
        assert (np.abs(image - colour).max(axis=-1) < 0.01).sum() >= 18 * 18


@pytest.mark.parametrize("ending", [".png", ".JPG"])
def test_the_ending_tells_the_format(tmp_path, ending):
    path = tmp_path / f"picture{ending}"
    Sheet(20, 10).save(path)
    assert Image.open(path).format == {".png": "PNG", ".JPG": "JPEG"}[ending]


def test_an_ending_of_no_picture_is_refused(tmp_path):
    with pytest.raises(OutputError, match=r"as '.docx'; use .png or .jpg"):
        Sheet(20, 10).save(tmp_path / "picture.docx")
    assert list(tmp_path.iterdir()) == []


def test_png_of_gives_the_picture_back():
    image = np.random.default_rng(0).random((7, 5, 3))
    again = np.asarray(Image.open(io.BytesIO(png_of(image))))
    np.testing.assert_array_equal(again, (255 * image).astype(np.uint8))
