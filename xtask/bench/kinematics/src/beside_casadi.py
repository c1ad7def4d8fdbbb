"""Writes CasADi's C of the pose and the Jacobian of a frame. Arguments: a URDF, the name of the frame, the file."""

import pathlib
import sys

import casadi
import numpy
import pinocchio

urdf, tip, out = sys.argv[1:]
model = pinocchio.buildModelFromUrdf(urdf)
frame = model.frames[model.getFrameId(tip, pinocchio.FrameType.BODY)]
q = casadi.SX.sym("q", model.nq)
turn, place = casadi.SX.eye(3), casadi.SX.zeros(3)
axes, points = [], []
for joint in range(1, model.njoints):
    fixed = model.jointPlacements[joint]
    place = place + turn @ casadi.DM(fixed.translation)
    turn = turn @ casadi.DM(fixed.rotation)
    kind = model.joints[joint].shortname()
    assert kind in ("JointModelRX", "JointModelRY", "JointModelRZ"), kind
    at = "XYZ".index(kind[-1])
    sine, cosine = casadi.sin(q[joint - 1]), casadi.cos(q[joint - 1])
    own = casadi.SX.eye(3)
    first, second = (at + 1) % 3, (at + 2) % 3
    own[first, first] = own[second, second] = cosine
    own[first, second], own[second, first] = -sine, sine
    turn = turn @ own
    axes.append(turn[:, at])
    points.append(place)
place = place + turn @ casadi.DM(frame.placement.translation)
turn = turn @ casadi.DM(frame.placement.rotation)
columns = [casadi.vertcat(casadi.cross(axis, place - point), axis) for axis, point in zip(axes, points)]
function = casadi.Function("casadi_fk", [q], [turn, place, casadi.densify(casadi.horzcat(*columns))])

# The function is the one that is measured.
at = numpy.linspace(-1.0, 1.0, model.nq)
data = model.createData()
pinocchio.framesForwardKinematics(model, data, at)
moved = pinocchio.computeFrameJacobian(model, data, at, model.getFrameId(tip), pinocchio.LOCAL_WORLD_ALIGNED)
pose = data.oMf[model.getFrameId(tip)]
for found, wanted in zip(function(at), (pose.rotation, pose.translation, moved)):
    assert numpy.allclose(numpy.array(found).squeeze(), wanted, atol=1e-9)
path = pathlib.Path(out)
generator = casadi.CodeGenerator(path.name)
generator.add(function)
generator.generate(f"{path.parent}/")
print("work", max(1, function.sz_w()))
