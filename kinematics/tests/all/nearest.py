# For each pose of the input: how near scipy brings the frame of an arm within its limits, from many beginnings. A
# metre counts as a radian. Argument: the library of the motion.
import ctypes
import json
import multiprocessing
import sys

import numpy
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

BEGINNINGS = 12

motion = ctypes.CDLL(sys.argv[1]).fk
case = json.load(sys.stdin)
lower, upper = numpy.array(case["limits"]).T
pose = numpy.zeros((4, 4))


def way(q, target):
    q = numpy.ascontiguousarray(q)
    motion(q.ctypes.data_as(ctypes.c_void_p), pose.ctypes.data_as(ctypes.c_void_p))
    turn = target[:3, :3] @ pose[:3, :3].T
    return numpy.concatenate([target[:3, 3] - pose[:3, 3], Rotation.from_matrix(turn).as_rotvec()])


random = numpy.random.default_rng(1)


def nearest(question):
    target, begins = question
    found = [least_squares(way, begin, bounds=(lower, upper), args=(target,), xtol=1e-12) for begin in begins]
    return min(float(numpy.linalg.norm(one.fun)) for one in found)


def begins():
    return lower + random.random((BEGINNINGS, len(lower))) * (upper - lower)


questions = [(numpy.array(one["target"]), begins()) for one in case["cases"]]
with multiprocessing.get_context("fork").Pool() as pool:
    json.dump(pool.map(nearest, questions, 1), sys.stdout)
