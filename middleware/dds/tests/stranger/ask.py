"""Calls each operation of the component: ask.py NETWORK DOMAIN."""

import sys
from dataclasses import dataclass

from cyclonedds.idl import IdlStruct, IdlUnion
from cyclonedds.idl.annotations import final
from cyclonedds.idl.types import case, int32

from interop import (
    Interop_Call, Interop_Reply, Interop_Request, Interop_consult_In, Interop_note_In, Interop_shift_In, Kind, Mark, Nothing,
    Point, Report, Scores_entry,
)
from network import Client, Network
from rpc import RequestHeader


@final
class Newer_Call(IdlUnion, discriminator=int32, typename="RcInterop.Interop_Call"):
    """A request of an operation that the component does not have."""

    sing: case[77, Nothing]


@dataclass
@final
class Newer_Request(IdlStruct, typename="RcInterop.Interop_Request"):
    header: RequestHeader
    data: Newer_Call


def say(reply):
    print(reply.header.remoteEx.name, reply.data)


network, domain = sys.argv[1:]
interop = Client(Network(network, domain), "Interop", Interop_Request, Interop_Reply)
marks = [Mark("a", Point(1.0, 2.0)), Mark("", Point(0.0, 0.0))]
report = Report(1 << 40, "ä", [1, 255], [1.5], Kind.person, Point(0.5, 0.25), marks, [Scores_entry("b", -1.0)])
bare = Report(0, "bare", [], [], Kind.wall, Point(0.0, 0.0), [], [])
say(interop.call(Interop_Call(shift=Interop_shift_In(report, 0.5))))
say(interop.call(Interop_Call(shift=Interop_shift_In(bare, 0.5))))
say(interop.call(Interop_Call(note=Interop_note_In("from Python"))))
say(interop.call(Interop_Call(noted=Nothing())))
newer = Client(Network(network, domain), "Interop", Newer_Request, Interop_Reply)
say(newer.call(Newer_Call(sing=Nothing())))
