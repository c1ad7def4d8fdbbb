"""Looks at a network as Foxglove does: over the WebSocket of rcfoxglove, by schemas alone.

Arguments: the port, what to do (`look`, `shapes`, `world` or `attack`), and a command that restarts the simulator. While it
looks, somebody sends poses with the source `sent`; for `shapes`, pictures that say `sent` is their frame, too.
"""

import itertools
import json
import math
import socket
import struct
import subprocess
import sys
import time

import numpy as np
from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from websockets.exceptions import ConnectionClosed, InvalidHandshake, InvalidStatus
from websockets.sync.client import connect

PORT = int(sys.argv[1])
LIMIT = 20


def message_types(schema, name):
    """The types of a definition of a ROS 2 message."""
    store = get_typestore(Stores.EMPTY)
    store.register(get_types_from_msg(schema, name))
    return store


class Client:
    def __init__(self, protocol="foxglove.sdk.v1", **options):
        url = f"ws://127.0.0.1:{PORT}"
        self.socket = connect(url, subprotocols=[protocol], max_size=None, proxy=None, **options)
        self.channels, self.services, self.graph, self.said = {}, {}, {}, []
        self.parameters = {}
        self.wanted = {}
        self.numbers = itertools.count(1000)
        self.messages = []
        self.replies = {}
        self.info = None
        self.until(lambda: self.services or (self.info and "services" not in self.info["capabilities"]))

    def send(self, op, **members):
        self.socket.send(json.dumps({"op": op, **members}))

    def step(self, timeout=1):
        try:
            message = self.socket.recv(timeout=timeout)
        except TimeoutError:
            return
        if isinstance(message, bytes):
            if message[0] == 1:
                subscription, stamp = struct.unpack_from("<IQ", message, 1)
                self.messages.append((subscription, stamp, message[13:]))
            elif message[0] == 3:
                _, call, length = struct.unpack_from("<III", message, 1)
                assert message[13 : 13 + length] == b"cdr"
                self.replies[call] = message[13 + length :]
            return
        message = json.loads(message)
        op = message["op"]
        if op == "serverInfo":
            self.info = message
        elif op == "advertise":
            self.channels.update({one["topic"]: one for one in message["channels"]})
        elif op == "advertiseServices":
            self.services.update({one["name"]: one for one in message["services"]})
        elif op == "parameterValues":
            self.parameters.update({one["name"]: one for one in message["parameters"]})
        elif op == "connectionGraphUpdate":
            self.graph = message
        elif op == "serviceCallFailure":
            self.replies[message["callId"]] = message["message"]
        elif op == "status":
            self.said.append(message["message"])

    def until(self, condition, what="something"):
        end = time.monotonic() + LIMIT
        while True:
            found = condition()
            if found:
                return found
            assert time.monotonic() < end, f"waited {LIMIT} s for {what}"
            self.step()

    def topic(self, end):
        return self.until(lambda: [c for t, c in self.channels.items() if t.endswith(end)], end)[0]

    def subscribe(self, end):
        """Subscribes to the topic with this end. Returns how its messages are read."""
        channel = self.topic(end)
        number = next(self.numbers)
        store = message_types(channel["schema"], channel["schemaName"])
        self.wanted[end] = number
        self.send("subscribe", subscriptions=[{"id": number, "channelId": channel["id"]}])
        return lambda raw: store.deserialize_cdr(raw, channel["schemaName"])

    def message(self, end, read, so=lambda value: True, since=0):
        """The first message of a topic since a time for which a condition holds."""

        def found():
            messages, self.messages = self.messages, []
            mine = [m for m in messages if m[0] == self.wanted[end]]
            self.messages = [m for m in messages if m[0] != self.wanted[end]]
            values = [(stamp, read(raw)) for _, stamp, raw in mine if stamp >= since]
            return [value for value in values if so(value[1])]

        return self.until(found, f"a message of {end}")[0]

    def call(self, end, **members):
        """Calls an operation. Returns the reply, or why there is none."""
        name, service = next((n, s) for n, s in self.services.items() if n.endswith(end))
        request, response = service["request"], service["response"]
        store = message_types(request["schema"], request["schemaName"])
        ty = store.types[request["schemaName"]]
        fields = ty.__dataclass_fields__
        value = ty(**{name: members.get(name, 0) for name in fields if name != "__msgtype__"})
        body = store.serialize_cdr(value, request["schemaName"])
        number = len(self.replies) + 1
        self.socket.send(struct.pack("<BIII", 2, service["id"], number, 3) + b"cdr" + bytes(body))
        reply = self.until(lambda: self.replies.get(number), f"the reply of {name}")
        if isinstance(reply, str):
            return reply
        store = message_types(response["schema"], response["schemaName"])
        return store.deserialize_cdr(reply, response["schemaName"])


