"""Publishes polygons in centimetres, until its input ends: say_points.py NETWORK TOPIC"""

import sys

from geometry_msgs.msg import Point32, Polygon
from peer import Peer, qos, say, spin_until_input_ends

peer = Peer("say_points")
publisher = peer.node.create_publisher(Polygon, peer.full(sys.argv[2]), qos())
number = 0


def publish():
    global number
    number += 1
    n = 100.0 * number
    publisher.publish(Polygon(points=[Point32(x=2.0 * n, y=-n, z=3.0 * n), Point32(x=-100.0)]))


timer = peer.node.create_timer(0.05, publish)
say("ready")
spin_until_input_ends(peer.node)
