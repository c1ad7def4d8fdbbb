"""Simulates networks of components event by event, and compares `rcdeploy plan` with the simulation.

Usage: bounds.py RCDEPLOY FOLDER SCHEDULES [SEED]

Each network is written as .idsl, .cdsl and .ddsl files, of which rcdeploy computes the worst case of
a chain: its longest time, and the oldest data in an effect. The simulation knows no formula. It runs
each component as one thread: messages wait in the queues of its ports, handlers run in turn, and
`compute` runs after them once a period. Phases, run times and times on the way are random. A bound
must never be below what any schedule shows; those of the named networks must also be near it, and with
10^6 schedules those of all.

Times are integers in microseconds.
"""

import json
import os
import random
import subprocess
import sys
from collections import deque
from concurrent.futures import ProcessPoolExecutor
from heapq import heappop, heappush

MS = 1000
# The transport that rcdeploy assumes within a machine.
TRANSPORT = {"iceoryx2": 200, "dds": 1 * MS}
DEPTH = 10
TURN = 64
# No handler begins later in a turn.
TURN_TIME = 100 * MS
TICK, ARRIVAL, END = range(3)
COMPUTE = -1


class Handler:
    """A handler: its longest run, whether `compute` uses its messages, and its receivers."""

    def __init__(self, budget, kept=False, sends=()):
        self.budget, self.kept, self.sends = budget, kept, list(sends)


class Node:
    """A component. `sends`: the receivers of what `compute` sends, each a node and a handler."""

    def __init__(self, period, compute, sends=(), handlers=()):
        self.period, self.compute = period, compute
        self.sends, self.handlers = list(sends), list(handlers)


class Net:
    """Components, and a chain from `compute` of the first one to handler 0 of `last`."""

    def __init__(self, name, nodes, last, *, ratio=None, outside=None, middleware="iceoryx2", own=None):
        self.name, self.nodes, self.last, self.ratio = name, nodes, last, ratio
        # A handler that receives bursts from outside of the network.
        self.outside = outside
        self.middleware = middleware
        # `transport` of the chain.
        self.own = own

    def longest_way(self, node, handler):
        """The longest time of a message on its way: the chain passes handler 0 of its components."""
        is_own = self.own is not None and handler == 0 and node <= self.last
        return self.own if is_own else TRANSPORT[self.middleware]


# The files.


def write(net, folder):
    """Writes the network and its components. Returns the path of the .ddsl file."""
    with open(os.path.join(folder, "Parts.idsl"), "w") as file:
        file.write("module Parts { interface Tick { void tick(int number); }; };\n")
    binds = []
    for at, node in enumerate(net.nodes):
        heard, said, reactions = [], [], []
        for number, handler in enumerate(node.handlers):
            heard.append(f"Tick as in{number} {{ depth {DEPTH}; }}")
            effects = ["compute"] if handler.kept else []
            if handler.sends:
                said.append(f"Tick as out{number}")
                effects.append(f"out{number}.tick")
                binds += [(target, f"n{at}.out{number}") for target in handler.sends]
            arrow = f" -> {', '.join(effects)}" if effects else ""
            reactions.append(f"in{number}.tick{arrow} budget {handler.budget}us;")
        arrow = ""
        if node.sends:
            said.append("Tick as out")
            arrow = " -> out.tick"
            binds += [(target, f"n{at}.out") for target in node.sends]
        reactions.append(f"compute{arrow} budget {node.compute}us;")
        clauses = [("subscribesTo", heard), ("publishes", said)]
        slots = [f"{word} {', '.join(all)};" for word, all in clauses if all]
        with open(os.path.join(folder, f"n{at}.cdsl"), "w") as file:
            file.write(
                f'import "Parts.idsl";\nComponent n{at}\n{{\n'
                f"    Communications {{ {' '.join(slots)} }};\n    language rust;\n"
                f"    period {node.period}us;\n    reactions {{ {' '.join(reactions)} }};\n}};\n"
            )
    lines = [f"middleware {net.middleware};"]
    lines += [f'Component n{at} {{ cdsl "n{at}.cdsl"; }};' for at in range(len(net.nodes))]
    lines += [f"bind n{node}.in{handler} -> {sender};" for (node, handler), sender in binds]
    if net.outside:
        lines.append("external n{}.in{};".format(*net.outside))
    own = "" if net.own is None else f" transport {net.own}us;"
    lines.append(f"Chain line {{ from n0.out.tick; to n{net.last}.in0.tick;{own} }};")
    path = os.path.join(folder, "net.ddsl")
    with open(path, "w") as file:
        file.write("Deployment net\n{\n    " + "\n    ".join(lines) + "\n};\n")
    return path