def look():
    client = Client()
    found = {"info": client.info, "topics": sorted(client.channels), "services": sorted(client.services)}

    pose = client.subscribe("/newFullPose")
    shape = client.subscribe("/newFullPose/_pose")
    stamp, value = client.message("/newFullPose", pose, lambda value: value.source == "sent")
    found["age"] = abs(time.time() - stamp / 1e9)
    found["pose"] = {name: getattr(value, name) for name in ("x", "y", "rz", "confidence")}
    stamp, value = client.message("/newFullPose/_pose", shape, lambda value: value.pose.position.y == -0.25)
    # It was sent before it came.
    sent = value.timestamp.sec * 1_000_000_000 + value.timestamp.nanosec
    assert 0 < stamp - sent < LIMIT * 1e9, (stamp, sent)
    at, turn = value.pose.position, value.pose.orientation
    found["shape"] = [value.frame_id, at.x, at.y, turn.z, turn.w]
    client.send("unsubscribe", subscriptionIds=list(client.wanted.values()))

    reply = client.subscribe("/getLaserData/_reply")
    scan = client.subscribe("/getLaserData/_scan")
    _, value = client.message("/getLaserData/_reply", reply)
    found["measures"] = len(value.result)
    _, value = client.message("/getLaserData/_scan", scan)
    found["ranges"] = [value.frame_id, len(value.ranges), value.start_angle, value.end_angle]
    found["near"] = min(value.ranges)

    found["called"] = client.call("/getLaserConfData").result.max_measures
    client.call("/setSpeedBase", adv=1.5, rot=0.0)

    client.send("getParameters", parameterNames=["avoider.speed"], id="one")
    found["speed"] = client.until(lambda: client.parameters.get("avoider.speed"))
    other = Client("foxglove.websocket.v1")
    other.send("subscribeParameterUpdates", parameterNames=["avoider.speed"])
    other.send("getParameters", parameterNames=["avoider.speed"])
    other.until(lambda: other.parameters)
    # A whole number, as JavaScript writes it.
    client.send("setParameters", parameters=[{"name": "avoider.speed", "value": 300}], id="two")
    for one in (client, other):
        one.until(lambda: one.parameters["avoider.speed"]["value"] == 300, "the new speed")
    client.send("setParameters", parameters=[{"name": "avoider.speed", "value": 1e9}])
    client.until(lambda: client.said, "a refusal")
    found["refused"] = client.said.pop()

    client.send("subscribeConnectionGraph")
    found["graph"] = client.until(lambda: client.graph)

    # Subscriptions outlive the other end.
    subprocess.run(sys.argv[3:], check=True, stdout=subprocess.DEVNULL)
    begun = time.time_ns()
    client.message("/getLaserData/_reply", lambda raw: None, since=begun)
    print(json.dumps(found))


def plain(value):
    """A value of rosbags as JSON has it, without the name of its type."""
    if isinstance(value, np.ndarray):
        return value.tolist()
    if isinstance(value, list):
        return [plain(one) for one in value]
    if not hasattr(value, "__dataclass_fields__"):
        return value
    names = [name for name in value.__dataclass_fields__ if name != "__msgtype__"]
    return {name: plain(getattr(value, name)) for name in names}


def both(client, *ends, wanted=lambda shown: True):
    """One message of a topic, with what another one shows of it: they have the same time."""
    reads = [client.subscribe(end) for end in ends]
    numbers = [client.wanted[end] for end in ends]

    def found():
        pairs = {}
        for number, stamp, raw in client.messages:
            if number in numbers:
                pairs.setdefault(stamp, {})[number] = raw
        for stamp, pair in pairs.items():
            if len(pair) == 2:
                value, shown = (read(pair[number]) for read, number in zip(reads, numbers))
                if wanted(shown):
                    return stamp, plain(value), plain(shown)

    stamp, value, shown = client.until(found, f"a message of {ends[1]}")
    client.send("unsubscribe", subscriptionIds=numbers)
    client.messages = [one for one in client.messages if one[0] not in numbers]
    return {"schema": client.topic(ends[1])["schemaName"], "stamp": stamp, "value": value, "shown": shown}


