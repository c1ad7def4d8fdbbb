"""Publishes /tf_static once and /tf until the input ends, and prints the time of its beginning: transforms.py NETWORK"""

import math
import threading

import rclpy
from geometry_msgs.msg import TransformStamped
from peer import Peer, say, wait_for_line
from rclpy.qos import DurabilityPolicy, QoSProfile
from tf2_msgs.msg import TFMessage


def transform(nanoseconds, parent, child, place, turn):
    """A transform with a turn about z."""
    out = TransformStamped()
    out.header.stamp.sec, out.header.stamp.nanosec = divmod(nanoseconds, 10**9)
    out.header.frame_id, out.child_frame_id = parent, child
    out.transform.translation.x, out.transform.translation.y, out.transform.translation.z = place
    out.transform.rotation.z, out.transform.rotation.w = math.sin(turn / 2), math.cos(turn / 2)
    return out


peer = Peer("transforms")
begin = peer.node.get_clock().now().nanoseconds
moving = peer.node.create_publisher(TFMessage, "/tf", QoSProfile(depth=100))
kept = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
fixed = peer.node.create_publisher(TFMessage, "/tf_static", kept)
fixed.publish(TFMessage(transforms=[transform(0, "base", "lidar", (0.2, 0.0, 0.3), math.pi / 2)]))


def move():
    """Half a metre a second ahead, and 0.3 rad/s to the left."""
    now = peer.node.get_clock().now().nanoseconds
    seconds = (now - begin) / 1e9
    moving.publish(TFMessage(transforms=[transform(now, "map", "base", (0.5 * seconds, 0.0, 0.0), 0.3 * seconds)]))


peer.node.create_timer(0.02, move)
say("begin", begin)
end = threading.Event()
threading.Thread(target=lambda: (wait_for_line(), end.set()), daemon=True).start()
while not end.is_set():
    rclpy.spin_once(peer.node, timeout_sec=0.1)
