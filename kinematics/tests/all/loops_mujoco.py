# For each case of the input: accelerations and forces of a robot at rest whose two frames stay together, as the equality
# constraints of MuJoCo give them. These are soft: a percent is missing.
import json
import sys

import mujoco
import numpy

# Without it, bodies behind fixed joints have no name.
OPTIONS = '<mujoco><compiler fusestatic="false" balanceinertia="false" strippath="false"/></mujoco></robot>'


def facts(case):
    spec = mujoco.MjSpec.from_string(case["urdf"].replace("</robot>", OPTIONS))
    for end in case["ends"]:
        spec.body(end).add_site(name=end)
    kind = mujoco.mjtEq.mjEQ_CONNECT if case["point"] else mujoco.mjtEq.mjEQ_WELD
    own = spec.add_equality(name="loop", type=kind, objtype=mujoco.mjtObj.mjOBJ_SITE)
    own.name1, own.name2 = case["ends"]
    own.solimp = [0.9999, 0.9999, 0.001, 0.5, 2]
    model = spec.compile()
    model.opt.gravity[:] = [0, 0, -9.80665]
    model.opt.tolerance, model.opt.iterations = 1e-14, 1000
    data = mujoco.MjData(model)
    joints = [model.joint(name) for name in case["coordinates"]]
    columns = [joint.dofadr[0] for joint in joints]
    data.qpos[[joint.qposadr[0] for joint in joints]] = case["positions"]
    data.qfrc_applied[columns] = case["efforts"]
    mujoco.mj_forward(model, data)
    places = [data.site(end) for end in case["ends"]]
    error = numpy.linalg.norm(places[0].xpos - places[1].xpos)
    if not case["point"]:
        error += numpy.linalg.norm(places[0].xmat - places[1].xmat)
    return {
        "accelerations": data.qacc[columns].tolist(),
        "efforts": data.qfrc_constraint[columns].tolist(),
        "error": float(error),
    }


json.dump([facts(case) for case in json.load(sys.stdin)], sys.stdout)
