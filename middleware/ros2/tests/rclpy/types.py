"""Asks the component for descriptions of its types: types.py NETWORK DOMAIN"""

import hashlib
import json

from peer import Peer, say
from sensor_msgs.msg import Image
from type_description_interfaces.srv import GetTypeDescription

peer = Peer("types")


def fields(one):
    names = ["type_id", "capacity", "string_capacity", "nested_type_name"]
    return [{"name": f.name, "type": {name: getattr(f.type, name) for name in names}} for f in one.fields]


def individual(one):
    return {"type_name": one.type_name, "fields": fields(one)}


def computed(description):
    """The hash of a description, by REP 2016."""
    referenced = [individual(one) for one in description.referenced_type_descriptions]
    text = {"type_description": individual(description.type_description), "referenced_type_descriptions": referenced}
    return "RIHS01_" + hashlib.sha256(json.dumps(text).encode()).hexdigest()


def describe(client, name, type_hash):
    request = GetTypeDescription.Request(type_name=name, type_hash=str(type_hash), include_type_sources=True)
    return peer.result(client.call_async(request))


client = peer.client(GetTypeDescription, "interop/get_type_description")
for topic in ["Images/image", "Echoes/echo"]:
    topic = peer.full(topic)
    peer.until("the topic is found", lambda: peer.node.get_publishers_info_by_topic(topic))
    end = peer.node.get_publishers_info_by_topic(topic)[0]
    reply = describe(client, end.topic_type, end.topic_type_hash)
    assert reply.successful, reply.failure_reason
    say("described", end.topic_type, computed(reply.type_description) == str(end.topic_type_hash))
    if end.topic_type == "sensor_msgs/msg/Image":
        # A node of rclpy describes the type in the same way.
        peer.node.create_subscription(Image, topic, lambda _: None, 1)
        own = peer.client(GetTypeDescription, "types/get_type_description")
        theirs = describe(own, end.topic_type, end.topic_type_hash)
        say("same as rclpy", theirs.successful and theirs.type_description == reply.type_description)
reply = describe(client, "std_msgs/msg/Char", "RIHS01_" + 64 * "0")
say("unknown", reply.successful, reply.failure_reason)
