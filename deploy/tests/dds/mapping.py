"""Computes by NumPy and SciPy, from a recording, what the others of the network `mapping` must see.

Arguments: a file with the recorded scans and one with the recorded clouds, both as `bag list --format json` prints
them, and one with the clouds that rclpy saw. Prints how many clouds of each are a scan that was converted.
"""

import json
import sys
from pathlib import Path

import numpy
from scipy.spatial.transform import Rotation

scans, clouds, seen = (Path(name).read_text().splitlines() for name in sys.argv[1:])

# Right, ahead, up as ahead, left, up: a quarter of a turn about z, to the right.
turn = Rotation.from_euler("z", -90, degrees=True)


def expected(line):
    points = json.loads(line)["value"]["points"]
    numbers = numpy.array([[point[name] for name in ("x", "y", "z", "intensity")] for point in points])
    assert numpy.abs(numbers[:, :2]).max() > 1000
    numbers[:, :3] = turn.apply(numbers[:, :3]) / 1000
    return numbers


def points(data):
    return numpy.frombuffer(data, "<f4").reshape(-1, 4)


def is_converted(cloud):
    """Within the rounding of float32."""
    return any(
        one.shape == cloud.shape and numpy.allclose(cloud, one, rtol=2**-23, atol=2**-23) for one in wanted
    )


wanted = [expected(line) for line in scans]
recorded = [points(bytes(json.loads(line)["value"]["data"])) for line in clouds]
heard = [points(bytes.fromhex(line)) for line in seen]
print(json.dumps({
    "scans": len(wanted),
    "recorded": [sum(map(is_converted, recorded)), len(recorded)],
    "heard": [sum(map(is_converted, heard)), len(heard)],
}))
