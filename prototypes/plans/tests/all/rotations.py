"""Compares rotations with those of scipy: `rotations.py FILE`. Prints how many there were."""

import csv
import sys

import numpy
from scipy.spatial.transform import Rotation


def of(coordinate, numbers):
    if coordinate == "quaternion":
        return Rotation.from_quat(numbers)
    if coordinate == "rot_matrix":
        return Rotation.from_matrix(numpy.reshape(numbers, (3, 3)))
    if coordinate == "rpy":
        return Rotation.from_euler("xyz", numbers)
    if coordinate == "axis_angle":
        return Rotation.from_rotvec(numpy.array(numbers[:3]) * numbers[3])
    if coordinate == "rotation_vector":
        return Rotation.from_rotvec(numbers)
    _, axes, turns = coordinate.split("_")
    return Rotation.from_euler(axes.upper() if turns == "moving" else axes, numbers)


checked = 0
with open(sys.argv[1], newline="") as file:
    for coordinate, *words in csv.reader(file):
        numbers = [float(word) for word in words]
        expected = Rotation.from_quat(numbers[:4]).as_matrix()
        found = of(coordinate, numbers[4:]).as_matrix()
        error = numpy.abs(expected - found).max()
        assert error < 1e-12, (coordinate, numbers, error)
        checked += 1
print(checked)
