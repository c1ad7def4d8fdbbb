"""Prints the time of the positions of an arm for each pose that `mink` or `pink` finds, in ns.

Arguments: which of them, a URDF, the frame of the poses, the frame that has them, a file of positions and their poses
(6 and 16 numbers in a line), the positions where each search begins, the greatest number of steps, and the rounds.

Both have the same loop: a `FrameTask` of equal costs and of some Levenberg-Marquardt damping, `solve_ik` by DAQP with
the limits that hold by default, and `integrate_inplace`. `dt` is 1 s: a step goes as far as the task asks, and pink's
limits of velocities are about half a turn.
"""

import statistics
import sys
import time
import xml.etree.ElementTree

import numpy

# Metres, and rad.
TOLERANCE = 1e-6
# Of 0, 0.001, 0.003, 0.01, 0.03, 0.1 and 1, both find the most poses with this one.
DAMPING = 0.03
DT = 1.0


def is_there(error):
    return numpy.linalg.norm(error[:3]) <= TOLERANCE and numpy.linalg.norm(error[3:]) <= TOLERANCE


def by_mink(urdf, base, tip, steps):
    """A function of positions that returns a pose, and the search."""
    import mink
    import mujoco

    # Without meshes, which MuJoCo does not find, and with all links.
    robot = xml.etree.ElementTree.parse(urdf).getroot()
    for link in robot.iter("link"):
        for shape in link.findall("visual") + link.findall("collision"):
            link.remove(shape)
    options = xml.etree.ElementTree.SubElement(robot, "mujoco")
    xml.etree.ElementTree.SubElement(options, "compiler", fusestatic="false")
    text = xml.etree.ElementTree.tostring(robot, encoding="unicode")
    configuration = mink.Configuration(mujoco.MjModel.from_xml_string(text))
    origin = configuration.get_transform_frame_to_world(base, "body")
    task = mink.FrameTask(tip, "body", position_cost=1.0, orientation_cost=1.0, lm_damping=DAMPING)

    def pose(positions):
        configuration.update(positions)
        return configuration.get_transform(tip, "body", base, "body").as_matrix()

    def search(wanted, start):
        task.set_target(origin @ mink.SE3.from_matrix(wanted))
        configuration.update(start)
        for _ in range(steps):
            try:
                velocity = mink.solve_ik(configuration, [task], DT, "daqp")
            except mink.NoSolutionFound:
                return None
            configuration.integrate_inplace(velocity, DT)
            if is_there(task.compute_error(configuration)):
                return configuration.q
        return None

    return pose, search


def by_pink(urdf, base, tip, steps):
    """A function of positions that returns a pose, and the search."""
    import pink
    import pinocchio

    model = pinocchio.buildModelFromUrdf(urdf)
    configuration = pink.Configuration(model, model.createData(), pinocchio.neutral(model))
    origin = configuration.get_transform_frame_to_world(base).copy()
    task = pink.FrameTask(tip, position_cost=1.0, orientation_cost=1.0, lm_damping=DAMPING)

    def pose(positions):
        configuration.update(positions)
        return configuration.get_transform(tip, base).homogeneous

    def search(wanted, start):
        task.set_target(origin * pinocchio.SE3(wanted))
        configuration.update(start)
        for _ in range(steps):
            try:
                velocity = pink.solve_ik(configuration, [task], DT, solver="daqp")
            except (pink.exceptions.NoSolutionFound, pink.exceptions.NotWithinConfigurationLimits):
                return None
            configuration.integrate_inplace(velocity, DT)
            if is_there(task.compute_error(configuration)):
                return configuration.q
        return None

    return pose, search


name, urdf, base, tip, file, start, steps, rounds = sys.argv[1:]
pose, search = {"mink": by_mink, "pink": by_pink}[name](urdf, base, tip, int(steps))
start = numpy.array([float(word) for word in start.split(",")])
for at, line in enumerate(numpy.loadtxt(file)):
    positions, wanted = line[:6], line[6:].reshape(4, 4)
    # Both have the robot of the file.
    assert numpy.allclose(pose(positions), wanted, atol=1e-9), (at, pose(positions), wanted)
    times = []
    for _ in range(int(rounds)):
        begin = time.perf_counter_ns()
        found = search(wanted, start)
        times.append(time.perf_counter_ns() - begin)
        if found is None:
            break
    else:
        assert numpy.allclose(pose(found.copy()), wanted, atol=2 * TOLERANCE), (at, found)
        print(f"pose_{at}", statistics.median(times))
