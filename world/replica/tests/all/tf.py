"""Compares transforms at times of the past with those that scipy interpolates and composes. Argument: a JSON text with the
parents of frames, their poses by time, and the transforms that were read."""

import bisect
import json
import sys

import numpy
from scipy.spatial.transform import Rotation, Slerp

with open(sys.argv[1]) as file:
    told = json.load(file)


def moved(poses):
    """The times of a frame, its poses and their rotations."""
    times, poses = zip(*poses, strict=True)
    return times, poses, Rotation.from_euler("XYZ", [pose[3:] for pose in poses])


frames = {name: moved(poses) for name, poses in told["poses"].items()}


def in_parent(frame, time):
    """The homogeneous matrix of a frame in its parent."""
    times, poses, turns = frames[frame]
    after = bisect.bisect_right(times, time)
    matrix = numpy.eye(4)
    if after == len(times):
        matrix[:3, :3] = turns[after - 1].as_matrix()
        matrix[:3, 3] = poses[after - 1][:3]
        return matrix
    begin, end = times[after - 1], times[after]
    share = (time - begin) / (end - begin)
    matrix[:3, :3] = Slerp([0.0, 1.0], turns[[after - 1, after]])(share).as_matrix()
    matrix[:3, 3] = (1 - share) * numpy.array(poses[after - 1][:3]) + share * numpy.array(poses[after][:3])
    return matrix


def in_root(frame, time):
    matrix = numpy.eye(4)
    while frame in told["parents"]:
        matrix = in_parent(frame, time) @ matrix
        frame = told["parents"][frame]
    return matrix


worst = 0.0
for to, start, time, cells in told["reads"]:
    expected = numpy.linalg.inv(in_root(to, time)) @ in_root(start, time)
    found = numpy.array(cells)
    apart = numpy.abs(numpy.concatenate([expected[:3, :3].ravel(), expected[:3, 3]]) - found)
    worst = max(worst, apart.max() / max(1.0, numpy.abs(expected).max()))
count = len(told["reads"])
assert count and worst < 1e-11, (count, worst)
print(f"{count} transforms, the greatest difference is {worst:.1e} of the greatest number")
