"""Prints poses, the last five first, as JSON: hear.py NETWORK COUNT [ADDRESS].

`rcdeploy status` shows the address of a bound slot; without one, it is the name of the interface.
"""

import json
import sys

import robocomp

network, count = sys.argv[1], int(sys.argv[2])
address = sys.argv[3] if len(sys.argv) > 3 else f"{network}/FullPoseEstimationPub"
topic = f"{address}/newFullPose"
poses = robocomp.Subscriber(robocomp.Network(network), topic, late=5)
print("ready", flush=True)
for header, body in poses.values(seconds=20):
    # struct FullPoseEuler { string source; float x, y, z, rx, ry, rz, vx, vy, vz, vrx, vry, vrz; int confidence; }
    pose = robocomp.Cdr(body)
    source, numbers, confidence = pose.get_text(), [pose.get("f") for _ in range(12)], pose.get("i")
    print(json.dumps([header.sequence, f"{header.type_hash:016x}", source, numbers[:2], confidence]), flush=True)
    count -= 1
    if count == 0:
        break
