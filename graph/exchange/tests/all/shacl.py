"""Validates graphs with pyshacl. Prints the focus nodes of the violations of each, as a list of lists.

Argument: a file with `[[graph, shapes], …]`, all as Turtle.
"""

import json
import sys

import rdflib
from pyshacl import validate

known = {}


def parsed(text):
    return rdflib.Graph().parse(data=text, format="turtle")


def owner(graph, node):
    """The element to which a cell of a list belongs."""
    above = node
    while isinstance(node, rdflib.BNode) and above is not None:
        node, above = above, next(graph.subjects(None, above), None)
    return str(node)


def violations(data, shapes):
    if shapes not in known:
        known[shapes] = parsed(shapes)
    graph = parsed(data)
    conforms, report, _ = validate(graph, shacl_graph=known[shapes])
    nodes = sorted({owner(graph, node) for node in report.objects(None, rdflib.SH.focusNode)})
    assert conforms == (not nodes), nodes
    return nodes


with open(sys.argv[1], encoding="utf-8") as file:
    cases = json.load(file)
json.dump([violations(*case) for case in cases], sys.stdout)
