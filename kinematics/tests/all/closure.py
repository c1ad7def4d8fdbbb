# The greatest difference between poses that were wanted, and those of Pinocchio for the positions that were found.
import json
import sys

import numpy
import pinocchio

worst = 0.0
for case in json.load(sys.stdin):
    model = pinocchio.buildModelFromXML(case["urdf"])
    data = model.createData()
    for target, positions in case["answers"]:
        pinocchio.framesForwardKinematics(model, data, numpy.array(positions))
        root, tool = data.oMf[model.getFrameId("base")], data.oMf[model.getFrameId("tool")]
        worst = max(worst, abs((root.inverse() * tool).homogeneous - numpy.array(target)).max())
print(worst)
