"""Getting around without touching anything: the meaning of a scan, and the motions.

This is the policy of the component `avoider`, which explains it. It computes with numbers of 32
bits in the same order, so that both decide the same in the same world.
"""

from __future__ import annotations

import dataclasses
import enum

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float32]

# Half the width of the sector ahead, in rad.
AHEAD = np.float32(0.6)
# Half the width of the sector in which the robot must not touch anything it passes, in rad.
ASIDE = np.float32(1.3)
# The safe distance aside, as a part of the safe distance ahead.
ASIDE_PART = np.float32(0.45)
# How much clearer than necessary the way must be before the robot drives again.
MARGIN = np.float32(1.25)
# Half the width of the directions to lean towards, in rad.
VIEW = np.float32(1.0)
# Half the width of the opening that is looked for, in rad.
OPENING = np.float32(0.2)
# How strongly the robot turns towards an opening, in 1/s.
LEAN = np.float32(0.8)


@dataclasses.dataclass(frozen=True)
class Scan:
    """Angles in rad from straight ahead, counter-clockwise, and distances in mm."""

    angles: Floats
    distances: Floats

    def __len__(self) -> int:
        return len(self.angles)


@dataclasses.dataclass(frozen=True)
class Settings:
    """The parameters of the policy."""

    # Nothing ahead may come nearer, in mm.
    safe_distance: np.float32
    # In mm/s.
    speed: np.float32
    # In rad/s.
    turn_speed: np.float32


@dataclasses.dataclass(frozen=True)
class Motion:
    """A command for the base: forwards in mm/s, counter-clockwise in rad/s."""

    advance: float = 0.0
    turn: float = 0.0


class Side(enum.Enum):
    """A side to which the robot turns on the spot."""

    LEFT = 1
    RIGHT = -1

    @classmethod
    def freer(cls, scan: Scan) -> Side:
        """The side on which things are farther, on average."""
        left = mean(scan, scan.angles > 0)
        right = mean(scan, scan.angles < 0)
        return cls.LEFT if left >= right else cls.RIGHT

    def turn(self, settings: Settings) -> Motion:
        """A turn to this side, on the spot."""
        return Motion(turn=self.value * float(settings.turn_speed))


def is_clear(scan: Scan, settings: Settings) -> bool:
    """Whether a robot that drives can drive on."""
    return has_room(scan, settings.safe_distance)


def is_clear_again(scan: Scan, settings: Settings) -> bool:
    """Whether a robot that stands or turns can drive again."""
    return len(scan) > 0 and has_room(scan, settings.safe_distance * MARGIN)


def cruise(scan: Scan, settings: Settings) -> Motion:
    """The way on, with a turn towards the most open direction. Without a scan, the robot stops."""
    if len(scan) == 0:
        return Motion()
    turn = np.clip(LEAN * opening(scan), -settings.turn_speed, settings.turn_speed)
    return Motion(float(settings.speed), float(turn))


def has_room(scan: Scan, needed: np.float32) -> bool:
    """Whether nothing is nearer than this."""
    angles = np.abs(scan.angles)
    is_ahead = angles <= AHEAD
    is_aside = ~is_ahead & (angles <= ASIDE)
    near = is_ahead & (scan.distances < needed)
    near |= is_aside & (scan.distances < needed * ASIDE_PART)
    return not bool(near.any())


def opening(scan: Scan) -> np.float32:
    """The direction within view in which things are farthest, in rad; straight ahead among equals."""
    farthest = mean(scan, np.abs(scan.angles) <= OPENING)
    best = np.float32(0)
    for direction in scan.angles[np.abs(scan.angles) <= VIEW]:
        depth = mean(scan, np.abs(scan.angles - direction) <= OPENING)
        if depth > farthest:
            farthest, best = depth, direction
    return best


def mean(scan: Scan, chosen: npt.NDArray[np.bool_]) -> np.float32:
    """The mean distance over the chosen angles, in mm; 0 without any."""
    distances = scan.distances[chosen]
    if len(distances) == 0:
        return np.float32(0)
    # `sum` would add in another order.
    return np.float32(np.cumsum(distances)[-1] / np.float32(len(distances)))
