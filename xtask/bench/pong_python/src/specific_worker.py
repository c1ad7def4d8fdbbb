"""Replies to queries, and notes how long values were on their way."""

import numpy as np
import numpy.typing as npt
from bench_protocol import Pong

from pong_python import Context, PictureView, Worker


class SpecificWorker(Worker):
    """The worker of `pong_python`."""

    def initialize(self, ctx: Context) -> None:
        self.pong = Pong()
        print("ready", flush=True)

    def compute(self, ctx: Context) -> None:
        pass

    def echo_echo(self, ctx: Context, data: npt.NDArray[np.uint8]) -> npt.NDArray[np.uint8]:
        return data

    def sample_sample(self, ctx: Context, sent: int, data: npt.NDArray[np.uint8]) -> None:
        self.pong.sample(sent, data)

    def pictures_picture(self, ctx: Context, picture: PictureView) -> None:
        self.pong.sample(picture.sent, picture.data)
