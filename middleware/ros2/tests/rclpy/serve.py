"""Serves what the component calls, until its input ends: serve.py NETWORK DOMAIN"""

import threading

import rclpy
from peer import Peer, say, wait_for_line
from sensor_msgs.srv import SetCameraInfo


def answer(request, response):
    response.success = True
    response.status_message = request.camera_info.distortion_model
    return response


peer = Peer("serve")
service = peer.node.create_service(SetCameraInfo, peer.full("CameraDriver/setCameraInfo"), answer)
threading.Thread(target=rclpy.spin, args=(peer.node,), daemon=True).start()
say("ready")
while wait_for_line():
    pass
