"""Composes the transforms of a file with scipy, and compares them with those of a list.

Arguments: the file, the list (JSON: [[to, from, [16 numbers]], …], joints: {id: position}), and a
list of poses for the conversion to ROS."""

import json
import os
import sys
import xml.etree.ElementTree as xml

import numpy as np
from scipy.spatial.transform import Rotation

THREE = ("x", "y", "z")


def number(element, names):
    return next((float(element.get(name)) for name in names if element.get(name)), 0.0)


def local(element, scale, position):
    tag = element.tag.lower()
    matrix = np.eye(4)
    turn = ("", "r") if tag == "rotation" else ("r",)
    if tag in ("transform", "translation", "joint", "differentialrobot", "omnirobot", "mesh",
               "sphere", "cylinder", "cone"):
        matrix[:3, 3] = [number(element, ("t" + a, a, "t_" + a)) * scale for a in THREE]
    if tag in ("transform", "rotation", "joint", "differentialrobot", "omnirobot", "mesh",
               "sphere", "cylinder", "cone"):
        angles = [number(element, [p + a for p in turn] + ["r_" + a]) for a in THREE]
        matrix[:3, :3] = Rotation.from_euler("XYZ", angles).as_matrix()
    if tag == "joint":
        move = np.eye(4)
        axis = element.get("axis", "z").upper()
        move[:3, :3] = Rotation.from_euler(axis, position).as_matrix()
        matrix = matrix @ move
    if tag == "prismaticjoint":
        offset = number(element, ["offset"]) * scale
        matrix[THREE.index(element.get("axis", "z")), 3] = position + offset
    return matrix


def world(path, above, scale, joints, found):
    root = xml.parse(path).getroot()
    scale = {"metres": 1000.0, "millimetres": 1.0, None: scale}[root.get("units")]
    walk(root, os.path.dirname(path), above, scale, joints, found)


def walk(element, folder, above, scale, joints, found):
    for child in element:
        if child.tag.lower() == "include":
            world(os.path.join(folder, child.get("path")), above, scale, joints, found)
            continue
        here = above @ local(child, scale, joints.get(child.get("id"), 0.0))
        found[child.get("id")] = here
        walk(child, folder, here, scale, joints, found)


def main():
    path, given = sys.argv[1], json.load(open(sys.argv[2]))
    found = {"root": np.eye(4)}
    world(path, np.eye(4), 1.0, given["joints"], found)
    ids = {pair[0] for pair in given["pairs"]}
    assert ids == set(found), ids ^ set(found)
    assert len(given["pairs"]) == len(ids) ** 2
    inverse = {id: np.linalg.inv(matrix) for id, matrix in found.items()}
    for to, start, numbers in given["pairs"]:
        expected = inverse[to] @ found[start]
        actual = np.array(numbers).reshape(4, 4)
        # Relative to the numbers that are added up: a difference of two far places has their error.
        size = max(1.0, abs(found[to]).max(), abs(found[start]).max())
        assert abs(expected - actual).max() <= 1e-9 * size, (to, start, expected, actual)
    # To ROS by way of a change of basis: x front, y left, z up.
    basis = np.array([[0, 0, 1], [-1, 0, 0], [0, 1, 0]])
    for pose, ros in given["ros"]:
        turn = Rotation.from_euler("XYZ", pose[3:]).as_matrix()
        expected = Rotation.from_matrix(basis @ turn @ basis.T)
        assert (expected * Rotation.from_quat(ros[3:]).inv()).magnitude() < 1e-9, (pose, ros)
        assert abs(basis @ np.array(pose[:3]) / 1000 - ros[:3]).max() < 1e-9, (pose, ros)
    print(len(given["pairs"]))


main()
