"""Measures round trips, one at a time: measure.py NETWORK DOMAIN ROUNDS BYTES…

Prints `topic BYTES` or `service BYTES` with the microseconds of each round."""

import sys
import time

import rclpy
from peer import LIMIT, Peer, qos, say
from sensor_msgs.srv import SetCameraInfo
from std_msgs.msg import String

rounds, sizes = int(sys.argv[3]), [int(size) for size in sys.argv[4:]]
# The first rounds are not counted.
WARM_UP = 10
peer = Peer("measure")
heard = []
subscription = peer.node.create_subscription(String, peer.full("Gossip/chatter"), heard.append, qos())
publisher = peer.node.create_publisher(String, peer.full("Talk/chatter"), qos())
client = peer.client(SetCameraInfo, "Camera/setCameraInfo")
peer.until("the other end is found", lambda: publisher.get_subscription_count() and subscription.get_publisher_count())
# The other end also has to find this one.
end = time.monotonic() + LIMIT
while not heard and time.monotonic() < end:
    publisher.publish(String(data="found"))
    rclpy.spin_once(peer.node, timeout_sec=0.5)


def topic(size):
    message = String(data="x" * size)
    heard.clear()
    begin = time.perf_counter()
    publisher.publish(message)
    while not heard:
        if time.perf_counter() - begin > LIMIT:
            raise TimeoutError(f"{size} bytes did not come back")
        rclpy.spin_once(peer.node, timeout_sec=1.0)
    return time.perf_counter() - begin


def service(size):
    request = SetCameraInfo.Request()
    request.camera_info.distortion_model = "x" * size
    begin = time.perf_counter()
    future = client.call_async(request)
    while not future.done():
        if time.perf_counter() - begin > LIMIT:
            raise TimeoutError(f"no reply of {size} bytes")
        rclpy.spin_once(peer.node, timeout_sec=1.0)
    return time.perf_counter() - begin


for what in (topic, service):
    for size in sizes:
        times = [what(size) for _ in range(rounds + WARM_UP)][WARM_UP:]
        say(what.__name__, size, *[round(time * 1e6) for time in times])
