"""Names the component's parameters, then prints each change of `speed` that others make: parameter_events.py NETWORK DOMAIN"""

from peer import Peer, say
from rcl_interfaces.msg import ParameterEvent
from rclpy.parameter import parameter_value_to_python
from rclpy.parameter_client import AsyncParameterClient
from rclpy.qos import qos_profile_parameter_events

peer = Peer("parameter_events")
changes = []


def note(event):
    """The events of a domain are those of all nodes."""
    if event.node == peer.full("interop"):
        changes.extend(event.changed_parameters)


events = peer.node.create_subscription(ParameterEvent, "/parameter_events", note, qos_profile_parameter_events)
client = AsyncParameterClient(peer.node, peer.full("interop"))
peer.until("the services are found", client.services_are_ready)
say("names", *sorted(peer.result(client.list_parameters([], 0)).result.names))
while True:
    changes.clear()
    peer.until("a parameter changes", lambda: changes)
    for change in changes:
        say(change.name, parameter_value_to_python(change.value))
