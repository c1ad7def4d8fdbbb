"""Compares distances of pairs of shapes with those of coal.

Argument: a list (JSON): [[shape, shape, pose, pose, distance], …] in millimetres; a shape is
[name, numbers…] or ["mesh", vertices, triangles], a pose 12 numbers: the rows of R, then t."""

import json
import sys

import coal
import numpy as np


def shape(of):
    if of[0] == "box":
        return coal.Box(*of[1:]), np.eye(3)
    if of[0] == "sphere":
        return coal.Sphere(of[1]), np.eye(3)
    # Their axis is z there, and y here: x stays, z goes to y.
    turn = np.array([[1, 0, 0], [0, 0, 1], [0, -1, 0]], dtype=float)
    if of[0] == "cylinder":
        return coal.Cylinder(*of[1:]), turn
    if of[0] == "cone":
        return coal.Cone(*of[1:]), turn
    mesh = coal.BVHModelOBBRSS()
    mesh.beginModel(len(of[2]), len(of[1]))
    corners = np.array(of[1], dtype=float)
    for a, b, c in of[2]:
        mesh.addTriangle(corners[a], corners[b], corners[c])
    mesh.endModel()
    return mesh, np.eye(3)


def main():
    far = touching = skipped = 0
    for one, other, p, q, measured in json.load(open(sys.argv[1])):
        objects = []
        for of, pose in ((one, p), (other, q)):
            body, turn = shape(of)
            place = coal.Transform3s()
            place.setRotation(np.array(pose[:9]).reshape(3, 3) @ turn)
            place.setTranslation(np.array(pose[9:]))
            objects += [body, place]
        result = coal.DistanceResult()
        expected = coal.distance(*objects, coal.DistanceRequest(), result)
        # Contact and a distance of almost nothing are not told apart.
        if abs(expected) < 1e-4 * 1000:
            skipped += 1
        elif expected > 0:
            far += 1
            assert abs(expected - measured) <= 1e-4 * max(1000, expected), (one, other, p, q, expected, measured)
        else:
            touching += 1
            assert measured == 0, (one, other, p, q, expected, measured)
    print(far, touching, skipped)
    assert far > 100 and touching > 50 and skipped < 20, (far, touching, skipped)


main()
