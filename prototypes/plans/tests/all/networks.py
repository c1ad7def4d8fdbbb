"""Compares the costs of plans with those of networkx: `networks.py FILE`. Prints how many there were."""

import csv
import sys

import networkx

graph = networkx.DiGraph()
checked = 0
with open(sys.argv[1], newline="") as file:
    for kind, one, other, cost in csv.reader(file):
        if kind == "edge":
            graph.add_edge(one, other, weight=int(cost))
            continue
        graph.add_nodes_from([one, other])
        try:
            expected = str(networkx.shortest_path_length(graph, one, other, weight="weight"))
        except networkx.NetworkXNoPath:
            expected = "none"
        assert cost == expected, (one, other, cost, expected)
        checked += 1
print(checked)
