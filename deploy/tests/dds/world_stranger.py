"""A replica of a world in plain Python, written by docs/protocol/world.md over the package `cyclonedds`
and nothing else: `world_stranger.py STATE STREAM HEARD_STATE HEARD_STREAM DOMAIN FOLDER RATE`, of which the
first ones are the addresses of `World` and `WorldStream` where it sends, and where it receives. It changes the world at random until FOLDER
has a file `stop`, writes down what it sends as the agents of the test do, and ends when its input does.
"""

import random
import select
import sys
import time
from dataclasses import dataclass
from pathlib import Path

from cyclonedds.core import Policy, Qos
from cyclonedds.domain import DomainParticipant
from cyclonedds.idl import IdlStruct
from cyclonedds.idl.annotations import final
from cyclonedds.idl.types import float64, int64, sequence, uint8, uint32, uint64
from cyclonedds.pub import DataWriter
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from cyclonedds.util import duration

RANGES, MOST_CHUNK, WINDOW, MOST = 64, 60 * 1024, 8, 600


@dataclass
@final
class Key(IdlStruct, typename="RcWorld.Key"):
    writer: uint64
    count: uint64


@dataclass
@final
class Value(IdlStruct, typename="RcWorld.Value"):
    kind: uint8
    ints: sequence[int64]
    floats: sequence[float64]
    texts: sequence[str]
    bytes: sequence[uint8]


@dataclass
@final
class Step(IdlStruct, typename="RcWorld.Step"):
    what: uint8
    count: uint64
    writer: uint64
    sequence: uint64
    name: str
    of: Key
    to: Key
    value: Value


@dataclass
@final
class Change(IdlStruct, typename="RcWorld.Change"):
    schema: uint64
    sender: uint64
    time: int64
    since: uint64
    upto: uint64
    steps: sequence[Step]


@dataclass
@final
class StreamValue(IdlStruct, typename="RcWorld.StreamValue"):
    of: Key
    name: str
    count: uint64
    writer: uint64
    value: Value


@dataclass
@final
class Samples(IdlStruct, typename="RcWorld.Samples"):
    schema: uint64
    sender: uint64
    time: int64
    values: sequence[StreamValue]


@dataclass
@final
class Digest(IdlStruct, typename="RcWorld.Digest"):
    schema: uint64
    sender: uint64
    name: str
    seen: sequence[Key]
    ranges: sequence[uint64]
    streams: uint64
    elements: uint64
    conflicts: uint32
    leaving: bool


@dataclass
@final
class Ask(IdlStruct, typename="RcWorld.Ask"):
    sender: uint64
    to: uint64
    number: uint64
    since: sequence[Key]
    ranges: sequence[uint32]
    chunks: sequence[uint32]


@dataclass
@final
class Chunk(IdlStruct, typename="RcWorld.Chunk"):
    sender: uint64
    to: uint64
    number: uint64
    at: uint32
    count: uint32
    bytes: sequence[uint8]


@dataclass
@final
class Answer(IdlStruct, typename="RcWorld.Answer"):
    sender: uint64
    seen: sequence[Key]
    since: sequence[Key]
    upto: sequence[Key]
    forgotten: sequence[Key]
    range: sequence[uint32]
    steps: sequence[Step]


@dataclass
@final
class Answers(IdlStruct, typename="RcWorld.Answers"):
    all: sequence[Answer]


@dataclass
@final
class WorldChange(IdlStruct, typename="RcWorld.World_change"):
    change: Change


@dataclass
@final
class WorldDigest(IdlStruct, typename="RcWorld.World_digest"):
    digest: Digest


@dataclass
@final
class WorldAsk(IdlStruct, typename="RcWorld.World_ask"):
    ask: Ask


@dataclass
@final
class WorldChunk(IdlStruct, typename="RcWorld.World_chunk"):
    chunk: Chunk


@dataclass
@final
class WorldSamples(IdlStruct, typename="RcWorld.WorldStream_samples"):
    samples: Samples


def cdr(value):
    """The bytes of a structure, without the header of a sample."""
    return value.serialize(use_version_2=False)[4:]


def keys(vector):
    return [Key(writer, count) for writer, count in sorted(vector.items())]


def vector(keys):
    return {key.writer: key.count for key in keys}


