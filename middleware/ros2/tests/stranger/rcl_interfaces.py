"""The messages of `rcl_interfaces` about parameters, and a client of the parameter services of another node.

It is that of a node of ROS 2 on Cyclone DDS, with the package `cyclonedds` 11.0.1 and nothing else: in that mapping `guid` and `seq`
stand before what a request or a response holds, who asked, and its how manieth request it was."""

import random
import sys
from dataclasses import dataclass, field, make_dataclass
from pathlib import Path

# The programs over DDS use the same module.
sys.path.append(str(Path(__file__).parents[3] / "dds/tests/stranger"))

from cyclonedds.idl import IdlStruct
from cyclonedds.idl.annotations import final
from cyclonedds.idl.types import byte, float64, int32, int64, sequence, uint8, uint32, uint64
from cyclonedds.pub import DataWriter
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic

from network import met, qos


@dataclass
@final
class ParameterValue(IdlStruct, typename="rcl_interfaces::msg::dds_::ParameterValue_"):
    type: uint8 = 0
    bool_value: bool = False
    integer_value: int64 = 0
    double_value: float64 = 0.0
    string_value: str = ""
    byte_array_value: sequence[byte] = field(default_factory=list)
    bool_array_value: sequence[bool] = field(default_factory=list)
    integer_array_value: sequence[int64] = field(default_factory=list)
    double_array_value: sequence[float64] = field(default_factory=list)
    string_array_value: sequence[str] = field(default_factory=list)


@dataclass
@final
class Parameter(IdlStruct, typename="rcl_interfaces::msg::dds_::Parameter_"):
    name: str
    value: ParameterValue


@dataclass
@final
class Time(IdlStruct, typename="builtin_interfaces::msg::dds_::Time_"):
    sec: int32
    nanosec: uint32


@dataclass
@final
class ParameterEvent(IdlStruct, typename="rcl_interfaces::msg::dds_::ParameterEvent_"):
    stamp: Time
    node: str
    new_parameters: sequence[Parameter]
    changed_parameters: sequence[Parameter]
    deleted_parameters: sequence[Parameter]


@dataclass
@final
class FloatingPointRange(IdlStruct, typename="rcl_interfaces::msg::dds_::FloatingPointRange_"):
    from_value: float64
    to_value: float64
    step: float64


@dataclass
@final
class IntegerRange(IdlStruct, typename="rcl_interfaces::msg::dds_::IntegerRange_"):
    from_value: int64
    to_value: int64
    step: uint64


@dataclass
@final
class ParameterDescriptor(IdlStruct, typename="rcl_interfaces::msg::dds_::ParameterDescriptor_"):
    name: str
    type: uint8
    description: str
    additional_constraints: str
    read_only: bool
    dynamic_typing: bool
    floating_point_range: sequence[FloatingPointRange, 1]
    integer_range: sequence[IntegerRange, 1]


@dataclass
@final
class ListParametersResult(IdlStruct, typename="rcl_interfaces::msg::dds_::ListParametersResult_"):
    names: sequence[str]
    prefixes: sequence[str]


@dataclass
@final
class SetParametersResult(IdlStruct, typename="rcl_interfaces::msg::dds_::SetParametersResult_"):
    successful: bool
    reason: str


def part(service, which, **fields):
    """The type of a request or a response."""
    typename = f"rcl_interfaces::srv::dds_::{service}_{which}_"
    fields = [("guid", uint64), ("seq", int64), *fields.items()]
    made = make_dataclass(f"{service}_{which}", fields, bases=(IdlStruct,), namespace={"__module__": __name__})
    made.__idl_typename__ = typename
    made.__idl__.idl_transformed_typename = typename
    return final(made)


class Service:
    """Calls a service of a node."""

    def __init__(self, here, node, name, service, request, response):
        self.here, self.request, self.sequence = here, part(service, "Request", **request), 0
        self.guid = random.getrandbits(64)
        response = part(service, "Response", **response)
        self.replies = DataReader(here.member, Topic(here.member, f"rr{node}/{name}Reply", response), qos())
        self.requests = DataWriter(here.member, Topic(here.member, f"rq{node}/{name}Request", self.request), qos())
        met(self.requests, self.replies)

    def call(self, *fields):
        self.sequence += 1
        self.requests.write(self.request(self.guid, self.sequence, *fields))
        for reply in self.here.values(self.replies):
            if (reply.guid, reply.seq) == (self.guid, self.sequence):
                return reply
        raise TimeoutError("no response")


def number(name, value):
    """A parameter with a floating-point value."""
    return Parameter(name, ParameterValue(type=3, double_value=value))


def texts(name, *values):
    """A parameter that is an array of texts."""
    return Parameter(name, ParameterValue(type=9, string_array_value=list(values)))


def setting(here, node):
    """The clients that set parameters, one at a time and atomically."""
    given = {"parameters": sequence[Parameter]}
    return (
        Service(here, node, "set_parameters", "SetParameters", given, {"results": sequence[SetParametersResult]}),
        Service(here, node, "set_parameters_atomically", "SetParametersAtomically", given, {"result": SetParametersResult}),
    )
