# For each robot of the input: where KDL has its links, and their Jacobians, in some states.
import json
import sys
import xml.etree.ElementTree as xml

import PyKDL as kdl


def numbers(element, name, other):
    text = element.get(name) if element is not None else None
    return [float(part) for part in (text or other).split()]


def joints(text):
    found = {}
    for joint in xml.fromstring(text).findall("joint"):
        origin = joint.find("origin")
        place = kdl.Frame(kdl.Rotation.RPY(*numbers(origin, "rpy", "0 0 0")), kdl.Vector(*numbers(origin, "xyz", "0 0 0")))
        axis = kdl.Vector(*numbers(joint.find("axis"), "xyz", "1 0 0"))
        found[joint.find("child").get("link")] = (joint, joint.find("parent").get("link"), place, axis)
    return found


def chain(tree, link):
    links = []
    while link in tree:
        links.append(link)
        link = tree[link][1]
    whole, names = kdl.Chain(), []
    for link in reversed(links):
        joint, _, place, axis = tree[link]
        name, kind = joint.get("name"), joint.get("type")
        if kind == "fixed":
            own = kdl.Joint(name, kdl.Joint.Fixed)
        else:
            how = kdl.Joint.TransAxis if kind == "prismatic" else kdl.Joint.RotAxis
            own = kdl.Joint(name, place.p, place.M * axis, how)
            names.append(name)
        whole.addSegment(kdl.Segment(link, own, place))
    return whole, names


def facts(case):
    tree = joints(case["urdf"])
    chains = [chain(tree, link) for link in case["links"]]
    states = []
    for positions in case["states"]:
        known = dict(zip(case["coordinates"], positions))
        moved = []
        for whole, names in chains:
            at, frame, jacobian = kdl.JntArray(len(names)), kdl.Frame(), kdl.Jacobian(len(names))
            for place, name in enumerate(names):
                at[place] = known[name]
            assert kdl.ChainFkSolverPos_recursive(whole).JntToCart(at, frame) >= 0
            rows = [[0.0] * len(known) for _ in range(6)]
            if names:
                assert kdl.ChainJntToJacSolver(whole).JntToJac(at, jacobian) >= 0
            for place, name in enumerate(names):
                for row in range(6):
                    rows[row][case["coordinates"].index(name)] = jacobian[row, place]
            moved.append(
                {
                    "place": [frame.p[0], frame.p[1], frame.p[2]],
                    "rotation": [frame.M[row, column] for row in range(3) for column in range(3)],
                    "jacobian": rows,
                }
            )
        states.append(moved)
    return states


json.dump([facts(case) for case in json.load(sys.stdin)], sys.stdout)
