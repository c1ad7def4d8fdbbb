# For each robot of the input: what MuJoCo gives for it in some states.
import json
import re
import sys

import mujoco
import numpy

# Without it, bodies behind fixed joints have no name.
OPTIONS = '<mujoco><compiler fusestatic="false" balanceinertia="false" strippath="false"/></mujoco></robot>'


# What is seen and touched has no mass here, and joints that follow are moved by the numbers of their leaders. It knows no other types.
LEFT = r"<(visual|collision|mimic|transmission|gazebo|material)\b(?:[^>]*/>|.*?</\1>)"


# It would write a file into the working directory: joints without a range are none of ours.
mujoco.set_mju_user_warning(lambda text: None)


def text_of(case):
    text = case["urdf"] if "urdf" in case else open(case["file"]).read()
    text = re.sub(r"<!--.*?-->", "", text, flags=re.S)
    return re.sub(LEFT, "", text, flags=re.S).replace("</robot>", OPTIONS)


def facts(case):
    model = mujoco.MjModel.from_xml_string(text_of(case))
    model.opt.gravity[:] = case["gravity"]
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONSTRAINT | mujoco.mjtDisableBit.mjDSBL_CONTACT
    # Joints have no friction here.
    model.dof_damping[:], model.dof_armature[:] = 0, 0
    data = mujoco.MjData(model)
    # The matrix from the numbers of coordinates to those of its joints, and offsets of positions.
    motion, offsets = numpy.zeros((model.nv, len(case["coordinates"]))), numpy.zeros(model.nq)
    for name, at, ratio, offset in case["driven"]:
        joint = model.joint(name)
        motion[joint.dofadr[0], at], offsets[joint.qposadr[0]] = ratio, offset
    if model.nq != model.nv or model.nv != len(case["driven"]):
        raise ValueError(f"{model.nv} joints, not {len(case['driven'])}")
    states = []
    for state in case["states"]:
        data.qpos[:], data.qvel[:] = motion @ state["positions"] + offsets, motion @ state["velocities"]
        data.qacc[:] = motion @ state["accelerations"]
        mujoco.mj_inverse(model, data)
        efforts = motion.T @ data.qfrc_inverse
        mass = numpy.zeros((model.nv, model.nv))
        for column in range(model.nv):
            unit = numpy.zeros((1, model.nv))
            unit[0, column] = 1
            mujoco.mj_mulM(model, data, mass[column], unit[0])
        mass = motion.T @ mass @ motion
        accelerations = numpy.zeros(0)
        if not case["is_weightless"] and len(mass) == model.nv:
            data.qfrc_applied[:] = motion @ state["accelerations"]
            mujoco.mj_forward(model, data)
            accelerations = motion.T @ data.qacc
        elif not case["is_weightless"]:
            # The equation of motion of the coordinates, solved.
            data.qacc[:] = 0
            mujoco.mj_inverse(model, data)
            bias = motion.T @ data.qfrc_inverse
            accelerations = numpy.linalg.solve(mass, state["accelerations"] - bias)
        places_of_bodies = []
        for name in case["bodies"]:
            body = data.body(name)
            places_of_bodies.append([*body.xpos, *body.xmat])
        states.append(
            {
                "efforts": efforts.tolist(),
                "mass": mass.tolist(),
                "accelerations": accelerations.tolist(),
                "condition": numpy.linalg.cond(mass) if len(accelerations) else 1.0,
                "places": places_of_bodies,
            }
        )
    return states


def refused(case):
    try:
        return facts(case)
    except ValueError as error:
        return {"refused": str(error)}


json.dump([refused(case) if "file" in case else facts(case) for case in json.load(sys.stdin)], sys.stdout)