def fnv(data):
    value = 0xCBF29CE484222325
    for byte in data:
        value = (value ^ byte) * 0x100000001B3 & 0xFFFFFFFFFFFFFFFF
    return value


def number(value):
    return value.to_bytes(8, "little")


def text(value):
    return number(len(value.encode())) + value.encode()


def name_of(of):
    """An id as its 16 bytes: the count first."""
    return number(of[1]) + number(of[0])


def content(value):
    if value.kind == 0:
        return b"\0"
    if value.kind == 2:
        return b"\2" + value.ints[0].to_bytes(8, "little", signed=True)
    # No agent of this test has other values.
    return b"\4" + text(value.texts[0])


@dataclass
class Element:
    made: Step = None
    removed: Step = None
    attributes: dict = None


def stamp(step):
    return step.count, step.writer, step.sequence


def ends_of(element):
    """The ends of an edge; nothing for a node."""
    made = element.made
    return [(made.of.writer, made.of.count), (made.to.writer, made.to.count)] if made.what == 1 else []


def id_of(step):
    """The element that a step is about."""
    return (step.writer, step.sequence) if step.what < 2 else (step.of.writer, step.of.count)


class Replica:
    """What the page says that a replica has."""

    def __init__(self, writer):
        self.writer, self.count = writer, 0
        self.elements, self.seen, self.forgotten, self.waiting = {}, {}, {}, {}
        self.streams = {}

    def covers(self, of):
        return self.seen.get(of[0], 0) >= of[1]

    def is_removed(self, of):
        element = self.elements.get(of)
        return element.removed is not None if element else self.covers(of)

    def is_there(self, of):
        element = self.elements.get(of)
        return element is not None and element.made is not None and element.removed is None

    def put(self, step, own=False):
        of = id_of(step)
        self.count = max(self.count, step.count)
        if of not in self.elements and self.is_removed(of) and not (own and step.what < 2):
            return
        element = self.elements.setdefault(of, Element(attributes={}))
        if step.what < 2:
            element.made = step
        elif step.what == 3:
            if element.removed is None or stamp(step) < stamp(element.removed):
                element.removed = step
            element.attributes = {}
        elif element.removed is None:
            known = element.attributes.get(step.name)
            if known is None or stamp(known) < stamp(step):
                element.attributes[step.name] = step

    def change(self, change):
        """Takes a change; one behind a gap waits. Returns whether something is missing."""
        known = self.seen.get(change.sender, 0)
        if change.upto <= known:
            return False
        if change.since > known:
            self.waiting.setdefault(change.sender, {})[change.since] = change
            return True
        for step in change.steps:
            self.put(step)
        self.seen[change.sender] = change.upto
        self.follow()
        return False

    def follow(self):
        """Takes what waited for changes that are known by now."""
        for writer, all_of in list(self.waiting.items()):
            while ready := [since for since in all_of if since <= self.seen.get(writer, 0)]:
                change = all_of.pop(min(ready))
                if change.upto > self.seen.get(writer, 0):
                    for step in change.steps:
                        self.put(step)
                    self.seen[writer] = change.upto

    def answer(self, answer):
        since, upto = vector(answer.since), vector(answer.upto)
        is_part = bool(answer.range) and answer.range[1] > 1
        listed = {id_of(step) for step in answer.steps}
        for step in answer.steps:
            known = self.seen.get(step.writer, 0)
            if step.sequence <= known if is_part else since.get(step.writer, 0) <= known:
                self.put(step)
        if answer.range:
            at, count = answer.range
            for of in list(self.elements):
                is_gone = upto.get(of[0], 0) >= of[1] and of not in listed
                if is_gone and fnv(name_of(of)) % count == at:
                    del self.elements[of]
            for writer, count in vector(answer.forgotten).items():
                self.forgotten[writer] = max(self.forgotten.get(writer, 0), count)
        if not is_part:
            for writer, count in upto.items():
                known = self.seen.get(writer, 0)
                if known >= since.get(writer, 0):
                    self.seen[writer] = max(known, count)
        for of, element in list(self.elements.items()):
            if element.made is None and element.removed is None and self.covers(of):
                del self.elements[of]
        self.follow()

    def steps(self, wanted):
        parts = ([e.made, e.removed, *e.attributes.values()] for e in self.elements.values())
        return [step for all_of in parts for step in all_of if step is not None and wanted(step)]

    def answers(self, since, ranges):
        common, forgotten = (self.writer, keys(self.seen)), keys(self.forgotten)
        if ranges:
            return [
                Answer(*common, [], keys(self.seen), forgotten, [at, RANGES],
                       self.steps(lambda step, at=at: fnv(name_of(id_of(step))) % RANGES == at))
                for at in sorted(set(ranges))
            ]
        if any(since.get(writer, 0) < count for writer, count in self.forgotten.items()):
            return [Answer(*common, [], keys(self.seen), forgotten, [0, 1], self.steps(lambda _: True))]
        lacks = self.steps(lambda step: step.sequence > since.get(step.writer, 0))
        return [Answer(*common, keys(since), keys(self.seen), forgotten, [], lacks)]

    def ranges(self):
        sums = [0] * RANGES
        ends = {}

        def add(of, data):
            at = fnv(name_of(of)) % RANGES
            sums[at] = (sums[at] + fnv(name_of(of) + data)) & 0xFFFFFFFFFFFFFFFF

        for of, element in self.elements.items():
            if not self.is_there(of):
                continue
            made = element.made
            data = bytes([made.what]) + text(made.name)
            for end in ends_of(element):
                data += name_of(end)
                ends[end] = True
            data += b"".join(map(number, stamp(made)))
            for name in sorted(element.attributes, key=str.encode):
                step = element.attributes[name]
                data += text(name) + b"".join(map(number, stamp(step))) + content(step.value)
            add(of, data)
        for end in ends:
            if self.is_removed(end):
                add(end, b"\2")
        return sums

    def sample(self, sample):
        of = (sample.of.writer, sample.of.count)
        self.count = max(self.count, sample.count)
        known = self.streams.get((of, sample.name))
        if self.is_there(of) and (known is None or (known.count, known.writer) < (sample.count, sample.writer)):
            self.streams[(of, sample.name)] = sample

    def value(self, of, name):
        """The value that is shown: that of the stream, if no change is later."""
        step, sample = self.elements[of].attributes.get(name), self.streams.get((of, name))
        if sample and step and (step.count, step.writer) < (sample.count, sample.writer) and step.value.kind:
            return sample.value
        return step and step.value

    def stream_digest(self):
        total = 0
        for (of, name), sample in list(self.streams.items()):
            step = self.elements[of].attributes.get(name) if self.is_there(of) else None
            if step is None or (step.count, step.writer) >= (sample.count, sample.writer):
                del self.streams[(of, name)]
                continue
            numbers = map(number, (*of, sample.count, sample.writer))
            total = (total + fnv(b"".join(numbers) + name.encode())) & 0xFFFFFFFFFFFFFFFF
        return total

    def shown(self):
        """The nodes, and the edges whose both ends are shown."""
        there = {of: element for of, element in self.elements.items() if self.is_there(of)}
        nodes = {of: element for of, element in there.items() if element.made.what == 0}
        edges = {of: ends_of(e) for of, e in there.items() if e.made.what == 1}
        return nodes, {of: ends for of, ends in edges.items() if all(end in nodes for end in ends)}


