"""Does for measurements what the component does, until its input ends: echo.py NETWORK DOMAIN"""

import threading

import rclpy
from peer import Peer, qos, say, wait_for_line
from sensor_msgs.srv import SetCameraInfo
from std_msgs.msg import String


def answer(request, response):
    response.success = True
    response.status_message = request.camera_info.distortion_model
    return response


peer = Peer("echo")
publisher = peer.node.create_publisher(String, peer.full("Gossip/chatter"), qos())
subscription = peer.node.create_subscription(String, peer.full("Talk/chatter"), publisher.publish, qos())
service = peer.node.create_service(SetCameraInfo, peer.full("Camera/setCameraInfo"), answer)
threading.Thread(target=rclpy.spin, args=(peer.node,), daemon=True).start()
say("ready")
while wait_for_line():
    pass
