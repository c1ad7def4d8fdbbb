"""The worker without a camera."""

from __future__ import annotations

import numpy as np
import pytest

from line_camera_detector import Color, Image, Params, PixelFormat
from line_camera_detector.testing import TestContext, in_place
from objects import Pixels
from specific_worker import SpecificWorker

RED = (220, 30, 30)
BLUE = (30, 60, 220)


def picture(*boxes: tuple[int, int, int, int, tuple[int, int, int]]) -> Pixels:
    """A grey picture with coloured rectangles: left, top, width, height, colour."""
    pixels = np.full((120, 160, 3), 128, np.uint8)
    for left, top, width, height, colour in boxes:
        pixels[top : top + height, left : left + width] = colour
    return pixels


def image(pixels: Pixels, format: PixelFormat = PixelFormat.RGB) -> Image:
    height, width = pixels.shape[:2]
    return Image(7, 3, width, height, format, "camera", pixels.ravel())


def look(pixels: Image) -> TestContext:
    test = TestContext(Params(min_area=20, min_saturation=110, min_brightness=60))
    worker = test.start(SpecificWorker)
    worker.camera_pub_new_image(test.ctx, in_place(pixels))
    return test


def test_objects_have_colours_and_places_the_largest_first() -> None:
    test = look(
        image(
            picture((10, 20, 5, 6, RED), (100, 50, 20, 10, BLUE), (70, 70, 2, 2, RED))
        )
    )
    [(name, found)] = test.colored_objects_pub.samples()
    assert (name, found.number, found.captured) == ("new_objects", 3, 7)
    # The third one is too small.
    blue, red = found.objects
    assert (blue.color, red.color) == (Color.BLUE, Color.RED)
    assert (blue.left, blue.top, blue.width, blue.height, blue.area) == (
        100,
        50,
        20,
        10,
        200,
    )
    assert (red.x, red.y) == (pytest.approx(12.0), pytest.approx(22.5))


def test_a_grey_picture_has_no_colours() -> None:
    grey = np.zeros((120, 160), np.uint8)
    assert look(image(grey, PixelFormat.GREY)).colored_objects_pub.samples() == []
    [(_, found)] = look(image(picture())).colored_objects_pub.samples()
    assert found.objects == []
