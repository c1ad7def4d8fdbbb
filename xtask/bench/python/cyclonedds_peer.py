"""The same with the package `cyclonedds`: `cyclonedds_peer.py ping|pong DOMAIN`. A query is a value
and a value back. There is no memory to lend."""

import sys
from dataclasses import dataclass

import numpy as np
from bench_protocol import Data, Ping, Pong
from cyclonedds.core import InstanceState, Policy, Qos, ReadCondition, SampleState, ViewState, WaitSet
from cyclonedds.domain import DomainParticipant
from cyclonedds.idl import IdlStruct
from cyclonedds.idl.annotations import final
from cyclonedds.idl.types import int64, sequence, uint8
from cyclonedds.pub import DataWriter
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from cyclonedds.util import duration


@dataclass
@final
class Value(IdlStruct, typename="Bench.Value"):
    sent: int64
    data: sequence[uint8]


QOS = Qos(
    Policy.Reliability.Reliable(duration(seconds=1)),
    Policy.History.KeepLast(10),
    Policy.DataRepresentation(use_cdrv0_representation=True),
)


class Reader:
    """Waits for values of a topic."""

    def __init__(self, member: DomainParticipant, name: str) -> None:
        self.port = DataReader(member, Topic(member, name, Value), QOS)
        self.waiting = WaitSet(member)
        any_state = SampleState.Any | ViewState.Any | InstanceState.Any
        self.waiting.attach(ReadCondition(self.port, any_state))

    def take(self) -> list[Value]:
        while True:
            values = [v for v in self.port.take(N=10) if v.sample_info.valid_data]
            if values:
                return values
            self.waiting.wait(timeout=duration(seconds=1))


def array(value: Value) -> Data:
    return np.array(value.data, np.uint8)


def ping(member: DomainParticipant) -> None:
    samples = DataWriter(member, Topic(member, "sample", Value), QOS)
    requests = DataWriter(member, Topic(member, "request", Value), QOS)
    replies = Reader(member, "reply")
    while not (samples.get_matched_subscriptions() and replies.port.get_matched_publications()):
        pass

    def query(data: Data) -> Data:
        requests.write(Value(0, data.tolist()))
        return array(replies.take()[0])

    def publish(sent: int, data: Data) -> None:
        samples.write(Value(sent, data.tolist()))

    order = Ping(publish, lambda sent, data, fill: publish(sent, data), query)
    while order.block():
        pass


def pong(member: DomainParticipant) -> None:
    samples, requests = Reader(member, "sample"), Reader(member, "request")
    replies = DataWriter(member, Topic(member, "reply", Value), QOS)
    both = WaitSet(member)
    any_state = SampleState.Any | ViewState.Any | InstanceState.Any
    for reader in (samples, requests):
        both.attach(ReadCondition(reader.port, any_state))
    times = Pong()
    print("ready", flush=True)
    while True:
        both.wait(timeout=duration(seconds=1))
        for value in samples.port.take(N=10):
            if value.sample_info.valid_data:
                times.sample(value.sent, array(value))
        for value in requests.port.take(N=10):
            if value.sample_info.valid_data:
                replies.write(Value(0, array(value).tolist()))


if __name__ == "__main__":
    {"ping": ping, "pong": pong}[sys.argv[1]](DomainParticipant(int(sys.argv[2])))