def shapes():
    client = Client()
    # The camera publishes them, and `rcdeploy send`.
    pictures = ("/newImage", "/newImage/_image")
    found = {
        "image": both(client, *pictures, wanted=lambda shown: shown.frame_id == "camera"),
        "sent": both(client, *pictures, wanted=lambda shown: shown.frame_id == "sent"),
        "cloud": both(client, "/newCloud", "/newCloud/_points"),
        "scan": both(client, "/getLaserData/_reply", "/getLaserData/_scan"),
        "pose": both(client, "/newFullPose", "/newFullPose/_pose"),
        "transform": both(client, "/newFullPose", "/newFullPose/_transform"),
    }
    # NaN and infinity are not JSON; a scan has an infinity where nothing was measured.
    print(json.dumps(finite(found), allow_nan=False))


def finite(value):
    if isinstance(value, dict):
        return {name: finite(one) for name, one in value.items()}
    if isinstance(value, list):
        return [finite(one) for one in value]
    return str(value) if isinstance(value, float) and not math.isfinite(value) else value


def world():
    client = Client()
    found = {}
    for end in ("/world/_transforms", "/world/_entities"):
        read = client.subscribe(end)
        _, value = client.message(end, read)
        found[end.rsplit("/", 1)[1]] = plain(value)
        found[client.topic(end)["schemaName"]] = True
    print(json.dumps(found))


def refused(**options):
    try:
        Client(**options)
    except InvalidStatus as error:
        return error.response.status_code
    return None


def attack():
    found = {
        "origin": refused(origin="https://evil.example"),
        "protocol": refused(protocol="chat"),
        "allowed": refused(origin="https://viewer.example"),
        "foxglove": refused(origin="https://app.foxglove.dev"),
    }
    client = Client()
    for text in ("{", "[]", '{"op": "fetchAsset"}', '{"op": "subscribe"}', "[" * 100_000):
        client.socket.send(text)
        client.until(lambda: client.said, "a complaint")
        client.said.pop()
    for raw in (b"", b"\x01", b"\x02" + b"\xff" * 12, b"\xff" * 100):
        client.socket.send(raw)
        client.until(lambda: client.said, "a complaint")
        client.said.pop()
    client.send("subscribe", subscriptions=[{"id": 1, "channelId": 1 << 40}])
    client.until(lambda: client.said, "a complaint")
    # A second subscription to a channel is refused: each would cost a copy of each message.
    channel = client.topic("/newFullPose")["id"]
    client.send("subscribe", subscriptions=[{"id": one, "channelId": channel} for one in (1, 2, 3)])
    found["twice"] = len(client.until(lambda: client.said, "a complaint"))
    client.until(lambda: len(client.messages) > 3, "poses")
    found["ids"] = sorted({subscription for subscription, _, _ in client.messages})
    client.send("unsubscribe", subscriptionIds=[1])
    # Cut requests, and one of a service that is none.
    for number, service in ((77, client.services[min(client.services)]["id"]), (78, 1 << 30)):
        client.socket.send(struct.pack("<BIII", 2, service, number, 3) + b"cdr\x00\x01")
        assert isinstance(client.until(lambda: client.replies.get(number)), str)
    found["lives"] = client.call("/getLaserConfData").result.max_measures > 0
    # A message that is too long.
    try:
        client.socket.send(b"\x02" * (5 << 20))
        while True:
            client.socket.recv(timeout=LIMIT)
    except (ConnectionClosed, OSError):
        found["long"] = True

    # One that asks for everything and does not read: others are served.
    idle = Client()
    idle.send("subscribe", subscriptions=[{"id": c["id"], "channelId": c["id"]} for c in idle.channels.values()])
    ask = json.dumps({"op": "getParameters", "parameterNames": []})
    raw = idle.socket.socket
    raw.settimeout(5)
    try:
        for _ in range(200_000):
            idle.socket.send(ask)
    except (ConnectionClosed, OSError, TimeoutError):
        pass
    other = Client()
    read = other.subscribe("/newFullPose")
    other.message("/newFullPose", read)
    read = other.subscribe("/newFullPose/_transform")
    _, value = other.message("/newFullPose/_transform", read)
    found["frames"] = [value.parent_frame_id, value.child_frame_id]

    # All places are taken by connections that say nothing; they are given back.
    silent = [socket.create_connection(("127.0.0.1", PORT)) for _ in range(40)]
    end = time.monotonic() + LIMIT
    while True:
        try:
            Client().socket.close()
            break
        except (OSError, ConnectionClosed, InvalidHandshake):
            assert time.monotonic() < end
            time.sleep(0.05)
    found["served"] = True
    del silent
    print(json.dumps(found))


{"look": look, "shapes": shapes, "attack": attack, "world": world}[sys.argv[2]]()
