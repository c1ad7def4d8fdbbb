"""Prints the median time of all positions of a UR5 for a pose, in ns, by the package `ik-geo`: its Rust, called from Python."""

import statistics
import sys
import time

import ik_geo

RUNS, BLOCKS, STATES = (int(word) for word in sys.argv[1:])
arm = ik_geo.Robot.ur5()
# The positions of all programs.
states = [[((state * 6 + at) * 0.754877666 + 0.3) % 1.0 * 2.0 - 1.0 for at in range(6)] for state in range(STATES)]
poses = [arm.forward_kinematics(state) for state in states]
for state, pose in zip(states, poses):
    # One of them is the one that the pose is from.
    errors = [max(abs(a - b) for a, b in zip(found, state)) for found, _ in arm.get_ik(*pose)]
    assert min(errors) < 1e-6, (state, errors)
times = []
for _ in range(BLOCKS):
    start = time.perf_counter_ns()
    for run in range(RUNS):
        arm.get_ik(*poses[run % STATES])
    times.append((time.perf_counter_ns() - start) / RUNS)
print("reach", statistics.median(times))
