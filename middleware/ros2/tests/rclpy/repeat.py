"""Publishes strings and compares them with those that the component publishes again: repeat.py NETWORK DOMAIN BYTES…"""

import sys

from peer import Peer, qos, say, wait_for_line
from std_msgs.msg import String

heard = []
peer = Peer("repeat")
subscription = peer.node.create_subscription(String, peer.full("Gossip/chatter"), heard.append, qos())
publisher = peer.node.create_publisher(String, peer.full("Talk/chatter"), qos())
peer.until("the component is found", lambda: publisher.get_subscription_count() and subscription.get_publisher_count())
say("met")
# The component also has to find this node.
wait_for_line()
sizes = [int(size) for size in sys.argv[3:]]
for number, size in enumerate(sizes):
    text = "".join(chr(ord("a") + (number + i) % 26) for i in range(min(size, 26)))
    text = (text * (size // 26 + 1))[:size]
    heard.clear()
    publisher.publish(String(data=text))
    peer.until(f"{size} bytes are repeated", lambda: heard)
    assert heard == [String(data=text)], size
say("repeated", len(sizes))
