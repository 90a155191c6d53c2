"""Small pictures: drawn once a result, in the background."""

from __future__ import annotations

import io
import threading

import numpy as np
import pytest
from PIL import Image

from builders.taught_box import made_up
from nrdf.studio.model.document import LoadedObject, Target
from nrdf.studio.model.result_cache import TargetResult
from nrdf.studio.thumbnails import Thumbnails


def test_a_picture_is_drawn_once_for_each_result():
    drawn = threading.Event()
    pictures = Thumbnails(drawn.set)
    transferred = made_up()
    result = TargetResult(transferred, 1, Target(LoadedObject("box", transferred.target)))
    with pytest.raises(KeyError):
        pictures.png("box")
    red = {name: (255, 0, 0) for name in transferred.regions}
    assert pictures.stamp("box", None, red) == pictures.stamp("box", result, red) == ""
    assert drawn.wait(60)
    stamp = pictures.stamp("box", result, red)
    assert stamp and pictures.stamp("box", result, red) == stamp
    picture = np.array(Image.open(io.BytesIO(pictures.png("box"))))
    assert picture.shape[1:] == (140, 3) and picture.std() > 10
    assert (np.ptp(picture.astype(int), axis=2) > 60).any()
    coloured = picture[np.ptp(picture.astype(int), axis=2) > 60]
    assert (coloured.argmax(axis=1) == 0).all(), "in the page's colours"
    green = {name: (0, 255, 0) for name in transferred.regions}
    assert pictures.stamp("box", result, green) == "", "another colour, another picture"
    pictures.stop()
