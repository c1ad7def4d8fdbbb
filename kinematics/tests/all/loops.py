# For each case of the input: accelerations and forces of a robot whose two frames stay together, as Pinocchio
# computes them.
import json
import sys

import numpy
import pinocchio


def facts(case):
    model = pinocchio.buildModelFromXML(case["urdf"])
    model.gravity.linear = numpy.array([0, 0, -9.80665])
    data = model.createData()
    q, v, tau = pinocchio.neutral(model), numpy.zeros(model.nv), numpy.zeros(model.nv)
    columns = []
    for at, name in enumerate(case["coordinates"]):
        joint = model.joints[model.getJointId(name)]
        columns.append(joint.idx_v)
        value = case["positions"][at]
        if joint.nq == 2:
            q[joint.idx_q : joint.idx_q + 2] = numpy.cos(value), numpy.sin(value)
        else:
            q[joint.idx_q] = value
        v[joint.idx_v], tau[joint.idx_v] = case["velocities"][at], case["efforts"][at]
    frames = [model.frames[model.getFrameId(name, pinocchio.FrameType.BODY)] for name in case["ends"]]
    kind = pinocchio.ContactType.CONTACT_3D if case["point"] else pinocchio.ContactType.CONTACT_6D
    # The rows are along the axes of the first frame.
    contact = pinocchio.RigidConstraintModel(
        kind,
        model,
        frames[0].parentJoint,
        frames[0].placement,
        frames[1].parentJoint,
        frames[1].placement,
        pinocchio.ReferenceFrame.LOCAL,
    )
    contacts = pinocchio.StdVec_RigidConstraintModel()
    contacts.append(contact)
    known = pinocchio.StdVec_RigidConstraintData()
    known.append(contact.createData())
    settings = pinocchio.ProximalSettings(1e-14, 1e-10, 1000)
    pinocchio.initConstraintDynamics(model, data, contacts, known)
    accelerations = pinocchio.constraintDynamics(model, data, q, v, tau, contacts, known, settings)
    pinocchio.framesForwardKinematics(model, data, q)
    places = [data.oMf[model.getFrameId(name, pinocchio.FrameType.BODY)] for name in case["ends"]]
    between = places[0].actInv(places[1])
    error = numpy.linalg.norm(between.translation)
    if not case["point"]:
        error += numpy.linalg.norm(between.rotation - numpy.eye(3))
    force = known[0].contact_force
    numbers = force.linear if case["point"] else force.vector
    return {
        "accelerations": accelerations[columns].tolist(),
        "forces": (-numbers).tolist(),
        "error": float(error),
    }


json.dump([facts(case) for case in json.load(sys.stdin)], sys.stdout)
