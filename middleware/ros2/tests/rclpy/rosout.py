"""Sets a parameter of the component, and prints the log of the component on /rosout: rosout.py NETWORK DOMAIN"""

from peer import Peer, say
from rcl_interfaces.msg import Log
from rclpy.parameter import Parameter
from rclpy.parameter_client import AsyncParameterClient
from rclpy.qos import DurabilityPolicy, QoSProfile

peer = Peer("rosout")
client = AsyncParameterClient(peer.node, peer.full("interop"))
peer.until("the services are found", client.services_are_ready)
# Discovery knows endpoints before it knows whose they are.
peer.until("the node is found", lambda: "interop" in peer.node.get_node_names())
ends = peer.node.get_publishers_info_by_topic("/rosout")
say("published", any(end.node_name == "interop" for end in ends))
lines = []


def hear(line):
    if line.name == f"{peer.network}.interop":
        lines.append(line)


# As `rclcpp::RosoutQoS`: earlier lines are received, too.
qos = QoSProfile(depth=1000, durability=DurabilityPolicy.TRANSIENT_LOCAL)
peer.node.create_subscription(Log, "/rosout", hear, qos)
result = peer.result(client.set_parameters([Parameter("speed", value=2.5)])).results[0]
assert result.successful, result.reason
if any(end.node_name == "interop" for end in ends):
    peer.until("the change is logged", lambda: any("speed" in line.msg for line in lines))
for line in lines:
    assert line.stamp.sec > 0 and line.line > 0, line
    say(line.level, line.file.rpartition("runtime/")[2], line.msg)
