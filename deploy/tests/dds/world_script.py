"""Makes changes at random until there is a file `stop`. It writes down all that it sends before it sends it,
and at the end what it has, as `world_agent` does in Rust."""

import random
import struct
import time
from pathlib import Path

from robocomp._graph import World as Replica
from world_script import Context, Worker
from world_script.world import Near, Thing

# How many elements a world of these agents has at most, about.
MOST = 600


class SpecificWorker(Worker):
    def initialize(self, ctx: Context) -> None:
        self.folder = Path(ctx.params.folder)
        self.replica: Replica = ctx.g._replica
        # The name of a log is the writer, which the first message tells.
        self.writer = 0
        self.log = None
        self.digest = b""
        self.made = self.moved = 0
        self.due = 0.0
        # It has heard the others by then.
        self.begins = time.monotonic() + 3
        self.last = self.begins
        # What is sent is written down first.
        ctx._send_world = lambda: self.send(ctx)
        ctx.g._send = ctx._send_world

    def put(self, kind: bytes, data: bytes) -> None:
        self.log.write(kind + struct.pack("<I", len(data)) + data)

    def send(self, ctx: Context) -> None:
        state, stream = ctx._world_publishers
        for is_stream, topic, sample in self.replica.take():
            if self.log is None:
                # Each message begins with the schema and the writer, but for questions and answers.
                (self.writer,) = struct.unpack_from("<Q", sample, 0 if topic in (2, 3) else 8)
                self.log = open(self.folder / f"{self.writer}.log", "wb", buffering=0)
            if not is_stream and topic == 0:
                self.put(b"C", sample)
            if not is_stream and topic == 1:
                self.digest = sample
            ctx._link.publish_encoded(stream if is_stream else state, topic, sample)

    def compute(self, ctx: Context) -> None:
        now = time.monotonic()
        if now < self.begins or self.log is None or (self.folder / "stop").exists():
            self.last = now
            return
        self.due += (now - self.last) * ctx.params.rate
        self.last = now
        while self.due >= 1:
            self.due -= 1
            self.change(ctx)

    def change(self, ctx: Context) -> None:
        """A node, attributes, an edge, or a removal."""
        now = ctx.g.snapshot()
        things, nears = now.all(Thing), now.all(Near)
        is_full = len(things) + len(nears) > MOST
        what, streamed = random.randrange(100), None
        with ctx.g.change() as edit:
            if not things or what < 25 and not is_full:
                edit.add_thing(f"{self.writer}-{self.made}").x = random.randrange(10**6)
                self.made += 1
            elif what < 40 and not is_full:
                edit.add_edge("near", random.choice(things), random.choice(things))
            elif what < 44:
                edit.node(random.choice(things)).remove()
            elif what < 47 and nears:
                edit.edge(random.choice(nears)).remove()
            elif what < 52:
                edit.node(random.choice(things)).set("y", None)
            elif what < 65:
                # The next value of the stream of a node of its own.
                own = [thing for thing in things if thing.id.startswith(f"{self.writer}:")]
                if own:
                    self.moved += 1
                    streamed = random.choice(own).id, self.moved
                    edit.node(next(thing for thing in own if thing.id == streamed[0])).set("at", self.moved)
            else:
                for thing in random.choices(things, k=random.randint(1, 3)):
                    edit.node(thing).set(random.choice("xy"), random.randrange(10**6))
        if streamed:
            writer, count = map(int, streamed[0].split(":"))
            self.put(b"S", struct.pack("<QQq", writer, count, streamed[1]))

    def finalize(self, ctx: Context) -> None:
        self.replica.leave()
        self.send(ctx)
        if (self.folder / "stop").exists():
            (self.folder / f"{self.writer}.end").write_text(self.state(ctx))

    def digests(self) -> tuple[int, int]:
        """Those of the elements and of the streams in the last digest that it has sent."""
        at = 16
        (length,) = struct.unpack_from("<I", self.digest, at)
        at = -(-(at + 4 + length) // 4) * 4
        (count,) = struct.unpack_from("<I", self.digest, at)
        if count:
            at = -(-(at + 4) // 8) * 8 + 16 * count
        else:
            at += 4
        (count,) = struct.unpack_from("<I", self.digest, at)
        at = -(-(at + 4) // 8) * 8
        ranges = struct.unpack_from(f"<{count}Q", self.digest, at)
        (streams,) = struct.unpack_from("<Q", self.digest, at + 8 * count)
        return sum(ranges) & 0xFFFFFFFFFFFFFFFF, streams

    def state(self, ctx: Context) -> str:
        """Its content, line by line."""
        digest, streams = self.digests()
        lines = [f"D {digest:016x} {streams:016x}", "I in Python", f"H {self.digest.hex()}"]

        def values(element) -> str:
            return "".join(f" {name}={value}" for name, value in sorted(element.attributes().items()))

        graph = self.replica.snapshot()
        for node in graph.nodes():
            lines.append(f"N {node.id} {node.type}{values(node)}")
        for edge in graph.edges(None, None, None):
            ends = f"{edge.start.id} {edge.end.id}"
            lines.append(f"E {edge.id} {edge.type} {ends}{values(edge)}")
        return "\n".join(lines) + "\n"
