"""The types of the exported Herald.idl, by hand."""

from dataclasses import dataclass

from cyclonedds.idl import IdlEnum, IdlStruct, IdlUnion
from cyclonedds.idl.annotations import final
from cyclonedds.idl.types import case, default, float32, float64, int32, int64, sequence, uint8

from rpc import ReplyHeader, RequestHeader


class Kind(IdlEnum, typename="RcHerald.Kind", default="wall"):
    wall = 0
    door = 7
    person = 8


@dataclass
@final
class Point(IdlStruct, typename="RcHerald.Point"):
    x: float32
    y: float64


@dataclass
@final
class Mark(IdlStruct, typename="RcHerald.Mark"):
    name: str
    at: Point


@dataclass
@final
class Report(IdlStruct, typename="RcHerald.Report"):
    number: int64
    text: str
    ranges: sequence[float64]
    kind: Kind
    origin: Point
    marks: sequence[Mark]


@dataclass
@final
class Nonsense(IdlStruct, typename="RcHerald.Nonsense"):
    what: str
    code: int32


@dataclass
@final
class Reports_report(IdlStruct, typename="RcHerald.Reports_report"):
    report: Report


@dataclass
@final
class Echoes_echo(IdlStruct, typename="RcHerald.Echoes_echo"):
    report: Report


@dataclass
@final
class Orders_order(IdlStruct, typename="RcHerald.Orders_order"):
    text: str


@dataclass
@final
class Archive_keep(IdlStruct, typename="RcHerald.Archive_keep"):
    text: str


@dataclass
@final
class Nothing(IdlStruct, typename="RcHerald.Nothing"):
    """What stands for parameters where there are none."""

    dummy: uint8 = 0


@dataclass
@final
class Herald_shift_In(IdlStruct, typename="RcHerald.Herald_shift_In"):
    report: Report
    by: float64


@dataclass
@final
class Herald_shift_Out(IdlStruct, typename="RcHerald.Herald_shift_Out"):
    count: int32
    return_: Report


@final
class Herald_shift_Result(IdlUnion, discriminator=int32, typename="RcHerald.Herald_shift_Result"):
    unknownEx: default[uint8]
    result: case[0, Herald_shift_Out]
    nonsense_ex: case[-1352687754, Nonsense]


@dataclass
@final
class Herald_note_In(IdlStruct, typename="RcHerald.Herald_note_In"):
    text: str


@final
class Herald_note_Result(IdlUnion, discriminator=int32, typename="RcHerald.Herald_note_Result"):
    unknownEx: default[uint8]
    result: case[0, Nothing]


@dataclass
@final
class Herald_noted_Out(IdlStruct, typename="RcHerald.Herald_noted_Out"):
    return_: sequence[str]


@final
class Herald_noted_Result(IdlUnion, discriminator=int32, typename="RcHerald.Herald_noted_Result"):
    unknownEx: default[uint8]
    result: case[0, Herald_noted_Out]


@dataclass
@final
class Herald_consult_In(IdlStruct, typename="RcHerald.Herald_consult_In"):
    question: str
    limit: int32


@dataclass
@final
class Herald_consult_Out(IdlStruct, typename="RcHerald.Herald_consult_Out"):
    return_: str


@final
class Herald_consult_Result(IdlUnion, discriminator=int32, typename="RcHerald.Herald_consult_Result"):
    unknownEx: default[uint8]
    result: case[0, Herald_consult_Out]


@final
class Herald_Call(IdlUnion, discriminator=int32, typename="RcHerald.Herald_Call"):
    unknownOp: default[uint8]
    shift: case[1313846826, Herald_shift_In]
    note: case[-900475222, Herald_note_In]
    noted: case[1175885854, Nothing]
    consult: case[3440400, Herald_consult_In]


@final
class Herald_Return(IdlUnion, discriminator=int32, typename="RcHerald.Herald_Return"):
    unknownOp: default[uint8]
    shift: case[1313846826, Herald_shift_Result]
    note: case[-900475222, Herald_note_Result]
    noted: case[1175885854, Herald_noted_Result]
    consult: case[3440400, Herald_consult_Result]


@dataclass
@final
class Herald_Request(IdlStruct, typename="RcHerald.Herald_Request"):
    header: RequestHeader
    data: Herald_Call


@dataclass
@final
class Herald_Reply(IdlStruct, typename="RcHerald.Herald_Reply"):
    header: ReplyHeader
    data: Herald_Return


@dataclass
@final
class Oracle_ask_In(IdlStruct, typename="RcHerald.Oracle_ask_In"):
    question: str


@dataclass
@final
class Oracle_ask_Out(IdlStruct, typename="RcHerald.Oracle_ask_Out"):
    place: Point
    return_: int64


@final
class Oracle_ask_Result(IdlUnion, discriminator=int32, typename="RcHerald.Oracle_ask_Result"):
    unknownEx: default[uint8]
    result: case[0, Oracle_ask_Out]
    nonsense_ex: case[-1352687754, Nonsense]


@dataclass
@final
class Oracle_tell_In(IdlStruct, typename="RcHerald.Oracle_tell_In"):
    text: str


@final
class Oracle_tell_Result(IdlUnion, discriminator=int32, typename="RcHerald.Oracle_tell_Result"):
    unknownEx: default[uint8]
    result: case[0, Nothing]


@final
class Oracle_Call(IdlUnion, discriminator=int32, typename="RcHerald.Oracle_Call"):
    unknownOp: default[uint8]
    ask: case[1883231070, Oracle_ask_In]
    tell: case[1022105598, Oracle_tell_In]


@final
class Oracle_Return(IdlUnion, discriminator=int32, typename="RcHerald.Oracle_Return"):
    unknownOp: default[uint8]
    ask: case[1883231070, Oracle_ask_Result]
    tell: case[1022105598, Oracle_tell_Result]


@dataclass
@final
class Oracle_Request(IdlStruct, typename="RcHerald.Oracle_Request"):
    header: RequestHeader
    data: Oracle_Call


@dataclass
@final
class Oracle_Reply(IdlStruct, typename="RcHerald.Oracle_Reply"):
    header: ReplyHeader
    data: Oracle_Return
