"""Compares transforms with those that scipy composes along the edges of trees."""

import json
import sys

import numpy
from scipy.spatial.transform import Rotation

with open(sys.argv[1]) as file:
    graphs = json.load(file)
count, worst = 0, 0.0
for graph in graphs:
    above = {end: (start, place, turn) for start, end, place, turn in graph["edges"]}

    def in_root(node):
        """The root above a node, and the homogeneous matrix of the node in it."""
        matrix = numpy.eye(4)
        while node in above:
            node, place, turn = above[node]
            step = numpy.eye(4)
            step[:3, :3] = Rotation.from_euler("XYZ", turn).as_matrix()
            step[:3, 3] = place
            matrix = step @ matrix
        return node, matrix

    known = {}
    for to, start, cells in graph["pairs"]:
        for node in (to, start):
            if node not in known:
                known[node] = in_root(node)
        (root, left), (other, right) = known[to], known[start]
        assert root == other, (to, start)
        expected = numpy.linalg.inv(left) @ right
        size = max(1.0, numpy.abs(expected).max(), numpy.abs(left).max(), numpy.abs(right).max())
        found = numpy.array(cells)
        apart = numpy.abs(numpy.concatenate([expected[:3, :3].ravel(), expected[:3, 3]]) - found)
        worst = max(worst, apart.max() / size)
        count += 1
assert count and worst < 1e-12, (count, worst)
print(f"{count} transforms, the greatest difference is {worst:.1e} of the greatest number")