def bounds(rcdeploy, path):
    """The longest time of the chain and the oldest data, as rcdeploy computes them."""
    run = subprocess.run(
        [rcdeploy, "plan", "--unbuilt", "--format", "json", path], capture_output=True, text=True, timeout=120
    )
    try:
        chain = json.loads(run.stdout)["chains"][0]
        return chain["worst_ms"] * MS, chain["oldest_ms"] * MS
    except (ValueError, LookupError, TypeError) as error:
        raise SystemExit(f"no bound ({error!r}): {run.stdout}{run.stderr}") from error


# The simulation.


class Thread:
    """The event loop of a component."""

    def __init__(self, node):
        self.queues = [deque(maxlen=DEPTH) for _ in node.handlers]
        self.ready = [False] * len(node.handlers)
        self.ticked = self.is_due = self.in_turn = False
        # The handler that runs with its message, or COMPUTE.
        self.running = None
        self.kept = 0
        self.left = self.first = self.next = self.began = 0


def schedule(net, seed, phases=None, shorter=0.25):
    """The slowest message and the oldest data of one schedule, and its phases, which are random if none
    are given. `shorter`: how often a run or a way is not the longest one, half of these times none at all."""
    chance = random.Random(seed).random
    nodes, last = net.nodes, net.last
    threads = [Thread(node) for node in nodes]
    longest = max(node.period for node in nodes)
    warm, until = 4 * longest, 12 * longest
    events, count = [], 0
    pending, slowest, oldest = deque(), 0, 0
    phases = phases or [int(chance() * node.period) for node in nodes]
    for at, phase in enumerate(phases):
        heappush(events, (phase, count, TICK, at, 0, 0))
        count += 1
    if net.outside and chance() < 0.5:
        # More messages than there is time for, for a while.
        at, handler = net.outside
        gap = 1 + int(chance() * nodes[at].handlers[handler].budget)
        begin, length = chance() * until, MS * 10 ** (1 + 2 * chance())
        for number in range(int(length / gap)):
            heappush(events, (int(begin) + number * gap, count, ARRIVAL, at, handler, 0))
            count += 1

    def at_most(limit):
        """Often the longest time, else any shorter one."""
        drawn = chance()
        if drawn < shorter / 2:
            return 0
        return int(chance() * (limit + 1)) if drawn < shorter else limit

    def proceed(at, now):
        """Goes on with the turn of a thread, or begins one, until something runs or nothing waits."""
        nonlocal count
        node, thread = nodes[at], threads[at]
        ports = len(thread.queues)
        while True:
            if not thread.in_turn:
                for port, queue in enumerate(thread.queues):
                    if queue:
                        thread.ready[port] = True
                if not thread.ticked and True not in thread.ready:
                    return
                thread.in_turn, thread.left, thread.began = True, TURN, now
                thread.is_due, thread.ticked = thread.ticked, False
                thread.first = (thread.first + 1) % max(ports, 1)
                thread.next = thread.first
            while thread.left and True in thread.ready and now - thread.began < TURN_TIME:
                port = thread.next
                thread.next = (port + 1) % ports
                if not thread.ready[port]:
                    continue
                if not thread.queues[port]:
                    thread.ready[port] = False
                    continue
                thread.left -= 1
                thread.running = (port, thread.queues[port].popleft())
                heappush(events, (now + at_most(node.handlers[port].budget), count, END, at, 0, 0))
                count += 1
                return
            thread.in_turn = False
            if thread.is_due:
                thread.is_due = False
                thread.running = (COMPUTE, 0)
                heappush(events, (now + at_most(node.compute), count, END, at, 0, 0))
                count += 1
                return

    while events:
        now, _, kind, at, handler, origin = heappop(events)
        if now > until:
            break
        node, thread = nodes[at], threads[at]
        if kind == TICK:
            thread.ticked = True
            heappush(events, (now + node.period, count, TICK, at, 0, 0))
            count += 1
            if net.outside and net.outside[0] == at:
                for _ in range(int(chance() * 6)):
                    late = int(chance() * node.period)
                    heappush(events, (now + late, count, ARRIVAL, at, net.outside[1], 0))
                    count += 1
        elif kind == ARRIVAL:
            # A queue that is full loses its oldest message.
            thread.queues[handler].append(origin)
        else:
            port, origin = thread.running
            thread.running = None
            if port == COMPUTE:
                targets = node.sends
                if at == 0:
                    origin = now
                    if now >= warm:
                        pending.append(now)
                else:
                    origin = thread.kept
            else:
                run = node.handlers[port]
                targets = run.sends
                if run.kept:
                    thread.kept = max(thread.kept, origin)
                if port == 0 and at == last:
                    while pending and pending[0] <= origin:
                        slowest = max(slowest, now - pending.popleft())
                    if origin >= warm:
                        oldest = max(oldest, now - origin)
            for to, number in targets:
                way = at_most(net.longest_way(to, number))
                heappush(events, (now + way, count, ARRIVAL, to, number, origin))
                count += 1
        if thread.running is None:
            proceed(at, now)
    return slowest, oldest, phases


