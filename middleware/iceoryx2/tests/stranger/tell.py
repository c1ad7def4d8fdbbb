"""Publishes poses on a circle: tell.py NETWORK COUNT. One number is left out, as if a value had been lost."""

import math
import sys

import robocomp

network, count = sys.argv[1], int(sys.argv[2])
poses = robocomp.Publisher(robocomp.Network(network), f"{network}/FullPoseEstimationPub/newFullPose")
for number in range(count):
    x, y = 1000 * math.cos(number / 10), 1000 * math.sin(number / 10)
    pose = robocomp.Cdr().put_text("Python").put(12 * "f", x, y, *10 * [0]).put("i", 100)
    if number == count // 2:
        poses.sequence += 1
    poses.publish(pose.data)
poses.linger()
