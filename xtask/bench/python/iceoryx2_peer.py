"""`ping_python` and `pong_python`, written by hand with the package `iceoryx2`: the reference.

`iceoryx2_peer.py ping|pong ROOT PREFIX`. The services have the settings of our backend, bodies are
bytes, and a waiting program sleeps on its listener. The time of sending is the header of a value.
"""

import ctypes
import sys

import iceoryx2 as iox
import numpy as np
from bench_protocol import Data, Ping, Pong

LARGEST = 1024 * 1024


class Stamp(ctypes.Structure):
    """The time of sending, and whether the value is read in place."""

    _fields_ = [("sent", ctypes.c_int64), ("place", ctypes.c_int64)]

    @staticmethod
    def type_name() -> str:
        return "BenchStamp"


def node(root: str, prefix: str) -> iox.Node:
    config = iox.config.default()
    config.global_cfg.root_path = iox.Path.new(root)
    config.global_cfg.prefix = iox.FileName.new(prefix)
    iox.set_log_level(iox.LogLevel.Fatal)
    builder = iox.NodeBuilder.new().config(config)
    builder = builder.signal_handling_mode(iox.SignalHandlingMode.Disabled)
    return builder.create(iox.ServiceType.Ipc)


class Network:
    """The services of both ends."""

    def __init__(self, root: str, prefix: str) -> None:
        self.node = node(root, prefix)
        topic = self.service("sample").publish_subscribe(iox.Slice[ctypes.c_uint8])
        topic = topic.user_header(Stamp).enable_safe_overflow(True).history_size(0)
        self.topic = topic.subscriber_max_buffer_size(10).open_or_create()
        calls = self.service("echo").request_response(
            iox.Slice[ctypes.c_uint8], iox.Slice[ctypes.c_uint8]
        )
        self.calls = calls.open_or_create()
        self.bells = {name: self.service(name).event().open_or_create() for name in ("pong", "ping")}

    def service(self, name: str) -> iox.ServiceBuilder:
        return self.node.service_builder(iox.ServiceName.new(name))

    def bell(self, name: str) -> iox.Notifier:
        return self.bells[name].notifier_builder().create()

    def ear(self, name: str) -> iox.Listener:
        return self.bells[name].listener_builder().create()


def view(payload: object) -> Data:
    """The bytes of a payload, in place."""
    return np.frombuffer(payload.as_memory_view(), np.uint8)


def ping(network: Network) -> None:
    publisher = network.topic.publisher_builder().initial_max_slice_len(LARGEST).create()
    client = network.calls.client_builder().initial_max_slice_len(LARGEST).create()
    bell, ear = network.bell("pong"), network.ear("ping")

    def send(sent: int, data: Data, place: bool, fill: bool) -> None:
        loan = publisher.loan_slice_uninit(len(data))
        loan.user_header().contents.sent = sent
        loan.user_header().contents.place = place
        if fill and len(data):
            ctypes.memmove(loan.payload_ptr, data.ctypes.data, len(data))
        loan.assume_init().send()
        bell.notify()

    def query(data: Data) -> Data:
        loan = client.loan_slice_uninit(len(data))
        ctypes.memmove(loan.payload_ptr, data.ctypes.data, len(data))
        pending = loan.assume_init().send()
        bell.notify()
        while (answer := pending.receive()) is None:
            ear.timed_wait(iox.Duration.from_secs(1))
        result = view(answer.payload()).copy()
        answer.delete()
        pending.delete()
        return result

    order = Ping(
        lambda sent, data: send(sent, data, False, True),
        lambda sent, data, fill: send(sent, data, True, fill),
        query,
    )
    while order.block():
        pass


def pong(network: Network) -> None:
    subscriber = network.topic.subscriber_builder().buffer_size(10).create()
    server = network.calls.server_builder().initial_max_slice_len(LARGEST).create()
    bell, ear = network.bell("ping"), network.ear("pong")
    times = Pong()
    print("ready", flush=True)
    while True:
        ear.timed_wait(iox.Duration.from_secs(1))
        while (sample := subscriber.receive()) is not None:
            stamp = sample.user_header().contents
            data = view(sample.payload()) if sample.payload().len() else np.empty(0, np.uint8)
            times.sample(stamp.sent, data if stamp.place else data.copy())
            del data
            sample.delete()
        while (request := server.receive()) is not None:
            data = view(request.payload()).copy()
            loan = request.loan_slice_uninit(len(data))
            ctypes.memmove(loan.payload_ptr, data.ctypes.data, len(data))
            loan.assume_init().send()
            request.delete()
            bell.notify()


if __name__ == "__main__":
    {"ping": ping, "pong": pong}[sys.argv[1]](Network(*sys.argv[2:]))
