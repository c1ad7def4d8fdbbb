"""The endpoints of a node of ROS 2 on Cyclone DDS, with the package `cyclonedds` 11.0.1 and nothing else."""

import random
import sys
from pathlib import Path

# The programs over DDS use the same module.
sys.path.append(str(Path(__file__).parents[3] / "dds/tests/stranger"))

from cyclonedds.pub import DataWriter
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic

import network
from network import met, qos, until


class Node(network.Network):
    """A participant of a domain, and its namespace."""

    def topic(self, prefix, name, kind):
        return Topic(self.member, f"{prefix}/{self.network}/{name}", kind)

    def writer(self, name, kind, wanted=None, prefix="rt"):
        return DataWriter(self.member, self.topic(prefix, name, kind), wanted or qos())

    def reader(self, name, kind, wanted=None, prefix="rt"):
        return DataReader(self.member, self.topic(prefix, name, kind), wanted or qos())


class Client:
    """Calls a service."""

    def __init__(self, node, name, request, response):
        self.node, self.type, self.sequence = node, request, 0
        self.guid = random.getrandbits(64)
        self.responses = node.reader(f"{name}Reply", response, prefix="rr")
        self.requests = node.writer(f"{name}Request", request, prefix="rq")
        met(self.requests, self.responses)

    def call(self, *fields):
        """Sends a request and gives the response to it."""
        self.sequence += 1
        self.requests.write(self.type(self.guid, self.sequence, *fields))
        for response in self.node.values(self.responses):
            # Every client receives the responses to all.
            if (response.guid, response.seq) == (self.guid, self.sequence):
                return response
        raise TimeoutError("no response")


class Server:
    """Serves a service."""

    def __init__(self, node, name, request, response):
        self.node, self.type = node, response
        self.responses = node.writer(f"{name}Reply", response, prefix="rr")
        self.requests = node.reader(f"{name}Request", request, prefix="rq")

    def serve(self, answer):
        """Replies to each request with the fields that `answer` returns, or not at all if it returns `None`."""
        for request in self.node.values(self.requests, seconds=60):
            if (fields := answer(request)) is not None:
                self.responses.write(self.type(request.guid, request.seq, *fields))
