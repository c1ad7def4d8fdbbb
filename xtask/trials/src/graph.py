"""The peers of `cargo xtask bench graph`. Prints lines `NAME VALUE`.

Arguments: a file of DSR, and one of a random graph, `{"edges": [[from, to], …], "count": N}`, whose nodes
have `name` n0, n1, … and `x`.
"""

import json
import sys
import time


def best(rounds, calls, call):
    """The shortest time of one call, in seconds."""
    shortest = 1e9
    for _ in range(rounds):
        start = time.perf_counter()
        for _ in range(calls):
            call()
        shortest = min(shortest, (time.perf_counter() - start) / calls)
    return shortest


def load(path):
    with open(path, encoding="utf-8") as file:
        json.load(file)


def checked(rows, expected):
    rows = sorted(rows)
    assert rows == expected, f"{len(rows)} rows in place of {len(expected)}"


def with_networkx(graph, expected):
    import networkx

    peer = networkx.MultiDiGraph()
    for at in range(graph["count"]):
        peer.add_node(at, kind="thing", x=float(at), y=1.0, name=f"n{at}")
    for start, end in graph["edges"]:
        peer.add_edge(start, end, kind="to")

    def hops(node):
        rows = []
        for _, b, first in peer.out_edges(node, data=True):
            if first["kind"] == "to":
                for _, c, second in peer.out_edges(b, data=True):
                    if second["kind"] == "to":
                        rows.append(peer.nodes[c]["x"])
        return rows

    def found():
        rows = []
        for node, data in peer.nodes(data=True):
            if data["kind"] == "thing" and data["name"] == "n7":
                rows += hops(node)
        return rows

    def whole():
        return sum(sum(hops(node)) for node, data in peer.nodes(data=True) if data["kind"] == "thing")

    checked(found(), expected)
    print("networkx-found", best(15, 5, found))
    print("networkx-known", best(15, 50, lambda: hops(7)))
    print("networkx-whole", best(5, 1, whole))


BY_NAME = "MATCH (a:thing)-[:to]->(b:thing)-[:to]->(c:thing) WHERE a.name = $name RETURN c.x"
WHOLE = "MATCH (a:thing)-[:to]->(b:thing)-[:to]->(c:thing) RETURN sum(c.x) AS x"


def with_grafeo(graph, expected):
    from grafeo import GrafeoDB

    peer = GrafeoDB()
    nodes = []
    for at in range(graph["count"]):
        attributes = {"x": float(at), "y": 1.0, "name": f"n{at}"}
        nodes.append(peer.create_node(["thing"], attributes).id)
    for start, end in graph["edges"]:
        peer.create_edge(nodes[start], nodes[end], "to", {})
    peer.create_property_index("name")

    def by_name():
        # It keeps the plans of texts that it has seen.
        return [list(row.values())[0] for row in peer.execute_cypher(BY_NAME, {"name": "n7"})]

    checked(by_name(), expected)
    print("grafeo-name", best(15, 20, by_name))
    print("grafeo-whole", best(5, 1, lambda: list(peer.execute_cypher(WHOLE))))


def with_ladybug(graph, expected):
    import warnings

    import real_ladybug

    # Only the separate preparation is measured.
    warnings.simplefilter("ignore", DeprecationWarning)
    peer = real_ladybug.Connection(real_ladybug.Database(":memory:"))
    peer.execute("CREATE NODE TABLE thing(name STRING PRIMARY KEY, x DOUBLE, y DOUBLE)")
    peer.execute("CREATE REL TABLE `to`(FROM thing TO thing)")
    node = peer.prepare("CREATE (:thing {name: $name, x: $x, y: 1.0})")
    for at in range(graph["count"]):
        peer.execute(node, {"name": f"n{at}", "x": float(at)})
    edge = peer.prepare(
        "MATCH (a:thing {name: $from}), (b:thing {name: $to}) CREATE (a)-[:`to`]->(b)"
    )
    for start, end in graph["edges"]:
        peer.execute(edge, {"from": f"n{start}", "to": f"n{end}"})
    query = peer.prepare(BY_NAME.replace(":to", ":`to`"))
    whole = peer.prepare(WHOLE.replace(":to", ":`to`"))

    def by_name():
        return [row[0] for row in peer.execute(query, {"name": "n7"}).get_all()]

    checked(by_name(), expected)
    print("ladybug-name", best(15, 20, by_name))
    print("ladybug-whole", best(5, 1, lambda: peer.execute(whole).get_all()))


def with_loro(writes):
    from loro import ExportMode, LoroDoc

    def doc(peer):
        made = LoroDoc()
        made.peer_id = peer
        return made, made.get_map("attributes")

    def round_of(make):
        shortest = 1e9
        for _ in range(7):
            first, own = doc(1)
            second, other = doc(2)
            start = time.perf_counter()
            for at in range(writes):
                own.insert(f"n{at // 10}.a{at % 10}", float(at))
            first.commit()
            middle = time.perf_counter()
            other.insert("other", 1.0)
            second.commit()
            second.import_(first.export(ExportMode.Updates(second.oplog_vv)))
            end = time.perf_counter()
            assert other.get("n7.a0").value == 70.0
            shortest = min(shortest, make(start, middle, end))
        return shortest / writes

    print("loro-all", round_of(lambda start, _, end: end - start))
    print("loro-merge", round_of(lambda _, middle, end: end - middle))


def main():
    dsr, random = sys.argv[1:]
    print("json.load", best(15, 1, lambda: load(dsr)))
    with open(random, encoding="utf-8") as file:
        graph = json.load(file)
    expected = sorted(graph["expected"])
    with_networkx(graph, expected)
    with_grafeo(graph, expected)
    with_ladybug(graph, expected)
    with_loro(10_000)


main()
