"""Pinocchio moves the same chains, and trimesh with embree casts the same rays.

Argument: the folder with chain7.urdf, chain30.urdf and ball.obj."""

import math
import statistics
import sys
import time

import numpy as np
import pinocchio
import trimesh

folder = sys.argv[1]
print("| peer | measured |\n|---|---|")
for links in (7, 30):
    model = pinocchio.buildModelFromUrdf(f"{folder}/chain{links}.urdf")
    data = model.createData()
    tip = model.getFrameId("tip", pinocchio.FrameType.BODY)
    angles = [np.full(links, n * 0.01) for n in range(100)]
    point = np.array([0.1, 0.2, 0.3])
    blocks = []
    for _ in range(21):
        start = time.perf_counter()
        for n in range(2000):
            pinocchio.forwardKinematics(model, data, angles[n % 100])
            pinocchio.updateFramePlacement(model, data, tip).act(point)
        blocks.append((time.perf_counter() - start) / 2000)
    ns = statistics.median(blocks) * 1e9
    print(f"| Pinocchio: all {links} joints move, and a point of the tip | {ns:.0f} ns, with its calls from Python |")

mesh = trimesh.load(f"{folder}/ball.obj")
n = np.arange(10_000)
t, p = n * 0.618, n * 2.399
start_points = np.stack([np.sin(t) * np.cos(p), np.cos(t), np.sin(t) * np.sin(p)], 1) * 3.0
targets = np.stack([np.sin(p), np.sin(t), np.full(n.shape, 0.3)], 1) * 0.3
engine = type(mesh.ray).__module__.rsplit(".", 1)[-1]
blocks = []
for _ in range(11):
    start = time.perf_counter()
    found = mesh.ray.intersects_first(start_points, targets - start_points)
    blocks.append(time.perf_counter() - start)
assert (found >= 0).sum() > 9_000, (found >= 0).sum()
print(f"| trimesh ({engine}): 10,000 rays against {len(mesh.faces):,} triangles | {statistics.median(blocks) * 1000:.1f} ms |")
assert math.isfinite(blocks[0])
