"""The types of the exported Exported.idl, by hand, with the package cyclonedds alone.

stranger.py write: prints samples, a name and the bytes of each.
stranger.py read: checks samples on standard input, which a component wrote.
"""

import sys
from dataclasses import dataclass
from pathlib import Path

from cyclonedds.idl import IdlEnum, IdlStruct, IdlUnion
from cyclonedds.idl.annotations import final
from cyclonedds.idl.types import (
    array, bounded_str, case, default, float32, float64, int8, int16, int32, int64, sequence, uint8, uint16, uint32,
    uint64,
)

sys.path.insert(0, str(Path(__file__).resolve().parents[4] / "middleware/dds/tests/stranger"))
from rpc import (  # noqa: E402
    EntityId_t, GUID_t, RemoteExceptionCode_t, ReplyHeader, RequestHeader, SampleIdentity, SequenceNumber_t,
)


class Mode(IdlEnum, typename="Exported.Mode", default="Idle"):
    Idle = 0
    Fast = 5
    Slow = 9


@dataclass
@final
class Nothing(IdlStruct, typename="Exported.Nothing"):
    dummy: uint8 = 0


@dataclass
@final
class Point(IdlStruct, typename="Exported.Point"):
    x: float32
    y: float64


@dataclass
@final
class Places_Entry(IdlStruct, typename="Exported.Places_Entry"):
    key: str
    value: Point


@dataclass
@final
class Counts_Entry(IdlStruct, typename="Exported.Counts_Entry"):
    key: Mode
    value: int16


@dataclass
@final
class Reading(IdlStruct, typename="Exported.Reading"):
    valid: bool
    raw: uint8
    s: int16
    i: int32
    l: int64
    f: float32
    d: float64
    i8: int8
    u16: uint16
    u32: uint32
    u64: uint64
    frame: bounded_str[16]
    text: str
    ranges: sequence[float64]
    mode: Mode
    balance: int32
    origin: Point
    path: sequence[Point, 8]
    places: sequence[Places_Entry]
    counts: sequence[Counts_Entry]
    count: sequence[int32, 1]
    goal: sequence[Point, 1]
    matrix: array[float32, 3]
    tags: array[bounded_str[4], 2]
    corners: array[Point, 2]
    rows: sequence[sequence[int16, 3], 4]
    flags: sequence[bool]
    modes: sequence[Mode]
    nothing: Nothing
    last: uint8


@dataclass
@final
class Busy(IdlStruct, typename="Exported.Busy"):
    level: uint8
    who: str
    seconds: float64


@dataclass
@final
class Gone(IdlStruct, typename="Exported.Gone"):
    dummy: uint8 = 0


@dataclass
@final
class News_told(IdlStruct, typename="Exported.News_told"):
    reading: Reading
    tail: uint8


@dataclass
@final
class News_nothing(IdlStruct, typename="Exported.News_nothing"):
    dummy: uint8 = 0


# The calls of Desk


@dataclass
@final
class Desk_ask_In(IdlStruct, typename="Exported.Desk_ask_In"):
    reading: Reading
    who: bounded_str[8]
    mode: sequence[Mode, 1]


@dataclass
@final
class Desk_ask_Out(IdlStruct, typename="Exported.Desk_ask_Out"):
    raw: sequence[uint8]
    return_: Reading


@final
class Desk_ask_Result(IdlUnion, discriminator=int32, typename="Exported.Desk_ask_Result"):
    unknownEx: default[uint8]
    result: case[0, Desk_ask_Out]
    busy_ex: case[-280843816, Busy]
    gone_ex: case[863717643, Gone]


@dataclass
@final
class Desk_turn_In(IdlStruct, typename="Exported.Desk_turn_In"):
    speed: float64


@dataclass
@final
class Nothing_Out(IdlStruct, typename="Exported.Desk_turn_Out"):
    dummy: uint8 = 0


@final
class Desk_turn_Result(IdlUnion, discriminator=int32, typename="Exported.Desk_turn_Result"):
    unknownEx: default[uint8]
    result: case[0, Nothing_Out]


@final
class Desk_Call(IdlUnion, discriminator=int32, typename="Exported.Desk_Call"):
    unknownOp: default[uint8]
    ask: case[1883231070, Desk_ask_In]
    turn: case[2093043880, Desk_turn_In]
    rest: case[192997477, Nothing_Out]


