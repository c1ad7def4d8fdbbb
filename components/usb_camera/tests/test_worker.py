"""The driver with a file in place of the camera: both are the same to OpenCV."""

from __future__ import annotations

import os
import time
from collections.abc import Callable
from datetime import timedelta
from pathlib import Path

import cv2
import numpy as np
import pytest
from robocomp import Fatal

from specific_worker import SpecificWorker
from usb_camera import Image, Params, PixelFormat
from usb_camera.testing import TestContext

RED, BLUE = (200, 30, 40), (40, 30, 200)
SIZE = (64, 48)
LIMIT = 20.0


def film(path: Path) -> None:
    """Three red pictures, then three blue ones, put in place at once."""
    begun = path.with_name("begun.avi")
    code = cv2.VideoWriter.fourcc(*"MJPG")
    writer = cv2.VideoWriter(str(begun), code, 30.0, SIZE)
    for red, green, blue in [RED] * 3 + [BLUE] * 3:
        writer.write(np.full((SIZE[1], SIZE[0], 3), (blue, green, red), np.uint8))
    writer.release()
    begun.rename(path)


def params(device: Path, colour: bool = True) -> Params:
    return Params(
        device=device,
        width=SIZE[0],
        height=SIZE[1],
        rate=200.0,
        colour=colour,
        frame="eye",
        # Longer than a busy computer needs for a picture.
        silence=timedelta(seconds=LIMIT),
        give_up=timedelta(seconds=2 * LIMIT),
    )


def started(device: Path, colour: bool = True) -> tuple[TestContext, SpecificWorker]:
    test = TestContext(params(device, colour))
    return test, test.start(SpecificWorker)


def until(done: Callable[[], bool]) -> None:
    begun = time.monotonic()
    while not done():
        assert time.monotonic() - begun < LIMIT
        time.sleep(0.001)


def images(test: TestContext, worker: SpecificWorker, count: int) -> list[Image]:
    """The next pictures."""
    found: list[Image] = []

    def is_done() -> bool:
        worker.compute(test.ctx)
        for name, image in test.camera_pub.take_samples():
            assert name == "new_image"
            found.append(image)
        return len(found) >= count

    until(is_done)
    return found


def test_pictures_have_their_colours_and_numbers(tmp_path: Path) -> None:
    film(tmp_path / "camera.avi")
    test, worker = started(tmp_path / "camera.avi")
    # More than the file has: it begins again.
    found = images(test, worker, 10)
    assert [image.number for image in found] == list(range(1, len(found) + 1))
    times = [image.captured for image in found]
    assert times == sorted(times)
    seen = set()
    for image in found:
        assert (image.width, image.height, image.frame) == (*SIZE, "eye")
        assert image.format == PixelFormat.RGB
        colour = image.data.reshape(image.height, image.width, 3)[20, 30]
        # JPEG changes colours a little.
        seen |= {c for c in (RED, BLUE) if np.abs(colour.astype(int) - c).max() < 12}
    assert seen == {RED, BLUE}
    worker.finalize(test.ctx)


def test_a_grey_picture_has_a_byte_a_pixel(tmp_path: Path) -> None:
    film(tmp_path / "camera.avi")
    test, worker = started(tmp_path / "camera.avi", colour=False)
    [image, *_] = images(test, worker, 1)
    assert image.format == PixelFormat.GREY
    assert image.data.size == SIZE[0] * SIZE[1]
    worker.finalize(test.ctx)


def test_a_camera_that_is_unplugged_comes_back_or_the_component_ends(
    tmp_path: Path,
) -> None:
    device = tmp_path / "camera.avi"
    film(device)
    test, worker = started(device)
    images(test, worker, 1)
    test.ctx.params.silence = timedelta(seconds=0.1)

    def is_missed() -> bool:
        try:
            worker.compute(test.ctx)
        except RuntimeError as error:
            # Before, the film was read to its end.
            return "is it plugged in?" in str(error)
        return False

    os.remove(device)
    until(is_missed)
    film(device)
    test.camera_pub.take_samples()

    def is_back() -> bool:
        try:
            worker.compute(test.ctx)
        except RuntimeError:
            pass
        return bool(test.camera_pub.take_samples())

    until(is_back)
    os.remove(device)
    until(is_missed)
    test.ctx.params.give_up = timedelta(seconds=0.2)
    ends: list[str] = []

    def has_ended() -> bool:
        try:
            worker.compute(test.ctx)
        except Fatal as end:
            ends.append(str(end))
        except RuntimeError:
            pass
        return bool(ends)

    until(has_ended)
    assert ends[0].startswith("no picture for ") and "is it plugged in?" in ends[0]
    worker.finalize(test.ctx)


def test_a_start_without_a_camera_says_what_is_wrong(tmp_path: Path) -> None:
    with pytest.raises(OSError, match="is it plugged in"):
        started(tmp_path / "nothing")
    (tmp_path / "text.avi").write_text("no film")
    with pytest.raises(OSError, match="cannot read it"):
        started(tmp_path / "text.avi")


def test_a_picture_that_does_not_fit_ends_the_component(tmp_path: Path) -> None:
    device = tmp_path / "large.avi"
    code = cv2.VideoWriter.fourcc(*"MJPG")
    writer = cv2.VideoWriter(str(device), code, 30.0, (1280, 720))
    writer.write(np.zeros((720, 1280, 3), np.uint8))
    writer.release()
    test, worker = started(device)
    with pytest.raises(Fatal, match="1280 x 720 has 2764800 bytes"):
        images(test, worker, 1)
    worker.finalize(test.ctx)
