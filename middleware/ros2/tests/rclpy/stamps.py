"""Moves points until its input ends; after a line, it stamps them anew: stamps.py NETWORK DOMAIN FROM TO"""

import sys
import threading

from geometry_msgs.msg import PointStamped
from peer import Peer, qos, say, spin_until_input_ends, wait_for_line

peer = Peer("stamps")
publisher = peer.node.create_publisher(PointStamped, peer.full(sys.argv[4]), qos())
anew = threading.Event()


def move(point):
    moved = PointStamped(header=point.header, point=point.point)
    if anew.is_set():
        moved.header.stamp = peer.node.get_clock().now().to_msg()
    moved.point.x += 1.0
    publisher.publish(moved)


def follow_input():
    if wait_for_line():
        anew.set()
        say("anew")


subscription = peer.node.create_subscription(PointStamped, peer.full(sys.argv[3]), move, qos())
peer.until("both components are found", lambda: publisher.get_subscription_count() and subscription.get_publisher_count())
say("ready")
threading.Thread(target=follow_input, daemon=True).start()
peer.until("the test asks for other stamps", anew.is_set, limit=120.0)
spin_until_input_ends(peer.node)
