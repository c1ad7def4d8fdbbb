"""The types of the exported Interop.idl, by hand."""

from dataclasses import dataclass

from cyclonedds.idl import IdlEnum, IdlStruct, IdlUnion
from cyclonedds.idl.annotations import final
from cyclonedds.idl.types import case, default, float32, float64, int32, int64, sequence, uint8

from rpc import ReplyHeader, RequestHeader


class Kind(IdlEnum, typename="RcInterop.Kind", default="wall"):
    wall = 0
    door = 7
    person = 8


@dataclass
@final
class Point(IdlStruct, typename="RcInterop.Point"):
    x: float32
    y: float64


@dataclass
@final
class Mark(IdlStruct, typename="RcInterop.Mark"):
    name: str
    at: Point


@dataclass
@final
class Scores_entry(IdlStruct, typename="RcInterop.Scores_entry"):
    key: str
    value: float64


@dataclass
@final
class Report(IdlStruct, typename="RcInterop.Report"):
    number: int64
    text: str
    data: sequence[uint8]
    ranges: sequence[float64]
    kind: Kind
    origin: Point
    marks: sequence[Mark]
    scores: sequence[Scores_entry]


@dataclass
@final
class Nonsense(IdlStruct, typename="RcInterop.Nonsense"):
    what: str
    code: int32


@dataclass
@final
class Reports_report(IdlStruct, typename="RcInterop.Reports_report"):
    report: Report


@dataclass
@final
class Echoes_echo(IdlStruct, typename="RcInterop.Echoes_echo"):
    report: Report


@dataclass
@final
class Orders_order(IdlStruct, typename="RcInterop.Orders_order"):
    text: str


@dataclass
@final
class Archive_keep(IdlStruct, typename="RcInterop.Archive_keep"):
    text: str


@dataclass
@final
class Nothing(IdlStruct, typename="RcInterop.Nothing"):
    """The member of a structure without parameters."""

    dummy: uint8 = 0


@dataclass
@final
class Interop_shift_In(IdlStruct, typename="RcInterop.Interop_shift_In"):
    report: Report
    by: float64


@dataclass
@final
class Interop_shift_Out(IdlStruct, typename="RcInterop.Interop_shift_Out"):
    count: int32
    return_: Report


@final
class Interop_shift_Result(IdlUnion, discriminator=int32, typename="RcInterop.Interop_shift_Result"):
    unknownEx: default[uint8]
    result: case[0, Interop_shift_Out]
    nonsense_ex: case[-1352687754, Nonsense]


@dataclass
@final
class Interop_note_In(IdlStruct, typename="RcInterop.Interop_note_In"):
    text: str


@final
class Interop_note_Result(IdlUnion, discriminator=int32, typename="RcInterop.Interop_note_Result"):
    unknownEx: default[uint8]
    result: case[0, Nothing]


@dataclass
@final
class Interop_noted_Out(IdlStruct, typename="RcInterop.Interop_noted_Out"):
    return_: sequence[str]


@final
class Interop_noted_Result(IdlUnion, discriminator=int32, typename="RcInterop.Interop_noted_Result"):
    unknownEx: default[uint8]
    result: case[0, Interop_noted_Out]


@dataclass
@final
class Interop_consult_In(IdlStruct, typename="RcInterop.Interop_consult_In"):
    question: str
    limit: int32


@dataclass
@final
class Interop_consult_Out(IdlStruct, typename="RcInterop.Interop_consult_Out"):
    return_: str


@final
class Interop_consult_Result(IdlUnion, discriminator=int32, typename="RcInterop.Interop_consult_Result"):
    unknownEx: default[uint8]
    result: case[0, Interop_consult_Out]


@dataclass
@final
class Interop_add_In(IdlStruct, typename="RcInterop.Interop_add_In"):
    a: int64
    b: int64


@dataclass
@final
class Interop_add_Out(IdlStruct, typename="RcInterop.Interop_add_Out"):
    return_: int64


@final
class Interop_add_Result(IdlUnion, discriminator=int32, typename="RcInterop.Interop_add_Result"):
    unknownEx: default[uint8]
    result: case[0, Interop_add_Out]


@final
class Interop_Call(IdlUnion, discriminator=int32, typename="RcInterop.Interop_Call"):
    unknownOp: default[uint8]
    shift: case[1313846826, Interop_shift_In]
    note: case[-900475222, Interop_note_In]
    noted: case[1175885854, Nothing]
    consult: case[3440400, Interop_consult_In]
    add: case[-59184076, Interop_add_In]


@final
class Interop_Return(IdlUnion, discriminator=int32, typename="RcInterop.Interop_Return"):
    unknownOp: default[uint8]
    shift: case[1313846826, Interop_shift_Result]
    note: case[-900475222, Interop_note_Result]
    noted: case[1175885854, Interop_noted_Result]
    consult: case[3440400, Interop_consult_Result]
    add: case[-59184076, Interop_add_Result]


@dataclass
@final
class Interop_Request(IdlStruct, typename="RcInterop.Interop_Request"):
    header: RequestHeader
    data: Interop_Call


@dataclass
@final
class Interop_Reply(IdlStruct, typename="RcInterop.Interop_Reply"):
    header: ReplyHeader
    data: Interop_Return


@dataclass
@final
class Oracle_ask_In(IdlStruct, typename="RcInterop.Oracle_ask_In"):
    question: str


@dataclass
@final
class Oracle_ask_Out(IdlStruct, typename="RcInterop.Oracle_ask_Out"):
    place: Point
    return_: int64


@final
class Oracle_ask_Result(IdlUnion, discriminator=int32, typename="RcInterop.Oracle_ask_Result"):
    unknownEx: default[uint8]
    result: case[0, Oracle_ask_Out]
    nonsense_ex: case[-1352687754, Nonsense]


@dataclass
@final
class Oracle_tell_In(IdlStruct, typename="RcInterop.Oracle_tell_In"):
    text: str


@final
class Oracle_tell_Result(IdlUnion, discriminator=int32, typename="RcInterop.Oracle_tell_Result"):
    unknownEx: default[uint8]
    result: case[0, Nothing]


@final
class Oracle_Call(IdlUnion, discriminator=int32, typename="RcInterop.Oracle_Call"):
    unknownOp: default[uint8]
    ask: case[1883231070, Oracle_ask_In]
    tell: case[1022105598, Oracle_tell_In]


@final
class Oracle_Return(IdlUnion, discriminator=int32, typename="RcInterop.Oracle_Return"):
    unknownOp: default[uint8]
    ask: case[1883231070, Oracle_ask_Result]
    tell: case[1022105598, Oracle_tell_Result]


@dataclass
@final
class Oracle_Request(IdlStruct, typename="RcInterop.Oracle_Request"):
    header: RequestHeader
    data: Oracle_Call


@dataclass
@final
class Oracle_Reply(IdlStruct, typename="RcInterop.Oracle_Reply"):
    header: ReplyHeader
    data: Oracle_Return
