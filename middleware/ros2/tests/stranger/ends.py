"""Prints the endpoints of other participants, without those of parameters, and then waits until they have left:
ends.py NETWORK DOMAIN COUNT."""

import sys

from cyclonedds.builtin import BuiltinDataReader, BuiltinTopicDcpsPublication, BuiltinTopicDcpsSubscription
from cyclonedds.core import Policy

from node import Node, until

network, domain, count = sys.argv[1], sys.argv[2], int(sys.argv[3])
here = Node(network, domain)
readers = [
    ("sends", BuiltinDataReader(here.member, BuiltinTopicDcpsPublication)),
    ("hears", BuiltinDataReader(here.member, BuiltinTopicDcpsSubscription)),
]
ends = {}


def is_meant(topic):
    """Whether a topic is of this network, and not of a service that every node has."""
    return network in topic and "parameter" not in topic and "type_description" not in topic


def look():
    """Takes new and lost endpoints from discovery."""
    for does, reader in readers:
        for end in reader.take(N=100):
            key = str(end.key)
            if not end.sample_info.valid_data:
                ends.pop(key, None)
            elif end.participant_key != here.member.guid and is_meant(end.topic_name):
                reliable = Policy.Reliability.BestEffort not in end.qos
                kept = Policy.Durability.TransientLocal in end.qos
                words = [does, end.topic_name, end.type_name, reliable and "reliable", kept and "kept"]
                ends[key] = " ".join(word for word in words if word)
    return ends


until("all ends are there", lambda: len(look()) >= count)
for end in sorted(ends.values()):
    print(end)
print("all", flush=True)
until("all have gone", lambda: not look())
print("gone", flush=True)
