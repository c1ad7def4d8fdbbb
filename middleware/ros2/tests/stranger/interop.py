"""The types of the exported Interop.idsl and two of ROS 2's own, by hand, as a node of ROS 2 on Cyclone DDS has them."""

from dataclasses import dataclass, field

from cyclonedds.idl import IdlStruct
from cyclonedds.idl.annotations import final
from cyclonedds.idl.types import float32, float64, int32, int64, sequence, uint8, uint64

WALL, DOOR, PERSON = 0, 7, 8
OK, NONSENSE = 0, 1


@dataclass
@final
class String(IdlStruct, typename="std_msgs::msg::dds_::String_"):
    data: str


@dataclass
@final
class Point(IdlStruct, typename="interop_msgs::msg::dds_::Point_"):
    x: float32 = 0.0
    y: float64 = 0.0


@dataclass
@final
class Mark(IdlStruct, typename="interop_msgs::msg::dds_::Mark_"):
    name: str
    at: Point


@dataclass
@final
class ScoresEntry(IdlStruct, typename="interop_msgs::msg::dds_::ScoresEntry_"):
    key: str
    value: float64


@dataclass
@final
class Report(IdlStruct, typename="interop_msgs::msg::dds_::Report_"):
    number: int64 = 0
    text: str = ""
    data: sequence[uint8] = field(default_factory=list)
    ranges: sequence[float64] = field(default_factory=list)
    kind: int32 = WALL
    origin: Point = field(default_factory=Point)
    marks: sequence[Mark] = field(default_factory=list)
    scores: sequence[ScoresEntry] = field(default_factory=list)


@dataclass
@final
class Nonsense(IdlStruct, typename="interop_msgs::msg::dds_::Nonsense_"):
    what: str = ""
    code: int32 = 0


@dataclass
@final
class OrdersOrder(IdlStruct, typename="interop_msgs::msg::dds_::OrdersOrder_"):
    text: str


@dataclass
@final
class ArchiveKeep(IdlStruct, typename="interop_msgs::msg::dds_::ArchiveKeep_"):
    text: str


# In the mapping of Cyclone DDS, `guid` and `seq` precede the fields of a request or a response: the client, and the
# number of its request.


@dataclass
@final
class InteropShift_Request(IdlStruct, typename="interop_msgs::srv::dds_::InteropShift_Request_"):
    guid: uint64
    seq: int64
    report: Report
    by: float64


@dataclass
@final
class InteropShift_Response(IdlStruct, typename="interop_msgs::srv::dds_::InteropShift_Response_"):
    guid: uint64
    seq: int64
    code: int32
    nonsense: Nonsense
    count: int32
    result: Report


@dataclass
@final
class InteropNote_Request(IdlStruct, typename="interop_msgs::srv::dds_::InteropNote_Request_"):
    guid: uint64
    seq: int64
    text: str


@dataclass
@final
class InteropNote_Response(IdlStruct, typename="interop_msgs::srv::dds_::InteropNote_Response_"):
    guid: uint64
    seq: int64
    structure_needs_at_least_one_member: uint8


@dataclass
@final
class InteropNoted_Request(IdlStruct, typename="interop_msgs::srv::dds_::InteropNoted_Request_"):
    guid: uint64
    seq: int64
    structure_needs_at_least_one_member: uint8 = 0


@dataclass
@final
class InteropNoted_Response(IdlStruct, typename="interop_msgs::srv::dds_::InteropNoted_Response_"):
    guid: uint64
    seq: int64
    result: sequence[str]


@dataclass
@final
class InteropConsult_Request(IdlStruct, typename="interop_msgs::srv::dds_::InteropConsult_Request_"):
    guid: uint64
    seq: int64
    question: str
    limit: int32


@dataclass
@final
class InteropConsult_Response(IdlStruct, typename="interop_msgs::srv::dds_::InteropConsult_Response_"):
    guid: uint64
    seq: int64
    result: str


@dataclass
@final
class AddTwoInts_Request(IdlStruct, typename="example_interfaces::srv::dds_::AddTwoInts_Request_"):
    guid: uint64
    seq: int64
    a: int64
    b: int64


@dataclass
@final
class AddTwoInts_Response(IdlStruct, typename="example_interfaces::srv::dds_::AddTwoInts_Response_"):
    guid: uint64
    seq: int64
    sum: int64


@dataclass
@final
class OracleAsk_Request(IdlStruct, typename="interop_msgs::srv::dds_::OracleAsk_Request_"):
    guid: uint64
    seq: int64
    question: str


@dataclass
@final
class OracleAsk_Response(IdlStruct, typename="interop_msgs::srv::dds_::OracleAsk_Response_"):
    guid: uint64
    seq: int64
    code: int32
    nonsense: Nonsense
    place: Point
    result: int64


@dataclass
@final
class OracleTell_Request(IdlStruct, typename="interop_msgs::srv::dds_::OracleTell_Request_"):
    guid: uint64
    seq: int64
    text: str


@dataclass
@final
class OracleTell_Response(IdlStruct, typename="interop_msgs::srv::dds_::OracleTell_Response_"):
    guid: uint64
    seq: int64
    structure_needs_at_least_one_member: uint8 = 0