def schedules(net, seeds):
    """The slowest message and the oldest data of many schedules. A quarter of them have random phases. The
    others are near the worst one so far: seldom are all components at their worst by chance."""
    worst = [0, 0]
    best = [None, None]
    for number, seed in enumerate(seeds):
        draws, phases, shorter = seed, None, 0.25
        which = number % 2
        if number % 8 > 1 and best[which]:
            rng = random.Random(-seed)
            draws, phases, shorter = best[which]
            if rng.random() < 0.3:
                draws, shorter = seed, rng.choice([0, 0.05, 0.25])
            else:
                phases = list(phases)
                for _ in range(rng.randint(1, 2)):
                    at = rng.randrange(len(phases))
                    period = net.nodes[at].period
                    step = rng.choice([1, 0.1, 0.01])
                    phases[at] = int(phases[at] + (rng.random() - 0.5) * step * period) % period
        found = schedule(net, draws, phases, shorter)
        for of in (0, 1):
            if found[of] >= worst[of]:
                worst[of], best[of] = found[of], (draws, found[2], shorter)
    return tuple(worst)


# The networks.


def named():
    """Networks whose bounds must be near what schedules show."""
    yield Net(
        "a scan that stops a robot",
        [
            Node(50 * MS, 2 * MS, [(1, 0)]),
            Node(100 * MS, MS, handlers=[Handler(3 * MS, sends=[(2, 0)])]),
            Node(30 * MS, 3 * MS, [(3, 0)], [Handler(500, kept=True)]),
            Node(10 * MS, MS, handlers=[Handler(MS)]),
        ],
        3,
        ratio=1.3,
    )
    kept = [Handler(200, kept=True)]
    yield Net(
        "periods that never fit each other",
        [
            Node(13 * MS, MS, [(1, 0)]),
            Node(10 * MS, MS, [(2, 0)], kept),
            Node(17 * MS, MS, [(3, 0)], kept),
            Node(23 * MS, MS, handlers=kept),
        ],
        3,
        ratio=1.3,
    )
    handlers = [Handler(2 * MS, sends=[(2, 0)]), Handler(2 * MS), Handler(2 * MS)]
    yield Net(
        "messages of several senders at once",
        [
            Node(20 * MS, 100, [(1, 0)]),
            Node(40 * MS, 4 * MS, handlers=handlers),
            Node(50 * MS, 500, handlers=[Handler(500)]),
            Node(20_700, 100, [(1, 1)]),
            Node(21_400, 100, [(1, 2)]),
        ],
        2,
        ratio=1.3,
    )
    # The times of messages from outside are unknown: only the length of a turn is their bound.
    yield Net(
        "messages from outside",
        [
            Node(30 * MS, MS, [(1, 0)]),
            Node(20 * MS, 2 * MS, [(2, 0)], [Handler(MS, kept=True), Handler(3 * MS)]),
            Node(50 * MS, MS, handlers=[Handler(MS)]),
        ],
        2,
        outside=(1, 1),
        ratio=1.3,
    )


