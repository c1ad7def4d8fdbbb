"""Coloured regions of a picture."""

from __future__ import annotations

import dataclasses

import cv2
import numpy as np
import numpy.typing as npt

from line_camera_detector import Color, ColoredObject

Pixels = npt.NDArray[np.uint8]

# Ranges of hues as OpenCV counts them: 180 in a circle, red at both ends.
HUES: dict[Color, list[tuple[int, int]]] = {
    Color.RED: [(0, 10), (170, 179)],
    Color.YELLOW: [(20, 35)],
    Color.GREEN: [(40, 85)],
    Color.BLUE: [(95, 130)],
}


@dataclasses.dataclass(frozen=True)
class Limits:
    """What counts as an object."""

    # In pixels.
    min_area: int
    # How strong and how bright a colour must be, from 0 to 255.
    min_saturation: int
    min_brightness: int


def find(picture: Pixels, limits: Limits) -> list[ColoredObject]:
    """The coloured objects of a picture with three bytes a pixel, the largest first."""
    hsv = cv2.cvtColor(picture, cv2.COLOR_RGB2HSV)
    found: list[ColoredObject] = []
    for color, hues in HUES.items():
        mask = np.zeros(hsv.shape[:2], np.uint8)
        for first, last in hues:
            low = np.array(
                [first, limits.min_saturation, limits.min_brightness], np.uint8
            )
            high = np.array([last, 255, 255], np.uint8)
            mask |= cv2.inRange(hsv, low, high).astype(np.uint8, copy=False)
        found += regions(mask, color, limits.min_area)
    found.sort(key=lambda one: one.area, reverse=True)
    return found


def regions(mask: Pixels, color: Color, min_area: int) -> list[ColoredObject]:
    """The connected regions of a mask."""
    _, _, boxes, centres = cv2.connectedComponentsWithStats(mask)
    found: list[ColoredObject] = []
    # The first one is the area outside of the mask.
    for box, centre in zip(boxes[1:].tolist(), centres[1:].tolist(), strict=True):
        left, top, width, height, area = box
        x, y = centre
        if area >= min_area:
            found.append(ColoredObject(color, x, y, left, top, width, height, area))
    return found
