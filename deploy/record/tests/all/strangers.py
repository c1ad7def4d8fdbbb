"""Reads a recording with the libraries of others, and writes one."""

import json
import sys
from pathlib import Path

import numpy
from mcap.reader import make_reader
from mcap.writer import CompressionType
from mcap_ros2.decoder import DecoderFactory
from mcap_ros2.writer import Writer
from rosbags.highlevel import AnyReader


def plain(value):
    """A message as JSON."""
    if isinstance(value, numpy.ndarray):
        return value.tolist()
    if isinstance(value, (bytes, bytearray)):
        return list(value)
    if isinstance(value, (list, tuple)):
        return [plain(one) for one in value]
    if hasattr(value, "__slots__") and not isinstance(value, (str, int, float, bool)):
        return {name: plain(getattr(value, name)) for name in value.__slots__ if not name.startswith("_")}
    if hasattr(value, "__dataclass_fields__"):
        return {name: plain(getattr(value, name)) for name in value.__dataclass_fields__ if not name.startswith("_")}
    return value


path = Path(sys.argv[1])
with open(path, "rb") as stream:
    reader = make_reader(stream, decoder_factories=[DecoderFactory()])
    summary = reader.get_summary()
    found = {
        "messages": summary.statistics.message_count,
        "chunks": len(summary.chunk_indexes),
        "attachments": [one.name for one in reader.iter_attachments()],
        "metadata": [one.name for one in reader.iter_metadata()],
        "mcap": [],
    }
    for schema, channel, message, value in reader.iter_decoded_messages():
        found["mcap"].append([channel.topic, schema.name, message.log_time, message.publish_time, plain(value)])
with AnyReader([path]) as bag:
    found["rosbags"] = []
    for connection, time, raw in bag.messages():
        value = plain(bag.deserialize(raw, connection.msgtype))
        value.pop("__msgtype__", None)
        found["rosbags"].append([connection.topic, connection.msgtype, time, value])
print(json.dumps(found))

# The default compression of this library is zstd.
with open(sys.argv[2], "wb") as stream, Writer(stream, compression=CompressionType.ZSTD) as writer:
    schema = writer.register_msgdef("test_msgs/msg/Pose", "float64 x\nstring name\nint32[] steps\n")
    for at in range(1000):
        value = {"x": at / 4, "name": f"pose {at}", "steps": list(range(at % 5))}
        writer.write_message(topic="/pose", schema=schema, message=value, log_time=at * 1000, publish_time=at, sequence=at)