@final
class Desk_Return(IdlUnion, discriminator=int32, typename="Exported.Desk_Return"):
    unknownOp: default[uint8]
    ask: case[1883231070, Desk_ask_Result]
    turn: case[2093043880, Desk_turn_Result]
    rest: case[192997477, Desk_turn_Result]


@dataclass
@final
class Desk_Request(IdlStruct, typename="Exported.Desk_Request"):
    header: RequestHeader
    data: Desk_Call


@dataclass
@final
class Desk_Reply(IdlStruct, typename="Exported.Desk_Reply"):
    header: ReplyHeader
    data: Desk_Return


READING = Reading(
    valid=True, raw=200, s=-2, i=-70000, l=-(1 << 40), f=0.5, d=-0.1, i8=-128, u16=65535, u32=4000000000,
    u64=(1 << 64) - 1, frame="base/lidar", text="größer als 5 €", ranges=[1.0, 2.5, -3.25], mode=Mode.Fast, balance=-1,
    origin=Point(1.5, -2.5), path=[Point(0.25, 1.0), Point(0.5, 2.0)],
    places=[Places_Entry("dock", Point(1.0, 2.0)), Places_Entry("door", Point(3.0, 4.0))],
    counts=[Counts_Entry(Mode.Idle, 1), Counts_Entry(Mode.Slow, -1)], count=[7], goal=[], matrix=[1.0, 2.0, 3.0],
    tags=["ab", ""], corners=[Point(0.0, 0.0), Point(8.0, 9.0)], rows=[[1, 2, 3], [], [-1]], flags=[True, False, True],
    modes=[Mode.Slow, Mode.Idle], nothing=Nothing(), last=255)


def identity(number):
    """The request of a stranger; a component chooses its own."""
    guid = GUID_t(list(range(1, 13)), EntityId_t([13, 14, 15], 16))
    return SampleIdentity(guid, SequenceNumber_t(1, number))


def request(number, **call):
    return Desk_Request(RequestHeader(identity(number), ""), Desk_Call(**call))


def reply(number, **returned):
    header = ReplyHeader(identity(number), RemoteExceptionCode_t.REMOTE_EX_OK)
    return Desk_Reply(header, Desk_Return(**returned))


SAMPLES = {
    "topic": News_told(READING, 77),
    "empty-topic": News_nothing(),
    "request": request(1, ask=Desk_ask_In(READING, "stranger", [Mode.Slow])),
    "reply": reply(1, ask=Desk_ask_Result(result=Desk_ask_Out([1, 2, 3], READING))),
    "refused-request": request(2, ask=Desk_ask_In(READING, "busy", [])),
    "refused-reply": reply(2, ask=Desk_ask_Result(busy_ex=Busy(3, "me", 1.5))),
    "gone-request": request(3, ask=Desk_ask_In(READING, "gone", [])),
    "gone-reply": reply(3, ask=Desk_ask_Result(gone_ex=Gone())),
    "command": request(4, turn=Desk_turn_In(-0.5)),
    "rest-request": request(5, rest=Nothing_Out()),
    "unknown-request": request(6, discriminator=99, value=0),
    "rest-reply": reply(5, rest=Desk_turn_Result(result=Nothing_Out())),
}
# The four bytes before a body that say how it is encoded: XCDR1, little endian.
HEAD = bytes([0, 1, 0, 0])


def body(sample):
    written = sample.serialize(use_version_2=False)
    assert written[:2] == HEAD[:2], written[:4]
    return written[4:]


if sys.argv[1] == "write":
    for name, sample in SAMPLES.items():
        print(name, body(sample).hex())
else:
    for line in sys.stdin:
        name, text = line.split()
        if name == "unknown-reply":
            # The reason stands behind what the type has.
            found = Desk_Reply.deserialize(HEAD + bytes.fromhex(text))
            assert bytes.fromhex(text)[:24] == body(SAMPLES["unknown-request"])[:24], found
            assert found.header.remoteEx == RemoteExceptionCode_t.REMOTE_EX_UNKNOWN_OPERATION, found
            assert found.data.unknownOp == 0, found
            continue
        expected = SAMPLES[name]
        found = type(expected).deserialize(HEAD + bytes.fromhex(text))
        # A component that asks has an identity of its own.
        if name.endswith("request") or name == "command":
            found.header.requestId = expected.header.requestId
        assert body(found) == body(expected), f"{name}\n{found}\n{expected}"
        print(name)
