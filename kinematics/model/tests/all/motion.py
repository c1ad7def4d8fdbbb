# For each robot of the input: what Pinocchio gives for it in some states.
#
# Its joints that follow other ones move on their own here. The numbers of the script are those of the
# coordinates, over the matrix of the velocities of its joints for those of coordinates.
import json
import re
import sys

import numpy
import pinocchio


def turned(angles, rates):
    """The angular velocity in the body for rates of roll, pitch and yaw, as a matrix; and its rate."""
    (r, p, _), (dr, dp, _) = angles, rates
    sr, cr, sp, cp = numpy.sin(r), numpy.cos(r), numpy.sin(p), numpy.cos(p)
    matrix = [[1, 0, -sp], [0, cr, cp * sr], [0, -sr, cp * cr]]
    rate = [
        [0, 0, -cp * dp],
        [0, -sr * dr, -sp * sr * dp + cp * cr * dr],
        [0, -cr * dr, -sp * cr * dp - cp * sr * dr],
    ]
    return numpy.array(matrix), numpy.array(rate)


def skew(w):
    return numpy.array([[0, -w[2], w[1]], [w[2], 0, -w[0]], [-w[1], w[0], 0]])


def state_of(model, case, positions, velocities):
    """The positions of all joints, the matrix of their velocities, and its rate."""
    q = pinocchio.neutral(model)
    count = len(positions)
    motion, rate = numpy.zeros((model.nv, count)), numpy.zeros((model.nv, count))
    for name, at, ratio, offset in case["driven"]:
        joint = model.joints[model.getJointId(name)]
        value = ratio * positions[at] + offset
        if joint.nq == 2:  # a continuous joint: cosine and sine
            q[joint.idx_q : joint.idx_q + 2] = numpy.cos(value), numpy.sin(value)
        else:
            q[joint.idx_q] = value
        motion[joint.idx_v, at] = ratio
    for name, first, kind in case["several"]:
        joint = model.joints[model.getJointId(name)]
        own = slice(first, first + (6 if kind == "floating" else 3))
        p, v = numpy.array(positions[own]), numpy.array(velocities[own])
        rows = slice(joint.idx_v, joint.idx_v + joint.nv)
        if kind == "spherical":
            turn = pinocchio.rpy.rpyToMatrix(p)
            q[joint.idx_q : joint.idx_q + 4] = pinocchio.Quaternion(turn).coeffs()
            motion[rows, own], rate[rows, own] = turned(p, v)
        elif kind == "planar":
            c, s = numpy.cos(p[2]), numpy.sin(p[2])
            q[joint.idx_q : joint.idx_q + 4] = [p[0], p[1], c, s]
            motion[rows, own] = [[c, s, 0], [-s, c, 0], [0, 0, 1]]
            rate[rows, own] = v[2] * numpy.array([[-s, c, 0], [-c, -s, 0], [0, 0, 0]])
        else:
            turn = pinocchio.rpy.rpyToMatrix(p[3:])
            q[joint.idx_q : joint.idx_q + 3] = p[:3]
            q[joint.idx_q + 3 : joint.idx_q + 7] = pinocchio.Quaternion(turn).coeffs()
            spin, spin_rate = turned(p[3:], v[3:])
            nothing = numpy.zeros((3, 3))
            motion[rows, own] = numpy.block([[turn.T, nothing], [nothing, spin]])
            rate[rows, own] = numpy.block([[-skew(spin @ v[3:]) @ turn.T, nothing], [nothing, spin_rate]])
    return q, motion, rate


def frame(model, name):
    """Pinocchio returns a place behind its list for an unknown name."""
    at = model.getFrameId(name, pinocchio.FrameType.BODY)
    if at >= model.nframes:
        raise KeyError(name)
    return at


