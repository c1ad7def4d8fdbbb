"""Does the operations of a file to a MultiDiGraph, and prints what networkx says to each."""

import sys

import networkx

graph = networkx.MultiDiGraph()
saved = None


def listed(attributes):
    return " ".join(f"{name}={value}" for name, value in sorted(attributes.items()))


def printed():
    """The whole graph in one line."""
    nodes = (f"{node} {listed(graph.nodes[node])}" for node in sorted(graph))
    edges = sorted((key, start, end) for start, end, key in graph.edges(keys=True))
    edges = (
        f"{key} {start} {end} {listed(graph.edges[start, end, key])}"
        for key, start, end in edges
    )
    return "; ".join(nodes) + " | " + "; ".join(edges)


def neighbours(node):
    out = sorted((key, end) for _, end, key in graph.out_edges(node, keys=True))
    into = sorted((key, start) for start, _, key in graph.in_edges(node, keys=True))
    sides = [out, into]
    sides += [[(other,) for other in sorted(side(node))] for side in (graph.successors, graph.predecessors)]
    return " | ".join(",".join(":".join(map(str, item)) for item in side) for side in sides)


def step(what, arguments):
    global graph, saved
    match what:
        case "node":
            node, kind = arguments
            # networkx would change the attributes of the node that is there.
            if node in graph or any(key == node for _, _, key in graph.edges(keys=True)):
                return "there"
            graph.add_node(node, type=kind)
        case "edge":
            key, kind, start, end = arguments
            # networkx would make the nodes.
            graph.nodes[start], graph.nodes[end]
            if key in graph or any(known == key for _, _, known in graph.edges(keys=True)):
                return "there"
            graph.add_edge(start, end, key=key, type=kind)
        case "remove-node":
            graph.remove_node(*arguments)
        case "remove-edge":
            key, start, end = arguments
            graph.remove_edge(start, end, key=key)
        case "set-node":
            node, name, value = arguments
            graph.nodes[node][name] = value
        case "set-edge":
            key, start, end, name, value = arguments
            graph.edges[start, end, key][name] = value
        case "unset-node":
            node, name = arguments
            graph.nodes[node].pop(name, None)
        case "unset-edge":
            key, start, end, name = arguments
            graph.edges[start, end, key].pop(name, None)
        case "neighbours":
            return neighbours(*arguments)
        case "save":
            saved = graph.copy()
        case "back":
            graph = saved
        case "print":
            return printed()
        case _:
            raise ValueError(what)
    return "ok"


with open(sys.argv[1]) as operations:
    for line in operations:
        what, *arguments = line.split()
        arguments = [int(word) if word.isdigit() else word for word in arguments]
        try:
            said = step(what, arguments)
        except (networkx.NetworkXError, KeyError):
            said = "absent"
        print(said)
