"""Lists, describes, gets and sets the parameters of a node, as `ros2 param` does: parameters.py NETWORK DOMAIN NODE."""

import sys

from rcl_interfaces import (
    ListParametersResult, Parameter, ParameterDescriptor, ParameterValue, Service, number, setting, texts,
)

from cyclonedds.idl.types import sequence, uint8, uint64
from network import Network

network, domain, node = sys.argv[1:]
here = Network(network, domain)
names = {"names": sequence[str]}
lists = Service(
    here, node, "list_parameters", "ListParameters",
    {"prefixes": sequence[str], "depth": uint64}, {"result": ListParametersResult},
)
describes = Service(
    here, node, "describe_parameters", "DescribeParameters", names, {"descriptors": sequence[ParameterDescriptor]}
)
types = Service(here, node, "get_parameter_types", "GetParameterTypes", names, {"types": sequence[uint8]})
gets = Service(here, node, "get_parameters", "GetParameters", names, {"values": sequence[ParameterValue]})
sets, atomic = setting(here, node)

listed = lists.call([], 0).result
print("list", *listed.names, "in", *listed.prefixes)
for told in describes.call(listed.names).descriptors:
    ranges = [(r.from_value, r.to_value) for r in [*told.floating_point_range, *told.integer_range]]
    print("describe", told.name, told.type, told.description, "|", told.additional_constraints, told.read_only, *ranges)
print("types", *types.call(listed.names).types)


def value(name):
    return gets.call([name]).values[0]


print("get", value("speed").double_value, value("count").integer_value, value("arm.joints").string_array_value)

whole = Parameter("count", ParameterValue(type=2, integer_value=8))
results = sets.call([number("speed", 2.5), number("speed", 11.0), whole]).results
for result in results:
    print("set", result.successful, result.reason)
together = [number("speed", 3.5), texts("arm.joints", "x", "y", "z")]
print("set", atomic.call(together).result.successful)
print("get", value("speed").double_value, value("arm.joints").string_array_value)
