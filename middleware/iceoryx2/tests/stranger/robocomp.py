"""What a program needs to meet the components of a network, with the package `iceoryx2` 0.10.0 and nothing else.

The names and bytes are told in docs/shared-memory-wire.md; this is that page as a program.
"""

import ctypes
import hashlib
import os
import pathlib
import struct
import time
import uuid

import iceoryx2 as iox

OUTCOMES = ["ok", "not supported", "invalid argument", "out of resources", "unknown operation", "it failed"]


class Message(ctypes.Structure):
    """The header beside a value and an answer. (8 bytes are alignment enough for who opens, and does not create.)"""

    _fields_ = [
        ("version", ctypes.c_uint16),
        ("encoding", ctypes.c_uint16),
        ("flags", ctypes.c_uint32),
        ("type_hash", ctypes.c_uint64),
        ("sequence", ctypes.c_uint64),
        ("sent", ctypes.c_uint64),
    ]

    @staticmethod
    def type_name():
        return "RcHeader1"


class Request(ctypes.Structure):
    """The header beside a request."""

    _fields_ = [("message", Message), ("client", ctypes.c_uint8 * 16)]

    @staticmethod
    def type_name():
        return "RcRequestHeader1"


def header(sequence, type_hash=0, flags=0):
    return Message(1, 1, flags, type_hash, sequence, time.monotonic_ns())


class Cdr:
    """Writes and reads XCDR1, little endian: a number lies at a multiple of its size."""

    def __init__(self, data=b""):
        self.data, self.at = bytearray(data), 0

    def put(self, kinds, *values):
        for kind, value in zip(kinds, values):
            self.data += bytes(-len(self.data) % struct.calcsize(kind)) + struct.pack("<" + kind, value)
        return self

    def put_text(self, text):
        text = text.encode() + b"\0"
        self.put("I", len(text)).data += text
        return self

    def get(self, kind):
        size = struct.calcsize(kind)
        self.at += -self.at % size
        (value,) = struct.unpack_from("<" + kind, self.data, self.at)
        self.at += size
        return value

    def get_text(self):
        size = self.get("I")
        self.at += size
        return self.data[self.at - size : self.at - 1].decode()


class Network:
    """A node in a network of components."""

    def __init__(self, network, name="stranger"):
        runtime = os.environ.get("XDG_RUNTIME_DIR", "")
        base = pathlib.Path(runtime, "robocomp")
        if not base.is_absolute():
            base = pathlib.Path(f"/dev/shm/robocomp-{os.getuid()}")
        directory = base / network
        prefix = (directory / "iceoryx2.prefix").read_text()
        root = directory / "iceoryx2"
        if len(os.fsencode(root)) > 44:
            root = pathlib.Path(f"/dev/shm/{prefix}root")
        config = iox.config.default()
        config.global_cfg.root_path = iox.Path.new(str(root))
        config.global_cfg.prefix = iox.FileName.new(prefix)
        iox.set_log_level(iox.LogLevel.Fatal)
        builder = iox.NodeBuilder.new().config(config).name(iox.NodeName.new(name))
        builder = builder.signal_handling_mode(iox.SignalHandlingMode.Disabled)
        self.node = builder.create(iox.ServiceType.Ipc)

    def service(self, name):
        return self.node.service_builder(iox.ServiceName.new(name))

    def topic(self, address):
        return self.service(address).publish_subscribe(iox.Slice[ctypes.c_uint8]).user_header(Message).open()

    def bell(self, name):
        """Rings for those who wait for the event service `name`."""
        builder = self.service(name).event().open().notifier_builder()
        return builder.default_event_id(iox.EventId.new(0)).create()


class Subscriber:
    """The values of a topic, and so many of those that were kept for who comes late."""

    def __init__(self, network, address, late=0):
        self.ear = network.service(address).event().open().listener_builder().create()
        self.ports = []
        # Publishers that keep nothing, and those that keep values for who comes late. Either may be missing.
        for name, history in (address, 0), (f"{address}:kept", late):
            try:
                builder = network.topic(name).subscriber_builder().buffer_size(10)
            except iox.PublishSubscribeOpenError:
                continue
            self.ports.append(builder.history_request(history).create())
            if history:
                network.bell(f"{address}:late").notify()

    def values(self, seconds):
        """Yields header and body of what comes within `seconds`."""
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            for port in self.ports:
                while (sample := port.receive()) is not None:
                    header = Message.from_buffer_copy(sample.user_header().contents)
                    value = header, bytes(sample.payload().as_memory_view())
                    # One is lent at a time: it has to be given back before the next can come.
                    sample.delete()
                    yield value
            self.ear.timed_wait(iox.Duration.from_millis(50))


