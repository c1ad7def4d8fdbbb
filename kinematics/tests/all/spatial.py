# For each state of the input: the spatial velocity and acceleration of a frame, along its own axes, as Pinocchio computes
# them. Angular parts come first.
import json
import sys

import numpy
import pinocchio

case = json.load(sys.stdin)
model = pinocchio.buildModelFromXML(case["urdf"])
data = model.createData()
frame = model.getFrameId(case["frame"], pinocchio.FrameType.BODY)
order = [model.joints[model.getJointId(name)].idx_v for name in case["coordinates"]]
out = []
for state in case["states"]:
    q, v, a = (numpy.zeros(model.nv) for _ in range(3))
    q[order], v[order], a[order] = state
    pinocchio.forwardKinematics(model, data, q, v, a)
    velocity = pinocchio.getFrameVelocity(model, data, frame, pinocchio.ReferenceFrame.LOCAL)
    acceleration = pinocchio.getFrameAcceleration(model, data, frame, pinocchio.ReferenceFrame.LOCAL)
    out.append([*acceleration.angular, *acceleration.linear, *velocity.angular, *velocity.linear])
json.dump(out, sys.stdout)
