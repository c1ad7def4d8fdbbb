"""Talks to the component as `talker` and `listener` of `demo_nodes_cpp` do, and looks for its node: talk.py NETWORK DOMAIN TOPIC"""

import sys

from peer import Peer, qos, say
from std_msgs.msg import String

peer = Peer("talk")
peer.until("the node is found", lambda: ("interop", f"/{peer.network}") in peer.node.get_node_names_and_namespaces())
say("node", peer.full("interop"))
heard = []
# A name outside the network: the component remaps its topic to it.
publisher = peer.node.create_publisher(String, sys.argv[3], qos())
subscription = peer.node.create_subscription(String, peer.full("Gossip/chatter"), heard.append, qos())
number = 0


def says():
    """Says one more text, until the component has repeated one."""
    global number
    number += 1
    publisher.publish(String(data=f"Hello World: {number}"))
    return heard


peer.until("the component repeats a text", says)
say("heard", heard[0].data.partition(":")[0])
