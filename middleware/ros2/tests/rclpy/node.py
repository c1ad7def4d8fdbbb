"""Tells what the graph of ROS 2 knows about a node and of the others of its network: node.py NETWORK DOMAIN NODE"""

import sys

from peer import Peer, say

name = sys.argv[3]
peer = Peer("looker")
space = f"/{peer.network}"


def nodes():
    known = peer.node.get_node_names_and_namespaces()
    return sorted(node for node, inside in known if inside == space and node != "looker")


def topics():
    own = peer.node.get_publisher_names_and_types_by_node(name, space)
    return sorted((topic.removeprefix(f"{space}/"), types) for topic, types in own if topic.startswith(space))


peer.until("the node is found", lambda: name in nodes())
peer.until("its topics are found", lambda: len(topics()) > 1)
for node in nodes():
    say("node", node)
for topic, types in topics():
    say("topic", topic, *types)
