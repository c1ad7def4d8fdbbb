# For each robot of the input: what MuJoCo gives for it in some states.
import json
import sys

import mujoco
import numpy

# Without it, bodies behind fixed joints have no name.
OPTIONS = '<mujoco><compiler fusestatic="false" balanceinertia="false" strippath="false"/></mujoco></robot>'


def facts(case):
    model = mujoco.MjModel.from_xml_string(case["urdf"].replace("</robot>", OPTIONS))
    model.opt.gravity[:] = case["gravity"]
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONSTRAINT | mujoco.mjtDisableBit.mjDSBL_CONTACT
    data = mujoco.MjData(model)
    joints = [model.joint(name) for name in case["coordinates"]]
    places, columns = [joint.qposadr[0] for joint in joints], [joint.dofadr[0] for joint in joints]
    states = []
    for state in case["states"]:
        data.qpos[places], data.qvel[columns] = state["positions"], state["velocities"]
        data.qacc[columns] = state["accelerations"]
        mujoco.mj_inverse(model, data)
        efforts = data.qfrc_inverse[columns].tolist()
        data.qfrc_applied[columns] = state["accelerations"]
        mujoco.mj_forward(model, data)
        mass = numpy.zeros((model.nv, model.nv))
        for column in range(model.nv):
            unit = numpy.zeros((1, model.nv))
            unit[0, column] = 1
            mujoco.mj_mulM(model, data, mass[column], unit[0])
        places_of_bodies = []
        for name in case["bodies"]:
            body = data.body(name)
            places_of_bodies.append([*body.xpos, *body.xmat])
        states.append(
            {
                "efforts": efforts,
                "mass": mass[numpy.ix_(columns, columns)].tolist(),
                "accelerations": data.qacc[columns].tolist(),
                "places": places_of_bodies,
            }
        )
    return states


json.dump([facts(case) for case in json.load(sys.stdin)], sys.stdout)
