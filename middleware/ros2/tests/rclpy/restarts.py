"""Keeps one client while its server is killed and started again: restarts.py NETWORK DOMAIN

Calls once for each line of its input, and says how it went."""

from peer import Peer, say, wait_for_line
from sensor_msgs.srv import SetCameraInfo

peer = Peer("restarts")
client = peer.client(SetCameraInfo, "Camera/setCameraInfo")
say("ready")
while wait_for_line():
    request = SetCameraInfo.Request()
    # A request to a server that was killed has no reply; it is sent again, as people would do.
    for _ in range(10):
        future = client.call_async(request)
        try:
            say("answered" if peer.result(future, 1.0).success else "refused")
            break
        except TimeoutError:
            client.remove_pending_request(future)
    else:
        say("no reply")
