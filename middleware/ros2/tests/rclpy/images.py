"""Counts images until the last one, or until there is none for five seconds: images.py NETWORK DOMAIN RELIABILITY COUNT"""

import sys
import time

import rclpy
from peer import Peer, qos, say
from sensor_msgs.msg import Image

reliability, count = sys.argv[3], int(sys.argv[4])
seen, last = set(), time.monotonic()


def received(image):
    global last
    assert set(image.data[:: len(image.data) // 7]) == {int(image.header.frame_id) % 251}, image.header.frame_id
    seen.add(int(image.header.frame_id))
    last = time.monotonic()


peer = Peer("images")
subscription = peer.node.create_subscription(Image, peer.full("Images/image"), received, qos(reliability))
peer.until("the component is found", subscription.get_publisher_count)
say("met")
while not seen or (count - 1 not in seen and time.monotonic() < last + 5.0):
    rclpy.spin_once(peer.node, timeout_sec=0.1)
missing = [number for number in range(count) if number not in seen]
if missing:
    print("missing:", *missing[:20], file=sys.stderr)
say("received", len(seen))
