# For each robot of the input: what Pinocchio gives for it in some states.
import json
import sys

import numpy
import pinocchio


def facts(case):
    model = pinocchio.buildModelFromXML(case["urdf"], True)
    model.gravity.linear = numpy.array(case["gravity"])
    data = model.createData()
    names = case["coordinates"]

    def full(values, size, places):
        out = numpy.zeros(size)
        for name, value in zip(names, values):
            joint = model.joints[model.getJointId(name)]
            if joint.nq == 2:  # a continuous joint: cosine and sine
                out[joint.idx_q] = numpy.cos(value)
                out[joint.idx_q + 1] = numpy.sin(value)
            else:
                out[places(joint)] = value
        return out

    columns = [model.joints[model.getJointId(name)].idx_v for name in names]
    limits = []
    for name in names:
        joint = model.joints[model.getJointId(name)]
        if joint.nq == 1:
            limits.append([model.lowerPositionLimit[joint.idx_q], model.upperPositionLimit[joint.idx_q]])
        else:
            limits.append(None)
    states = []
    for state in case["states"]:
        q = full(state["positions"], model.nq, lambda joint: joint.idx_q)
        for name, value in zip(names, state["positions"]):
            joint = model.joints[model.getJointId(name)]
            if joint.nq == 2:
                q[joint.idx_q] = numpy.cos(value)
                q[joint.idx_q + 1] = numpy.sin(value)
        v, a = numpy.zeros(model.nv), numpy.zeros(model.nv)
        v[columns], a[columns] = state["velocities"], state["accelerations"]
        pinocchio.forwardKinematics(model, data, q, v, a)
        pinocchio.updateFramePlacements(model, data)
        pinocchio.computeJointJacobians(model, data, q)
        root = data.oMf[model.getFrameId(case["root"])]
        frames = []
        for body in case["bodies"]:
            at = model.getFrameId(body)
            kind = pinocchio.ReferenceFrame.LOCAL_WORLD_ALIGNED
            velocity = pinocchio.getFrameVelocity(model, data, at, kind)
            acceleration = pinocchio.getFrameClassicalAcceleration(model, data, at, kind)
            jacobian = pinocchio.getFrameJacobian(model, data, at, kind)[:, columns]
            frames.append(
                {
                    "pose": (root.inverse() * data.oMf[at]).homogeneous.tolist(),
                    "velocity": [*velocity.linear, *velocity.angular],
                    "acceleration": [*acceleration.linear, *acceleration.angular],
                    "jacobian": jacobian.T.tolist(),
                }
            )
        if "<mimic" in case["urdf"]:
            # Version 4.1 adds up other numbers for joints that follow. Each column by its efforts.
            still = numpy.zeros(model.nv)
            weight = pinocchio.rnea(model, data, q, still, still).copy()
            columns_of_mass = [pinocchio.rnea(model, data, q, still, unit) - weight for unit in numpy.eye(model.nv)]
            mass = numpy.array(columns_of_mass).T
        else:
            mass = pinocchio.crba(model, data, q)
            mass = numpy.triu(mass) + numpy.triu(mass, 1).T
        # The equation of motion, solved: aba knows no joints that follow in version 4.1.
        bias = pinocchio.nonLinearEffects(model, data, q, v)
        square = mass[numpy.ix_(columns, columns)]
        if "<mimic" in case["urdf"]:
            accelerations = numpy.linalg.solve(square, a[columns] - bias[columns])
        else:
            accelerations = pinocchio.aba(model, data, q, v, a)[columns]
        states.append(
            {
                "accelerations": accelerations.tolist(),
                "frames": frames,
                "efforts": pinocchio.rnea(model, data, q, v, a)[columns].tolist(),
                "mass": mass[numpy.ix_(columns, columns)].tolist(),
            }
        )
    return {"limits": limits, "mass": sum(inertia.mass for inertia in model.inertias), "states": states}


json.dump([facts(case) for case in json.load(sys.stdin)], sys.stdout)