class Publisher:
    """Sends values to a topic, whose subscriber is there already."""

    def __init__(self, network, address):
        builder = network.topic(address).publisher_builder().initial_max_slice_len(256)
        self.port = builder.allocation_strategy(iox.AllocationStrategy.PowerOfTwo).create()
        self.bell = network.bell(address)
        self.sequence = 0

    def publish(self, body, message=None):
        self.sequence += 1
        sample = self.port.loan_slice_uninit(len(body))
        ctypes.memmove(sample.user_header_ptr, ctypes.byref(message or header(self.sequence)), ctypes.sizeof(Message))
        ctypes.memmove(sample.payload_ptr, bytes(body), len(body))
        sample.assume_init().send()
        self.bell.notify()

    def linger(self, seconds=0.5):
        """To be called before the end: who leaves at once takes along what nobody has looked at yet."""
        time.sleep(seconds)


class Refused(Exception):
    """The server did nothing, and says why."""


class Client:
    """Calls the server of an address."""

    def __init__(self, network, address):
        self.id, self.sequence = uuid.uuid4().bytes, 0
        builder = network.service(address).request_response(iox.Slice[ctypes.c_uint8], iox.Slice[ctypes.c_uint8])
        calls = builder.request_header(Request).response_header(Message).open()
        builder = calls.client_builder().initial_max_slice_len(256)
        self.port = builder.allocation_strategy(iox.AllocationStrategy.PowerOfTwo).create()
        own = network.service(f"{address}:client:{self.id.hex()}")
        self.ear = own.event().event_id_max_value(1).create().listener_builder().create()
        self.bell = network.bell(f"{address}:server")

    def send(self, body, type_hash=0):
        """Sends a whole request, envelope and all."""
        loan = self.port.loan_slice_uninit(len(body))
        request = Request(header(self.sequence, type_hash), (ctypes.c_uint8 * 16)(*self.id))
        ctypes.memmove(loan.user_header_ptr, ctypes.byref(request), ctypes.sizeof(Request))
        ctypes.memmove(loan.payload_ptr, bytes(body), len(body))
        pending = loan.assume_init().send()
        self.bell.notify()
        return pending

    def request(self, operation):
        """The envelope of a request; its arguments are to follow, or one octet where there are none."""
        self.sequence += 1
        number = struct.unpack("<i", hashlib.md5(operation.encode()).digest()[:4])[0]
        body = Cdr(self.id).put("iI", self.sequence >> 32, self.sequence & 0xFFFFFFFF)
        return body.put_text("").put("i", number)

    def call(self, body, seconds=1.0, type_hash=0):
        """Sends a request and waits for its answer: what follows the envelope of the answer."""
        end, pending = time.monotonic() + seconds, self.send(body, type_hash)
        while True:
            # In this order: the server may answer, and let go of the request, in between.
            held = pending.is_connected
            if (answer := pending.receive()) is not None:
                break
            if not held or time.monotonic() > end:
                raise TimeoutError("no reply" if held else "the server took the request and sent no reply")
            self.ear.timed_wait(iox.Duration.from_millis(50))
        reply = Cdr(bytes(answer.payload().as_memory_view()))
        reply.at = 16
        sequence = reply.get("i") << 32 | reply.get("I")
        outcome, operation = reply.get("i"), reply.get("i")
        if outcome != 0:
            reply.get("B")
            raise Refused(f"{OUTCOMES[outcome]}: {reply.get_text()}")
        assert (bytes(reply.data[:16]), sequence) == (self.id, self.sequence), "it answers another request"
        if (exception := reply.get("i")) != 0:
            raise Refused(f"an exception with the hash {exception & 0xFFFFFFFF:08x}")
        return reply
