"""Replays what the agents of a world wrote down, and compares it with what they had at the end.

The program knows nothing of replicas: it sorts all steps by their counts and writers, and lets the
last one win. `world_replay.py FOLDER AGENTS` prints one line, or what differs, with exit code 1.
"""

import pathlib
import struct
import sys

SIZES = {"B": 1, "I": 4, "Q": 8, "q": 8, "d": 8}


class Cdr:
    """Reads CDR, little endian, as the page of the protocol describes the messages."""

    def __init__(self, data):
        self.data = data
        self.at = 0

    def number(self, kind):
        size = SIZES[kind]
        self.at = -(-self.at // size) * size
        (value,) = struct.unpack_from("<" + kind, self.data, self.at)
        self.at += size
        return value

    def text(self):
        length = self.number("I")
        text = self.data[self.at : self.at + length - 1].decode()
        self.at += length
        return text

    def all(self, read):
        return [read() for _ in range(self.number("I"))]

    def key(self):
        return self.number("Q"), self.number("Q")

    def value(self):
        kind = self.number("B")
        ints = self.all(lambda: self.number("q"))
        self.all(lambda: self.number("d"))
        texts = self.all(self.text)
        self.all(lambda: self.number("B"))
        return None if kind == 0 else texts[0] if kind == 4 else ints[0]

    def step(self):
        step = {"what": self.number("B")}
        for name in ("count", "writer", "sequence"):
            step[name] = self.number("Q")
        step["name"] = self.text()
        step["of"] = self.key()
        step["to"] = self.key()
        step["value"] = self.value()
        return step

    def change(self):
        self.number("Q"), self.number("Q"), self.number("q")
        since, upto = self.number("Q"), self.number("Q")
        return since, upto, self.all(self.step)

    def seen(self):
        """The writers of a digest, with how many of their steps are known."""
        self.number("Q"), self.number("Q"), self.text()
        return dict(self.all(self.key))


def read_log(path):
    """The steps, the last sequence, and the last value of each stream. A killed one may end early."""
    data, at = path.read_bytes(), 0
    steps, last, streams = [], 0, {}
    while at + 5 <= len(data):
        kind, length = chr(data[at]), struct.unpack_from("<I", data, at + 1)[0]
        part = data[at + 5 : at + 5 + length]
        at += 5 + length
        if len(part) < length:
            break
        if kind == "C":
            _, upto, made = Cdr(part).change()
            steps += made
            last = max(last, upto)
        else:
            writer, count, value = struct.unpack("<QQq", part)
            streams[(writer, count)] = value
    return steps, last, streams


def read_end(path):
    end = {"nodes": {}, "edges": {}}
    for line in path.read_text().splitlines():
        kind, rest = line.split(" ", 1)
        words = rest.split(" ")
        if kind == "D":
            end["digests"] = rest
        elif kind == "I":
            end["info"] = rest
        elif kind == "H":
            end["seen"] = Cdr(bytes.fromhex(rest)).seen()
        else:
            ident = tuple(map(int, words[0].split(":")))
            plain = 2 if kind == "N" else 4
            values = dict(word.split("=", 1) for word in words[plain:])
            all_of = end["nodes" if kind == "N" else "edges"]
            all_of[ident] = (words[1:plain], values)
    return end


def replay(steps):
    """What a plain replay of the steps has."""
    made, ends, gone, values = {}, {}, set(), {}
    for step in sorted(steps, key=lambda s: (s["count"], s["writer"], s["sequence"])):
        of = (step["writer"], step["sequence"])
        match step["what"]:
            case 0:
                made[of] = step["name"]
            case 1:
                made[of] = step["name"]
                ends[of] = (step["of"], step["to"])
            case 2:
                values[(step["of"], step["name"])] = step["value"]
            case 3:
                gone.add(step["of"])
    attributes = {}
    for (of, name), value in values.items():
        if value is not None:
            attributes.setdefault(of, {})[name] = str(value)
    nodes, edges = {}, {}
    for of, kind in made.items():
        if of not in gone and of not in ends:
            nodes[of] = ([kind], attributes.get(of, {}))
    for of, (start, end) in ends.items():
        if of not in gone and start in nodes and end in nodes:
            names = [kind_of(start), kind_of(end)]
            edges[of] = ([made[of], *names], attributes.get(of, {}))
    return nodes, edges


def kind_of(ident):
    return f"{ident[0]}:{ident[1]}"


def main():
    folder = pathlib.Path(sys.argv[1])
    logs = {int(path.stem): read_log(path) for path in folder.glob("*.log")}
    ends = {int(path.stem): read_end(path) for path in folder.glob("*.end")}
    wrong = []
    if len(ends) != int(sys.argv[2]):
        wrong.append(f"{len(ends)} agents live, not {sys.argv[2]}")
    if len({end["digests"] for end in ends.values()}) != 1:
        wrong.append(f"digests differ: {[(w, e['digests'], e['info']) for w, e in ends.items()]}")
    first = next(iter(ends.values()))
    for writer, end in ends.items():
        for other in ends:
            known = end["seen"].get(other, 0)
            if known != logs[other][1]:
                wrong.append(f"{writer} has {known} of {logs[other][1]} steps of living {other}")
        for other, known in end["seen"].items():
            if known > logs.get(other, (0, known, 0))[1]:
                wrong.append(f"{writer} has {known} steps of {other}, which made fewer")
    steps = []
    for writer, (made, _, _) in logs.items():
        seen = first["seen"].get(writer, 0)
        steps += [step for step in made if step["sequence"] <= seen]
    nodes, edges = replay(steps)
    # The last value of the stream of an agent that lives; that of a killed one may be lost.
    for writer in ends:
        for of, value in logs[writer][2].items():
            if of in nodes:
                nodes[of][1]["at"] = str(value)
    for writer, end in ends.items():
        for name, own, theirs in (("node", nodes, end["nodes"]), ("edge", edges, end["edges"])):
            for of in own.keys() | theirs.keys():
                one, other = own.get(of), theirs.get(of)
                if one and other and of[0] not in ends:
                    one, other = ((k, {n: v for n, v in a.items() if n != "at"}) for k, a in (one, other))
                if one != other:
                    wrong.append(f"{name} {of} of {writer}: replayed {one}, is {other}")
    for line in wrong[:20]:
        print(line)
    killed = len(logs) - len(ends)
    print(
        f"{len(ends)} agents, {killed} killed: {len(steps)} steps, {len(nodes)} nodes, "
        f"{len(edges)} edges; {first['info']}"
    )
    sys.exit(1 if wrong else 0)


main()
