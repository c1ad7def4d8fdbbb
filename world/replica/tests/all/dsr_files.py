"""Makes the changes of a script in files of DSR, one after the other, and compares what several replicas have at the
end. Arguments: a JSON text with a list of the file, the script, and the files that the replicas print."""

import json
import sys


def listed(of):
    """What a file has by keys; some of them have an empty list for nothing."""
    return of if isinstance(of, dict) else {}


def value(attribute):
    kind, found = attribute["type"], attribute["value"]
    if kind in (1, 6, 7):
        return int(found)
    if kind in (2, 8):
        return float(found)
    return found


def attributes(of):
    return {name: value(attribute) for name, attribute in listed(of).items() if name != "name"}


# The attributes of `RT` as the oldest files name them.
OLDER = {"translation": "rt_translation", "rotation_euler_xyz": "rt_rotation_euler_xyz"}


def of_link(link):
    found = attributes(link["linkAttribute"])
    if link["label"] != "RT":
        return found
    return {name if OLDER.get(name, name) in found else OLDER.get(name, name): value for name, value in found.items()}


def read(path):
    """The nodes by their names: type and attributes; and the edges by their ends and labels."""
    with open(path) as file:
        symbols = listed(json.load(file)["DSRModel"]["symbols"])
    names = {str(node["id"]): node["name"] for node in symbols.values()}
    assert len(set(names.values())) == len(names), path
    nodes = {node["name"]: (node["type"], attributes(node["attribute"])) for node in symbols.values()}
    edges = {
        (node["name"], link["label"], names[str(link["dst"])]): of_link(link)
        for node in symbols.values()
        for link in node["links"]
    }
    return nodes, edges


def change(nodes, edges, step):
    what, *rest = step
    if what == "add":
        name, kind = rest
        nodes[name] = (kind, {})
    elif what == "set":
        name, attribute, new = rest
        nodes[name][1][attribute] = new
    elif what == "unset":
        name, attribute = rest
        nodes[name][1].pop(attribute, None)
    elif what == "remove":
        (name,) = rest
        del nodes[name]
        for ends in [ends for ends in edges if name in (ends[0], ends[2])]:
            del edges[ends]
    elif what == "link":
        edges[tuple(rest)] = {}
    elif what == "unlink":
        del edges[tuple(rest)]
    else:
        *ends, attribute, new = rest
        edges[tuple(ends)][attribute] = new


with open(sys.argv[1]) as file:
    cases = json.load(file)
steps = 0
for path, script, printed in cases:
    nodes, edges = read(path)
    for step in script:
        change(nodes, edges, step)
        steps += 1
    for found in map(read, printed):
        for name in nodes.keys() | found[0].keys():
            assert nodes.get(name) == found[0].get(name), (path, name, nodes.get(name), found[0].get(name))
        for ends in edges.keys() | found[1].keys():
            assert edges.get(ends) == found[1].get(ends), (path, ends, edges.get(ends), found[1].get(ends))
print(f"{len(cases)} files, {steps} changes: all replicas have what the script has")
