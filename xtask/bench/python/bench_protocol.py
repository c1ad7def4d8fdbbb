"""The protocol of `xtask/bench/protocol`, for programs in Python. One kind is added: `lend` is `place`
whose data are lent, sent and received, and neither written nor read."""

import sys
import time
from collections.abc import Callable

import numpy as np
import numpy.typing as npt

Data = npt.NDArray[np.uint8]

_LARGE = 64 * 1024

now = time.monotonic_ns


class Ping:
    """Runs blocks, as the lines of the standard input order them."""

    def __init__(
        self,
        publish: Callable[[int, Data], object],
        place: Callable[[int, Data, bool], object],
        query: Callable[[Data], Data],
    ) -> None:
        self.publish = publish
        self.place = place
        self.query = query
        print("ready", flush=True)

    def block(self) -> bool:
        """Runs the next block; `False` at the end of the input."""
        words = sys.stdin.readline().split()
        if not words:
            return False
        kind, size, count = words[0], int(words[1]), int(words[2])
        data = np.full(size, 7, np.uint8)
        times: list[int] = []
        for _ in range(count):
            if kind == "query":
                start = now()
                answer = self.query(data)
                times.append(now() - start)
                if len(answer) != size:
                    raise SystemExit("another echo")
                continue
            time.sleep(0.0002 if size < _LARGE else 0.002)
            if kind == "publish":
                self.publish(now(), data)
            else:
                self.place(now(), data, kind == "place")
        if kind != "query":
            time.sleep(0.002)
            self.publish(0, data[:0])
        report(times)
        return True


class Pong:
    """Notes how long values were on their way."""

    def __init__(self) -> None:
        self.times: list[int] = []

    def sample(self, sent: int, data: Data) -> None:
        """Takes a value. An empty one ends the block."""
        if len(data):
            self.times.append(now() - sent)
            return
        report(self.times)
        self.times = []


def report(times: list[int]) -> None:
    """Prints the times of a block."""
    print("times", *times, flush=True)
