"""The endpoints of a program in a domain, with the package `cyclonedds` 11.0.1 and nothing else."""

import time

from cyclonedds.core import Policy, Qos, ReadCondition, WaitSet, SampleState, ViewState, InstanceState
from cyclonedds.domain import DomainParticipant
from cyclonedds.pub import DataWriter
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from cyclonedds.util import duration

from rpc import EntityId_t, GUID_t, RequestHeader, SampleIdentity, SequenceNumber_t

# The longest wait for an event.
LIMIT = 20.0


def qos(reliable=True, kept=False, depth=None):
    """Components read and write XCDR1 alone."""
    history = Policy.History.KeepAll if depth is None else Policy.History.KeepLast(depth)
    policies = [
        Policy.Reliability.Reliable(duration(seconds=1)) if reliable else Policy.Reliability.BestEffort,
        Policy.Durability.TransientLocal if kept else Policy.Durability.Volatile,
        history,
        Policy.DataRepresentation(use_cdrv0_representation=True),
    ]
    if kept:
        # Samples for late readers have a history of their own, of one sample by default.
        policies.append(Policy.DurabilityService(0, history, -1, -1, -1))
    return Qos(*policies)


class Network:
    """A participant of a domain, and the prefix of its addresses."""

    def __init__(self, network, domain):
        self.network, self.member = network, DomainParticipant(int(domain))

    def writer(self, name, kind, wanted=None):
        return DataWriter(self.member, Topic(self.member, f"{self.network}/{name}", kind), wanted or qos())

    def reader(self, name, kind, wanted=None):
        return DataReader(self.member, Topic(self.member, f"{self.network}/{name}", kind), wanted or qos())

    def values(self, reader, seconds=LIMIT):
        """Yields the values that arrive within `seconds`."""
        waiting = WaitSet(self.member)
        waiting.attach(ReadCondition(reader, SampleState.Any | ViewState.Any | InstanceState.Any))
        end = time.monotonic() + seconds
        while (left := end - time.monotonic()) > 0:
            taken = [sample for sample in reader.take(N=100) if sample.sample_info.valid_data]
            yield from taken
            if not taken:
                waiting.wait(timeout=duration(seconds=left))


def until(what, so):
    """Waits until a condition holds."""
    end = time.monotonic() + LIMIT
    while not so():
        if time.monotonic() > end:
            raise TimeoutError(f"waited {LIMIT} s until {what}")
        time.sleep(0.002)


def met(*ends):
    """Waits until each endpoint has a peer."""
    until("all ends are met", lambda: all(
        end.get_matched_subscriptions() if isinstance(end, DataWriter) else end.get_matched_publications()
        for end in ends
    ))


class Client:
    """Calls the server of an interface."""

    def __init__(self, network, interface, request, reply):
        self.network, self.type, self.sequence = network, request, 0
        self.replies = network.reader(f"{interface}_Reply", reply)
        self.requests = network.writer(f"{interface}_Request", request)
        guid = self.requests.guid.bytes
        self.guid = GUID_t(guid[:12], EntityId_t(guid[12:15], guid[15]))
        met(self.requests, self.replies)

    def call(self, data):
        """Sends a request and gives the reply to it."""
        self.sequence += 1
        asked = SampleIdentity(self.guid, SequenceNumber_t(self.sequence >> 32, self.sequence & 0xFFFFFFFF))
        self.requests.write(self.type(RequestHeader(asked, ""), data))
        for reply in self.network.values(self.replies):
            # Every client receives the replies to all.
            if reply.header.relatedRequestId == asked:
                return reply
        raise TimeoutError("no reply")
