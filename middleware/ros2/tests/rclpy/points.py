"""Prints the points of polygons, as numbers: points.py NETWORK TOPIC COUNT"""

import sys

from geometry_msgs.msg import Polygon
from peer import Peer, qos, say

topic, count = sys.argv[2], int(sys.argv[3])
received = 0


def on_points(polygon):
    global received
    received += 1
    if received <= count:
        say(*(number for point in polygon.points for number in (point.x, point.y, point.z)))


peer = Peer("points")
subscription = peer.node.create_subscription(Polygon, peer.full(topic), on_points, qos())
peer.until("points come", lambda: received >= count)
