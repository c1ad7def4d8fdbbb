"""Prints whether graphs are isomorphic to the first one, and whether they are with one end of an edge at its other end."""

import json
import sys

import networkx
from networkx.algorithms.isomorphism import categorical_multiedge_match, categorical_node_match


def made(graph):
    result = networkx.MultiDiGraph()
    for node, kind in graph["nodes"]:
        result.add_node(node, kind=kind)
    for start, end, kind in graph["edges"]:
        result.add_edge(start, end, kind=kind)
    return result


def same(graph):
    node, edge = (match("kind", None) for match in (categorical_node_match, categorical_multiedge_match))
    return networkx.is_isomorphic(first, made(graph), node_match=node, edge_match=edge)


with open(sys.argv[1]) as file:
    graphs = json.load(file)
first = made(graphs[0])
for graph in graphs:
    moved = next(edge for edge in graph["edges"] if edge[0] != edge[1])
    others = [edge for edge in graph["edges"] if edge is not moved]
    loop = [moved[0], moved[0], moved[2]]
    print(same(graph), same(graph | {"edges": [loop, *others]}))
