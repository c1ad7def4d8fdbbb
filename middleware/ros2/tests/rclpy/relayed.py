"""Publishes polygons of 5 points and waits until a relay has sent each on. Prints the delays in nanoseconds: relayed.py NETWORK DOMAIN TO FROM COUNT"""

import sys
import time

from geometry_msgs.msg import Point32, Polygon
from peer import LIMIT, Peer, qos, say
from rclpy.executors import SingleThreadedExecutor

peer = Peer("relayed")
publisher = peer.node.create_publisher(Polygon, peer.full(sys.argv[3]), qos())
came = []
subscription = peer.node.create_subscription(
    Polygon, peer.full(sys.argv[4]), lambda polygon: came.append((time.monotonic_ns(), polygon)), qos()
)
peer.until("the relay is there", lambda: publisher.get_subscription_count() and subscription.get_publisher_count())
polygon = Polygon(points=[Point32(x=1000.0, y=2000.0, z=500.0)] * 5)
times = []
executor = SingleThreadedExecutor()
executor.add_node(peer.node)
for _ in range(int(sys.argv[5])):
    time.sleep(0.0002)
    came.clear()
    sent = time.monotonic_ns()
    publisher.publish(polygon)
    while not came:
        if time.monotonic_ns() - sent > LIMIT * 1e9:
            raise TimeoutError("no polygon comes")
        executor.spin_once(timeout_sec=1.0)
    received, other = came[0]
    point = other.points[4]
    if (point.x, point.y, point.z) != (2.0, -1.0, 0.5):
        raise ValueError(f"another point came: {point}")
    times.append(received - sent)
say("times", *times)