def drawn(seed):
    """A random network: a line of components, and others that send to them, some over a relay."""
    rng = random.Random(seed)
    length = rng.randint(2, 6)
    nodes = []
    for at in range(length):
        period = rng.randint(5, 120) * 500
        node = Node(period, rng.randint(50, period // 5))
        next_hop = [(at + 1, 0)] if at + 1 < length else []
        if at:
            handler = Handler(rng.randint(20, 1200), kept=rng.random() < 0.5)
            (node if handler.kept else handler).sends += next_hop
            node.handlers.append(handler)
        else:
            node.sends += next_hop
        nodes.append(node)

    def receives(node, handler, period):
        """Lets one more message of this period come to a component, unless it has no time for it."""
        receiver = nodes[node]
        loads[node] += handler.budget / period
        receiver.handlers.append(handler)
        return (node, len(receiver.handlers) - 1)

    # A message of the chain may come as often as that of the fastest component before.
    fastest = nodes[0].period
    loads = []
    for node in nodes:
        handled = node.handlers[0].budget / fastest if node.handlers else 0
        loads.append(node.compute / node.period + handled)
        fastest = min(fastest, node.period)
    for _ in range(rng.randint(0, 4)):
        period, budget = rng.randint(6, 100) * 500, rng.randint(20, 1500)
        target = rng.randrange(length)
        if not nodes[target].handlers or loads[target] + budget / period > 0.6:
            continue
        target = receives(target, Handler(budget, kept=rng.random() < 0.3), period)
        if rng.random() < 0.4:
            relay = Node(rng.randint(10, 100) * 500, rng.randint(50, 400))
            relay.handlers.append(Handler(rng.randint(50, 500), sends=[target]))
            nodes.append(relay)
            loads.append(0)
            target = (len(nodes) - 1, 0)
        nodes.append(Node(period, rng.randint(50, 400), [target]))
        loads.append(0)
    own = rng.choice([None, None, rng.randint(50, 3000)])
    middleware = rng.choice(["iceoryx2", "dds"])
    net = Net(f"random network {seed}", nodes, length - 1, middleware=middleware, own=own)
    return net if max(loads) < 0.8 else None


def main():
    rcdeploy, folder, total = sys.argv[1], sys.argv[2], int(sys.argv[3])
    seed = int(sys.argv[4]) if len(sys.argv) > 4 else 1
    nets = list(named())
    wanted = len(nets) + 6 + total // 20_000
    draw = seed * 1_000_000
    while len(nets) < wanted:
        draw += 1
        net = drawn(draw)
        if net:
            nets.append(net)
    # Half of the schedules are those of the named networks.
    count = len(list(named()))
    failed = []
    with ProcessPoolExecutor(os.cpu_count()) as pool:
        for number, net in enumerate(nets):
            share = total // 2 // (count if number < count else len(nets) - count)
            longest, oldest = bounds(rcdeploy, write(net, folder))
            begin = seed + number * 10_000_000
            parts = [range(begin + at, begin + share, 4) for at in range(min(4, share))]
            found = list(pool.map(schedules, [net] * len(parts), parts))
            seen = [max(part[which] for part in found) for which in (0, 1)]
            text = f"{net.name}: {share} schedules"
            for what, bound, worst in zip(("time", "age"), (longest, oldest), seen):
                if not worst:
                    failed.append(f"{net.name}: nothing came to the end")
                    continue
                text += f"; {what} {bound:.0f} us of {worst} us, {bound / worst:.3f}"
                # Times in JSON are rounded to a nanosecond.
                if bound + 0.01 < worst:
                    failed.append(f"{net.name}: a {what} of {worst} us is above its bound of {bound:.0f} us")
                # Few schedules of a random network do not find its worst one.
                ratio = net.ratio or (1.3 if total >= 1_000_000 else None)
                if ratio and bound > ratio * worst:
                    failed.append(f"{net.name}: the bound of its {what}, {bound:.0f} us, is far from {worst} us")
            print(text, flush=True)
    print("\n".join(failed), file=sys.stderr)
    sys.exit(1 if failed else 0)


if __name__ == "__main__":
    main()
