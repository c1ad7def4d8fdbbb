"""Finds coloured objects in the pictures of a camera, where the camera wrote them."""

from __future__ import annotations

import logging

from line_camera_detector import (
    CloudView,
    ColoredObjects,
    Context,
    ImageView,
    PixelFormat,
    Worker,
)
from objects import Limits, find

log = logging.getLogger(__name__)


class SpecificWorker(Worker):
    """Counts pictures between two lines of its log."""

    def initialize(self, ctx: Context) -> None:
        self.pictures = 0
        self.grey = 0
        self.objects = 0

    def compute(self, ctx: Context) -> None:
        log.info("%d pictures, %d objects", self.pictures, self.objects)
        if self.grey:
            log.warning("%d pictures have no colours", self.grey)
        self.pictures = self.grey = self.objects = 0

    def camera_pub_new_image(self, ctx: Context, image: ImageView) -> None:
        self.pictures += 1
        if image.format != PixelFormat.RGB:
            self.grey += 1
            return
        # Neither copies: OpenCV reads the pixels in shared memory.
        picture = image.data.reshape(image.height, image.width, 3)
        params = ctx.params
        limits = Limits(params.min_area, params.min_saturation, params.min_brightness)
        objects = find(picture, limits)
        self.objects += len(objects)
        ctx.colored_objects_pub.new_objects(
            ColoredObjects(
                image.captured, image.number, image.width, image.height, objects
            )
        )

    def camera_pub_new_cloud(self, ctx: Context, cloud: CloudView) -> None:
        """Clouds have no colours."""
