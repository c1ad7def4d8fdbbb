"""Lists, describes, gets and sets the parameters of the component as `ros2 param` does: parameters.py NETWORK DOMAIN"""

from peer import Peer, say
from rclpy.parameter import Parameter, parameter_value_to_python
from rclpy.parameter_client import AsyncParameterClient

peer = Peer("parameters")
client = AsyncParameterClient(peer.node, peer.full("interop"))
peer.until("the services are found", client.services_are_ready)
names = peer.result(client.list_parameters([], 0)).result.names
say("listed", len(names))
# All of them in one request and one reply.
described = peer.result(client.describe_parameters(names)).descriptors
values = peer.result(client.get_parameters(names)).values
types = peer.result(client.get_parameter_types(names)).types
assert [one.name for one in described] == names
assert [one.type for one in described] == list(types) == [value.type for value in values]
say("described", len(described), "read", len(values))
for name, about, value in zip(names, described, values):
    if not name.startswith("wheels"):
        ranges = [(r.from_value, r.to_value) for r in [*about.floating_point_range, *about.integer_range]]
        say(name, parameter_value_to_python(value), about.read_only, *ranges)


def change(name, value):
    result = peer.result(client.set_parameters([Parameter(name, value=value)])).results[0]
    say("set", name, result.successful, result.reason)


change("speed", 2.5)
change("speed", 11.0)
change("count", 8)
together = [Parameter("speed", value=3.5), Parameter("arm.joints", value=["x", "y"])]
say("set", peer.result(client.set_parameters_atomically(together)).result.successful)
now = peer.result(client.get_parameters(["speed", "arm.joints"])).values
say("now", *[parameter_value_to_python(value) for value in now])
