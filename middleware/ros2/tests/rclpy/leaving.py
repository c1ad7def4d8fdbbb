"""Tells when the component is in the graph of ROS 2, and when it has left: leaving.py NETWORK DOMAIN"""

from peer import Peer, say

peer = Peer("leaving")
node = peer.node


def topics():
    """The topics and services of the component."""
    own = peer.full("leaving/")
    names = node.get_topic_names_and_types() + node.get_service_names_and_types()
    prefix = f"/{peer.network}/"
    return [name for name, _ in names if name.startswith(prefix) and not name.startswith(own)]


def is_there():
    return ("interop", f"/{peer.network}") in node.get_node_names_and_namespaces()


peer.until("the component is found", lambda: is_there() and len(topics()) > 10)
say("found")
peer.until("the component has left", lambda: not is_there() and not topics())
say("left")
