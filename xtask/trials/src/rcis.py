"""MuJoCo casts the same rays at the same mesh, and renders it by the processor. Argument: the folder with ball.obj."""

import os
import statistics
import sys
import time

# The software renderer of Mesa, on one thread as ours.
os.environ.update(MUJOCO_GL="egl", LIBGL_ALWAYS_SOFTWARE="1", LP_NUM_THREADS="0")

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

# RoboComp's view in the other simulators: a camera of 320 x 240 pixels with a focal length of 280, 3 m before the ball.
scene = mujoco.MjModel.from_xml_string(
    f"""<mujoco><compiler meshdir="{folder}"/>
    <asset><mesh name="ball" file="ball.obj" inertia="shell"/></asset>
    <worldbody><geom type="mesh" mesh="ball"/>
    <geom type="box" pos="0 -1.55 0" size="10 .05 10"/>
    <geom type="box" pos="0 0 9" size="10 2.5 .05"/><geom type="box" pos="0 0 -9" size="10 2.5 .05"/>
    <geom type="box" pos="9 0 0" size=".05 2.5 10"/><geom type="box" pos="-9 0 0" size=".05 2.5 10"/>
    <camera name="eye" pos="0 .3 -3" xyaxes="-1 0 0 0 1 0" fovy="46.397"/></worldbody></mujoco>"""
)
state = mujoco.MjData(scene)
mujoco.mj_forward(scene, state)
renderer = mujoco.Renderer(scene, 240, 320)


def picture(depth):
    """One picture, in ms."""
    if depth:
        renderer.enable_depth_rendering()
    else:
        renderer.disable_depth_rendering()
    blocks = []
    for _ in range(7):
        before = time.perf_counter()
        for _ in range(10):
            renderer.update_scene(state, "eye")
            image = renderer.render()
        blocks.append((time.perf_counter() - before) / 10)
    if depth:
        # The ball at its nearest, and the wall behind it.
        assert abs(image[120, 160] - (3 - (1 - 0.3**2) ** 0.5)) < 0.02, image[120, 160]
        assert abs(image[120, 10] - 11.95) < 0.1, image[120, 10]
    return statistics.median(blocks) * 1e3


depth, colours = picture(True), picture(False)
print(f"| the same: a depth image of 320 × 240 pixels of this mesh, by the processor (Mesa) | {depth:.2f} ms |")
print(f"| the same: depths and colours | {depth + colours:.2f} ms |")
core = statistics.median(blocks) * 1080 * 40 + (depth + colours) / 1e3 * 15
print(f"| the same: 1080 rays at 40 Hz, depths and colours at 15 Hz | {core * 100:.1f} % of a core |")
