"""MuJoCo casts the same rays at the same mesh. Argument: the folder with ball.obj."""

import statistics
import sys
import time

import mujoco
import numpy as np

folder = sys.argv[1]
model = mujoco.MjModel.from_xml_string(
    f"""<mujoco><compiler meshdir="{folder}"/>
    <asset><mesh name="ball" file="ball.obj" inertia="shell"/></asset>
    <worldbody><geom type="mesh" mesh="ball"/></worldbody></mujoco>"""
)
data = mujoco.MjData(model)
mujoco.mj_forward(model, data)
rays = 10_000
angles = 0.3 - 0.6 * np.arange(rays) / (rays - 1)
ways = np.stack([np.sin(angles), np.zeros(rays), np.cos(angles)], 1).ravel()
start = np.array([0.0, 0.0, -3.0])
distances = np.zeros(rays)
bodies = np.zeros(rays, np.int32)
blocks = []
for _ in range(7):
    before = time.perf_counter()
    mujoco.mj_multiRay(
        model, data, start, ways, None, 1, -1, bodies, distances, rays, 90.0
    )
    blocks.append((time.perf_counter() - before) / rays)
# The rays run along edges of the mesh, where some slip through.
assert (distances > 1.9).sum() > 9_000, (distances > 1.9).sum()
faces = model.mesh_facenum[0]
print("| peer | measured |\n|---|---|")
print(f"| MuJoCo {mujoco.mj_versionString()}: a ray that meets a mesh of {faces:,} triangles | {statistics.median(blocks) * 1e9:.0f} ns |")
