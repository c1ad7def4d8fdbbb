"""Prints mass, centre of mass, inertia about it, and poses of links, as Pinocchio computes them.

The root moves freely, so that its own mass counts, and stands at the origin of the world.
"""

import json
import sys

import numpy
import pinocchio

results = []
for case in json.load(sys.stdin):
    model = pinocchio.buildModelFromXML(case["urdf"], pinocchio.JointModelFreeFlyer())
    data = model.createData()
    q = pinocchio.neutral(model)
    for name, position in case["positions"]:
        q[model.joints[model.getJointId(name)].idx_q] = position
    pinocchio.framesForwardKinematics(model, data, q)
    pinocchio.ccrba(model, data, q, numpy.zeros(model.nv))
    centre = pinocchio.centerOfMass(model, data, q)
    numbers = [data.Ig.mass, *centre, *data.Ig.inertia.flatten()]
    for to, start in case["pairs"]:
        to, start = (data.oMf[model.getFrameId(name, pinocchio.FrameType.BODY)] for name in (to, start))
        between = to.inverse() * start
        numbers += [*between.translation, *between.rotation.flatten()]
    results.append(numbers)
json.dump(results, sys.stdout)