def built(text):
    """The model of a URDF. Pinocchio's reader knows no spherical joints, its models do."""
    joints = re.findall(r"<joint\b[^>]*>", text)
    names = [re.search(r'name="([^"]*)"', joint)[1] for joint in joints if 'type="spherical"' in joint]
    if not names:
        return pinocchio.buildModelFromXML(text)
    # Bullet's limits of these joints have other attributes.
    spherical = r'<joint\b[^>]*type="spherical".*?</joint>'
    text = re.sub(spherical, lambda joint: re.sub(r"<limit\b[^>]*/>", "", joint[0]), text, flags=re.S)
    read = pinocchio.buildModelFromXML(text.replace('type="spherical"', 'type="floating"'))
    model = pinocchio.Model()
    for at in range(1, read.njoints):
        old, name = read.joints[at], read.names[at]
        joint = pinocchio.JointModelSpherical() if name in names else old
        model.addJoint(read.parents[at], joint, read.jointPlacements[at], name)
        new = model.joints[at]
        if name not in names:
            places, others = slice(new.idx_q, new.idx_q + new.nq), slice(old.idx_q, old.idx_q + old.nq)
            for limit in ["lowerPositionLimit", "upperPositionLimit"]:
                limits = getattr(model, limit)
                limits[places] = getattr(read, limit)[others]
                setattr(model, limit, limits)
    for at in range(read.njoints):
        model.inertias[at] = read.inertias[at]
    for frame in list(read.frames)[1:]:
        model.addFrame(frame, False)
    return model


def facts(case):
    model = built(open(case["file"]).read() if "file" in case else case["urdf"])
    model.gravity.linear = numpy.array(case["gravity"])
    data = model.createData()
    limits = []
    for name in case["coordinates"]:
        joint = model.joints[model.getJointId(name)] if model.existJointName(name) else None
        if joint is not None and joint.nq == 1:
            limits.append([model.lowerPositionLimit[joint.idx_q], model.upperPositionLimit[joint.idx_q]])
        else:
            limits.append(None)
    states = []
    for state in case["states"]:
        q, motion, rate = state_of(model, case, state["positions"], state["velocities"])
        speeds = numpy.array(state["velocities"])
        v = motion @ speeds
        a = motion @ state["accelerations"] + rate @ speeds
        pinocchio.forwardKinematics(model, data, q, v, a)
        pinocchio.updateFramePlacements(model, data)
        pinocchio.computeJointJacobians(model, data, q)
        root = data.oMf[frame(model, case["root"])]
        frames = []
        for body in state["bodies"]:
            at = frame(model, body)
            kind = pinocchio.ReferenceFrame.LOCAL_WORLD_ALIGNED
            velocity = pinocchio.getFrameVelocity(model, data, at, kind)
            acceleration = pinocchio.getFrameClassicalAcceleration(model, data, at, kind)
            # Pinocchio has no memory for a Jacobian without columns.
            jacobian = pinocchio.getFrameJacobian(model, data, at, kind) if model.nv else numpy.zeros(0)
            jacobian = jacobian.reshape(6, model.nv) @ motion
            frames.append(
                {
                    "pose": (root.inverse() * data.oMf[at]).homogeneous.tolist(),
                    "velocity": [*velocity.linear, *velocity.angular],
                    "acceleration": [*acceleration.linear, *acceleration.angular],
                    "jacobian": jacobian.T.tolist(),
                }
            )
        mass = numpy.reshape(pinocchio.crba(model, data, q), (model.nv, model.nv))
        mass = numpy.triu(mass) + numpy.triu(mass, 1).T
        small = motion.T @ mass @ motion
        if case["is_weightless"]:
            accelerations = numpy.zeros(0)
        elif case["is_plain"]:
            accelerations = pinocchio.aba(model, data, q, v, motion @ state["accelerations"])
            accelerations = motion.T @ accelerations
        else:
            # The equation of motion of the coordinates, solved.
            bias = motion.T @ pinocchio.rnea(model, data, q, v, rate @ speeds)
            accelerations = numpy.linalg.solve(small, state["accelerations"] - bias) if len(small) else small
        states.append(
            {
                "accelerations": accelerations.tolist(),
                "frames": frames,
                "condition": numpy.linalg.cond(small) if len(small) and not case["is_weightless"] else 1.0,
                "efforts": (motion.T @ pinocchio.rnea(model, data, q, v, a)).tolist(),
                "mass": small.tolist(),
            }
        )
    return {"limits": limits, "mass": sum(inertia.mass for inertia in model.inertias), "states": states}


def refused(case):
    try:
        return facts(case)
    except Exception as error:
        return {"refused": str(error)}


cases = json.load(sys.stdin)
json.dump([refused(case) if "file" in case else facts(case) for case in cases], sys.stdout)
