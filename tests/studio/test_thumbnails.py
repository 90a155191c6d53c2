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
    assert pictures.stamp("box", None) == pictures.stamp("box", result) == ""
    assert drawn.wait(60)
    stamp = pictures.stamp("box", result)
    assert stamp and pictures.stamp("box", result) == stamp
    picture = np.array(Image.open(io.BytesIO(pictures.png("box"))))
    assert picture.shape[1:] == (140, 3) and picture.std() > 10
    pictures.stop()