class Stranger:
    def __init__(self, state, stream, heard_state, heard_stream, domain, folder, rate):
        self.folder, self.period = Path(folder), 1 / float(rate)
        self.random = random.Random()
        self.replica = Replica(self.random.getrandbits(63) | 1 << 62)
        self.schema = None
        self.peers, self.asked, self.number, self.kept, self.busy = {}, None, 0, {}, {}
        self.made, self.last_digest = 0, b""
        member = DomainParticipant(int(domain))

        def end(kind, name, of, reliable):
            qos = Qos(
                Policy.Reliability.Reliable(duration(seconds=1)) if reliable else Policy.Reliability.BestEffort,
                Policy.Durability.Volatile,
                Policy.History.KeepLast(256),
                Policy.DataRepresentation(use_cdrv0_representation=True),
            )
            return kind(member, Topic(member, name, of), qos)

        def ends(kind, state, stream):
            topics = {"change": WorldChange, "digest": WorldDigest, "ask": WorldAsk, "chunk": WorldChunk}
            all_of = {name: end(kind, f"{state}/{name}", of, True) for name, of in topics.items()}
            return all_of | {"samples": end(kind, f"{stream}/samples", WorldSamples, False)}

        self.readers = ends(DataReader, heard_state, heard_stream)
        self.writers = ends(DataWriter, state, stream)
        self.log = open(self.folder / f"{self.replica.writer}.log", "wb", buffering=0)

    def receive(self):
        for name, reader in self.readers.items():
            for sample in reader.take(N=200):
                if not sample.sample_info.valid_data:
                    continue
                value = getattr(sample, name)
                if value.sender != self.replica.writer:
                    getattr(self, f"take_{name}")(value)

    def take_change(self, change):
        if self.schema == change.schema and self.replica.change(change):
            self.peers.setdefault(change.sender, [{}, 0, []])[0][change.sender] = change.upto

    def take_samples(self, samples):
        for sample in samples.values:
            self.replica.sample(sample)

    def take_digest(self, digest):
        self.schema = self.schema or digest.schema
        if digest.leaving:
            self.peers.pop(digest.sender, None)
            return
        wrong = []
        if vector(digest.seen) == self.replica.seen:
            own = self.replica.ranges()
            wrong = [at for at, (one, other) in enumerate(zip(own, digest.ranges)) if one != other]
        self.peers[digest.sender] = [vector(digest.seen), time.monotonic(), wrong]

    def take_ask(self, ask):
        if ask.to != self.replica.writer:
            return
        kept = self.kept.get(ask.sender)
        if kept is None or kept[0] != ask.number:
            if ask.chunks:
                return
            data = cdr(Answers(self.replica.answers(vector(ask.since), ask.ranges)))
            kept = self.kept[ask.sender] = (ask.number, data)
        data = kept[1]
        count = max(1, -(-len(data) // MOST_CHUNK))
        for at in (ask.chunks or range(count))[:WINDOW]:
            if at < count:
                part = list(data[at * MOST_CHUNK : (at + 1) * MOST_CHUNK])
                self.writers["chunk"].write(WorldChunk(Chunk(self.replica.writer, ask.sender, ask.number, at, count, part)))

    def take_chunk(self, chunk):
        asked = self.asked
        if chunk.to != self.replica.writer or asked is None or [chunk.sender, chunk.number] != asked[:2]:
            return
        chunks = asked[2]
        if chunk.count == 0:
            self.asked, self.busy[chunk.sender] = None, time.monotonic() + 0.5
            return
        chunks[chunk.at] = bytes(chunk.bytes)
        asked[3] = time.monotonic()
        if len(chunks) == chunk.count:
            self.asked = None
            whole = b"".join(chunks[at] for at in range(chunk.count))
            for answer in Answers.deserialize(b"\0\1\0\0" + whole).all:
                self.replica.answer(answer)
        elif len(chunks) % WINDOW == 0:
            missing = [at for at in range(chunk.count) if at not in chunks]
            self.ask(chunk.sender, chunk.number, asked[4], asked[5], missing[:WINDOW])

    def ask(self, to, number, since, ranges, chunks=()):
        self.writers["ask"].write(WorldAsk(Ask(self.replica.writer, to, number, keys(since), ranges, list(chunks))))

    def look(self):
        """Asks one of those that have more."""
        now = time.monotonic()
        if self.asked and now - self.asked[3] < 0.5:
            return
        seen = self.replica.seen
        is_live = lambda peer, of: now - of[1] < 5 and now >= self.busy.get(peer, 0)
        live = {peer: of for peer, of in self.peers.items() if is_live(peer, of)}
        lacks = lambda known: any(count > seen.get(writer, 0) for writer, count in known.items())
        having = [(peer, []) for peer, of in live.items() if lacks(of[0])]
        having = having or [(peer, of[2]) for peer, of in live.items() if of[2]]
        self.asked = None
        if having:
            to, ranges = self.random.choice(having)
            self.number += 1
            self.asked = [to, self.number, {}, now, dict(seen), ranges]
            self.ask(to, self.number, seen, ranges)

    def tell(self, leaving=False):
        if self.schema is None:
            return
        nodes, edges = self.replica.shown()
        there = sum(map(self.replica.is_there, self.replica.elements))
        digest = Digest(
            self.schema, self.replica.writer, "stranger", keys(self.replica.seen), self.replica.ranges(),
            self.replica.stream_digest(), there, there - len(nodes) - len(edges), leaving,
        )
        self.last_digest = cdr(digest)
        self.writers["digest"].write(WorldDigest(digest))

    def step(self, what, name="", of=(0, 0), to=(0, 0), value=None):
        replica = self.replica
        replica.count += 1
        sequence = replica.seen.get(replica.writer, 0) + 1
        ints, texts = [value] * isinstance(value, int), [value] * isinstance(value, str)
        held = Value(2 if ints else 4 if texts else 0, ints, [], texts, [])
        step = Step(what, replica.count, replica.writer, sequence, name, Key(*of), Key(*to), held)
        replica.seen[replica.writer] = sequence
        replica.put(step, own=True)
        return step

    def change(self):
        """A node, an attribute, an edge, or a removal."""
        replica, pick = self.replica, self.random
        nodes, edges = replica.shown()
        since = replica.seen.get(replica.writer, 0)
        what, steps = pick.random(), []
        any_node = lambda: pick.choice(list(nodes))
        if what < 0.25 and len(nodes) + len(edges) < MOST or not nodes:
            steps.append(self.step(0, "thing"))
            made = id_of(steps[0])
            steps.append(self.step(2, "name", made, value=f"{replica.writer}-{self.made}"))
            steps.append(self.step(2, "x", made, value=pick.randrange(10**6)))
            self.made += 1
        elif what < 0.4 and len(nodes) + len(edges) < MOST:
            steps.append(self.step(1, "near", any_node(), any_node()))
        elif what < 0.44:
            gone = any_node()
            for edge, ends in edges.items():
                if gone in ends:
                    steps.append(self.step(3, of=edge))
            steps.append(self.step(3, of=gone))
        else:
            steps.append(self.step(2, pick.choice("xy"), any_node(), value=pick.randrange(10**6)))
        self.send(since, steps)

    def tidy(self):
        """Removes its edges of which others have removed an end."""
        replica, gone = self.replica, []
        for of, element in replica.elements.items():
            is_own = of[0] == replica.writer and replica.is_there(of)
            if is_own and any(map(replica.is_removed, ends_of(element))):
                gone.append(of)
        if gone:
            since = replica.seen.get(replica.writer, 0)
            self.send(since, [self.step(3, of=of) for of in gone])

    def send(self, since, steps):
        replica = self.replica
        upto = replica.seen[replica.writer]
        change = Change(self.schema, replica.writer, time.time_ns(), since, upto, steps)
        data = cdr(change)
        self.log.write(b"C" + len(data).to_bytes(4, "little") + data)
        self.writers["change"].write(WorldChange(change))

    def run(self):
        started = time.monotonic()
        told = due = started
        print("ready", flush=True)
        while not select.select([sys.stdin], [], [], 0.01)[0]:
            now = time.monotonic()
            self.receive()
            if now >= told + 1:
                told = now
                self.tidy()
                self.tell()
            self.look()
            is_busy = self.schema and now > started + 2.5 and not (self.folder / "stop").exists()
            while is_busy and now >= due:
                due = max(due + self.period, now - 1)
                self.change()
        self.tell(leaving=True)
        self.end()
        time.sleep(0.5)

    def end(self):
        """What it has, as the agents write it."""
        replica = self.replica
        nodes, edges = replica.shown()
        digest = sum(replica.ranges()) & 0xFFFFFFFFFFFFFFFF
        lines = [f"D {digest:016x} {replica.stream_digest():016x}", "I a stranger", f"H {self.last_digest.hex()}"]
        show = lambda of: f"{of[0]}:{of[1]}"

        def values(of):
            all_of = {name: replica.value(of, name) for name in replica.elements[of].attributes}
            texts = {name: v.ints[0] if v.kind == 2 else v.texts[0] for name, v in all_of.items() if v.kind}
            return "".join(f" {name}={value}" for name, value in sorted(texts.items()))

        for of in nodes:
            lines.append(f"N {show(of)} thing{values(of)}")
        for of, (start, end) in edges.items():
            lines.append(f"E {show(of)} near {show(start)} {show(end)}{values(of)}")
        (self.folder / f"{replica.writer}.end").write_text("\n".join(lines) + "\n")


Stranger(*sys.argv[1:8]).run()
