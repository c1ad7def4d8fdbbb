"""A camera on a thread of its own: reading a picture waits for it."""

from __future__ import annotations

import dataclasses
import logging
import os
import threading
import time

import cv2
import numpy as np
import numpy.typing as npt

Pixels = npt.NDArray[np.uint8]

log = logging.getLogger(__name__)

# The pauses between two attempts to open the device grow from the first to the second one.
FIRST_PAUSE, LONGEST_PAUSE = 0.1, 5.0

# Why there is no picture while the device is open.
SILENT = "the device gives none"


@dataclasses.dataclass(frozen=True)
class Settings:
    """What is opened, and what the driver is asked for."""

    device: str
    width: int
    height: int
    rate: float
    colour: bool

    @property
    def is_camera(self) -> bool:
        """Whether the driver sets the pace; a file gives pictures as fast as they are read."""
        return self.device.startswith("/dev/")


class Capture:
    """Keeps the newest picture, and opens a device again that has gone."""

    def __init__(self, settings: Settings) -> None:
        """Opens the device. OSError says why that is not possible."""
        self.settings = settings
        self.trouble = SILENT
        self._newest: tuple[int, Pixels] | None = None
        self._lock = threading.Lock()
        self._stopped = threading.Event()
        device = self._open()
        # A read may wait for a driver for long; it does not keep the process alive.
        self._thread = threading.Thread(target=self._run, args=(device,), daemon=True)
        self._thread.start()

    def take(self) -> tuple[int, Pixels] | None:
        """The newest picture and its time in ns, once."""
        with self._lock:
            newest, self._newest = self._newest, None
        return newest

    def stop(self) -> None:
        """Closes the device, unless its driver is stuck."""
        self._stopped.set()
        self._thread.join(1.0)

    def _open(self) -> cv2.VideoCapture:
        wanted = self.settings
        is_camera = wanted.is_camera
        device = cv2.VideoCapture(
            wanted.device, cv2.CAP_V4L2 if is_camera else cv2.CAP_ANY
        )
        if not device.isOpened():
            raise OSError(f"{wanted.device}: {reason(wanted.device)}")
        if is_camera:
            device.set(cv2.CAP_PROP_FRAME_WIDTH, wanted.width)
            device.set(cv2.CAP_PROP_FRAME_HEIGHT, wanted.height)
            device.set(cv2.CAP_PROP_FPS, wanted.rate)
            # Only the newest picture counts.
            device.set(cv2.CAP_PROP_BUFFERSIZE, 1)
        return device

    def _run(self, device: cv2.VideoCapture | None) -> None:
        pause = FIRST_PAUSE
        while not self._stopped.is_set():
            if device is None:
                try:
                    device = self._open()
                except OSError as error:
                    self.trouble = str(error)
                    self._stopped.wait(pause)
                    pause = min(2 * pause, LONGEST_PAUSE)
                    continue
                self.trouble = SILENT
                log.info("%s is open again", self.settings.device)
            count = self._read(device)
            device.release()
            device = None
            if count:
                pause = FIRST_PAUSE
            if count and not self.settings.is_camera:
                # The file begins again.
                continue
            self.trouble = f"{self.settings.device} gives no picture any more"
            log.warning(self.trouble)
            self._stopped.wait(pause)
            pause = min(2 * pause, LONGEST_PAUSE)

    def _read(self, device: cv2.VideoCapture) -> int:
        """Reads until the device gives nothing more. Returns how many pictures came."""
        count = 0
        while not self._stopped.is_set():
            is_there, picture = device.read()
            if not is_there:
                break
            captured = time.monotonic_ns()
            pixels = converted(np.asarray(picture, np.uint8), self.settings.colour)
            with self._lock:
                self._newest = (captured, pixels)
            count += 1
            if not self.settings.is_camera:
                self._stopped.wait(1.0 / self.settings.rate)
        return count


def converted(picture: Pixels, colour: bool) -> Pixels:
    """A picture of OpenCV, which is grey or has the bytes blue, green and red."""
    if picture.ndim == 3 and picture.shape[2] == 1:
        picture = picture[:, :, 0]
    if colour and picture.ndim == 2:
        return np.asarray(cv2.cvtColor(picture, cv2.COLOR_GRAY2RGB), np.uint8)
    if colour:
        return np.asarray(cv2.cvtColor(picture, cv2.COLOR_BGR2RGB), np.uint8)
    if picture.ndim == 3:
        return np.asarray(cv2.cvtColor(picture, cv2.COLOR_BGR2GRAY), np.uint8)
    return picture


def reason(device: str) -> str:
    """Why a device cannot be opened, as far as the system says."""
    if not os.path.exists(device):
        return "no such device; is it plugged in?"
    if not os.access(device, os.R_OK):
        return "permission denied; join its group, which is often `video`, and log in again"
    if device.startswith("/dev/"):
        return "another program has opened it, or it gives no pictures (a camera often has several devices)"
    return "OpenCV cannot read it"
