"""Asks the herald everything: ask.py NETWORK DOMAIN."""

import sys
from dataclasses import dataclass

from cyclonedds.idl import IdlStruct, IdlUnion
from cyclonedds.idl.annotations import final
from cyclonedds.idl.types import case, int32

from herald import (
    Herald_Call, Herald_Reply, Herald_Request, Herald_consult_In, Herald_note_In, Herald_shift_In, Kind, Mark, Nothing,
    Point, Report,
)
from network import Client, Network
from rpc import RequestHeader


@final
class Newer_Call(IdlUnion, discriminator=int32, typename="RcHerald.Herald_Call"):
    """That of a herald which can do more."""

    sing: case[77, Nothing]


@dataclass
@final
class Newer_Request(IdlStruct, typename="RcHerald.Herald_Request"):
    header: RequestHeader
    data: Newer_Call


def say(reply):
    print(reply.header.remoteEx.name, reply.data)


network, domain = sys.argv[1:]
herald = Client(Network(network, domain), "Herald", Herald_Request, Herald_Reply)
marks = [Mark("a", Point(1.0, 2.0)), Mark("", Point(0.0, 0.0))]
report = Report(1 << 40, "ä", [1.5], Kind.person, Point(0.5, 0.25), marks)
bare = Report(0, "bare", [], Kind.wall, Point(0.0, 0.0), [])
say(herald.call(Herald_Call(shift=Herald_shift_In(report, 0.5))))
say(herald.call(Herald_Call(shift=Herald_shift_In(bare, 0.5))))
say(herald.call(Herald_Call(note=Herald_note_In("from Python"))))
say(herald.call(Herald_Call(noted=Nothing())))
newer = Client(Network(network, domain), "Herald", Newer_Request, Herald_Reply)
say(newer.call(Newer_Call(sing=Nothing())))
