"""Tells what the graph of ROS 2 knows about the component: graph.py NETWORK DOMAIN"""

from peer import Peer, say
from std_msgs.msg import String

peer = Peer("graph")
topic = peer.full("Gossip/chatter")
peer.until("the node is found", lambda: ("interop", f"/{peer.network}") in peer.node.get_node_names_and_namespaces())
peer.until("its topic is found", lambda: peer.node.get_publishers_info_by_topic(topic))


def belongs(name):
    return name.startswith(f"/{peer.network}/") and not name.startswith(f"/{peer.network}/graph")


for name, types in sorted(peer.node.get_topic_names_and_types()):
    if belongs(name):
        say("topic", name.removeprefix(f"/{peer.network}"), *types)
for name, types in sorted(peer.node.get_service_names_and_types_by_node("interop", f"/{peer.network}")):
    if "_robocomp" in name or not name.startswith(peer.full("interop/")):
        say("service", name.removeprefix(f"/{peer.network}"), *types)
# Of the same type, so that its hash is that of ROS 2.
peer.node.create_subscription(String, topic, lambda _: None, 1)
peer.until("the own subscription is found", lambda: peer.node.get_subscriptions_info_by_topic(topic))
for name in ["Gossip/chatter", "Echoes/echo"]:
    for end in peer.node.get_publishers_info_by_topic(peer.full(name)):
        say("publisher", end.node_name, end.topic_type, end.topic_type_hash)
for end in peer.node.get_subscriptions_info_by_topic(topic):
    say("subscription", end.node_name, end.topic_type, end.topic_type_hash)
