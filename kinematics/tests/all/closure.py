# The greatest difference between poses that were wanted, and those of Pinocchio for the positions that were found.
import json
import sys

import numpy
import pinocchio

worst = 0.0
for case in json.load(sys.stdin):
    model = pinocchio.buildModelFromXML(case["urdf"])
    data = model.createData()
    joints = [model.joints[model.getJointId(name)] for name in case["coordinates"]]
    root, tool = (model.getFrameId(name, pinocchio.FrameType.BODY) for name in ("base", "tool"))
    for target, positions in case["answers"]:
        q = pinocchio.neutral(model)
        for joint, value in zip(joints, positions):
            if joint.nq == 2:  # a continuous joint: cosine and sine
                q[joint.idx_q : joint.idx_q + 2] = numpy.cos(value), numpy.sin(value)
            else:
                q[joint.idx_q] = value
        pinocchio.framesForwardKinematics(model, data, q)
        worst = max(worst, abs((data.oMf[root].inverse() * data.oMf[tool]).homogeneous - numpy.array(target)).max())
print(worst)
