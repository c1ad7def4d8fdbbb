"""Publishes the pictures of a camera that OpenCV reads."""

from __future__ import annotations

import logging
import time

from robocomp import Fatal

from capture import Capture, Settings
from usb_camera import Context, PixelFormat, Worker

log = logging.getLogger(__name__)

# The pixels of a picture have at most so many bytes.
MOST_BYTES = 2_100_000


class SpecificWorker(Worker):
    """Takes the newest picture once a period."""

    def initialize(self, ctx: Context) -> None:
        """A camera that is missing at the start keeps the network from starting."""
        params = ctx.params
        self.number = 0
        self.capture = Capture(
            Settings(
                str(params.device),
                params.width,
                params.height,
                params.rate,
                params.colour,
            )
        )
        # A camera may take seconds to open.
        self.seen = time.monotonic()

    def compute(self, ctx: Context) -> None:
        taken = self.capture.take()
        if taken is None:
            self.missing(ctx)
            return
        captured, pixels = taken
        self.seen = time.monotonic()
        if pixels.size > MOST_BYTES:
            height, width = pixels.shape[:2]
            raise Fatal(
                f"a picture of {width} x {height} has {pixels.size} bytes, and at most"
                f" {MOST_BYTES} fit; set width, height or colour"
            )
        self.number += 1
        with ctx.camera_pub.loan_new_image() as image:
            image.captured = captured
            image.number = self.number
            image.height, image.width = pixels.shape[:2]
            image.format = PixelFormat.RGB if pixels.ndim == 3 else PixelFormat.GREY
            image.frame = ctx.params.frame
            image.resize("data", pixels.size)[:] = pixels.reshape(-1)

    def missing(self, ctx: Context) -> None:
        """Fails if there was no picture for long."""
        quiet = time.monotonic() - self.seen
        if quiet > ctx.params.give_up.total_seconds():
            raise Fatal(f"no picture for {quiet:.1f} s: {self.capture.trouble}")
        if quiet > ctx.params.silence.total_seconds():
            raise RuntimeError(f"no picture for {quiet:.1f} s: {self.capture.trouble}")

    def finalize(self, ctx: Context) -> None:
        self.capture.stop()
