"""Sends each polygon on as other ones, as `transform` of topic_tools does, until its input ends: relay.py NETWORK DOMAIN FROM TO EXPRESSION"""

import sys

from geometry_msgs.msg import Point32, Polygon
from peer import Peer, qos, say, spin_until_input_ends

peer = Peer("relay")
publisher = peer.node.create_publisher(Polygon, peer.full(sys.argv[4]), qos())
expression = compile(sys.argv[5], "expression", "eval")


def send_on(polygon):
    publisher.publish(eval(expression, {"m": polygon, "Point32": Point32, "Polygon": Polygon}))


subscription = peer.node.create_subscription(Polygon, peer.full(sys.argv[3]), send_on, qos())
say("ready")
spin_until_input_ends(peer.node)
