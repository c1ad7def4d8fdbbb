"""Prints what grafeo answers to queries: rows, or a text that says why there are none."""

import json
import sys

from grafeo import GrafeoDB


def answer(world, text):
    db = GrafeoDB()
    nodes = []
    for kind, k, x, name in world["nodes"]:
        attributes = {"k": k, "x": x, "name": name}
        attributes = {name: value for name, value in attributes.items() if value is not None}
        nodes.append(db.create_node([kind], attributes).id)
    for kind, start, end, w in world["edges"]:
        db.create_edge(nodes[start], nodes[end], kind, {} if w is None else {"w": w})
    try:
        return [list(row.values()) for row in db.execute_cypher(text)]
    except Exception as error:
        return str(error)


with open(sys.argv[1]) as file:
    cases = json.load(file)
json.dump([answer(world, text) for world, text in cases], sys.stdout)
