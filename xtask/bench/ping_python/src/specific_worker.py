"""Runs one block a period, by commands on its standard input."""

import numpy as np
import numpy.typing as npt
from bench_protocol import Ping

from ping_python import Context, Worker


class SpecificWorker(Worker):
    """The worker of `ping_python`."""

    def initialize(self, ctx: Context) -> None:
        def place(sent: int, data: npt.NDArray[np.uint8], fill: bool) -> None:
            with ctx.pictures.loan_picture() as picture:
                picture.sent = sent
                view = picture.resize("data", len(data))
                if fill:
                    view[:] = data
                del view

        self.ping = Ping(ctx.sample.sample, place, ctx.echo.echo)

    def compute(self, ctx: Context) -> None:
        if not self.ping.block():
            ctx.stop("no more orders")
