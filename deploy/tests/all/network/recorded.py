"""Reads the recording of a network with the libraries of others, and writes one that is played.

Arguments: the recording, the end of a topic, and the file to write: the messages of the topic, with its type,
under another name.
"""

import json
import sys
from collections import Counter
from pathlib import Path

from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory
from mcap_ros2.writer import Writer
from rosbags.highlevel import AnyReader

path, end = Path(sys.argv[1]), sys.argv[2]
found = {"mcap": Counter(), "rosbags": Counter(), "qos": True, "values": [], "attachments": []}
with open(path, "rb") as stream:
    reader = make_reader(stream, decoder_factories=[DecoderFactory()])
    found["attachments"] = [one.name for one in reader.iter_attachments()]
    definition = None
    for schema, channel, message, value in reader.iter_decoded_messages():
        found["mcap"][channel.topic] += 1
        found["qos"] = found["qos"] and "reliability" in channel.metadata["offered_qos_profiles"]
        if channel.topic.endswith(end):
            definition = schema
            found["values"].append([message.log_time, value.x, value.y])
with AnyReader([path]) as bag:
    for connection, time, raw in bag.messages():
        bag.deserialize(raw, connection.msgtype)
        found["rosbags"][connection.topic] += 1
print(json.dumps(found))

with open(sys.argv[3], "wb") as stream, Writer(stream) as writer:
    schema = writer.register_msgdef(definition.name, definition.data.decode())
    first = found["values"][0][0]
    for at, (time, x, y) in enumerate(found["values"]):
        value = {"source": "theirs", "x": x, "y": y, "confidence": 50}
        writer.write_message(topic="/theirs", schema=schema, message=value, log_time=time, publish_time=time, sequence=at)
