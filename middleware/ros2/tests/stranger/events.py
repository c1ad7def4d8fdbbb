"""Prints the parameter events of a node, and sets parameters on request: events.py NETWORK DOMAIN NODE.

Each line of its input is a command: `set`, `set_atomically`."""

import sys
import threading
import time

from rcl_interfaces import ParameterEvent, number, setting, texts

from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from network import Network, qos

network, domain, node = sys.argv[1:]
here = Network(network, domain)
# The quality of service of `rclcpp`.
events = DataReader(here.member, Topic(here.member, "rt/parameter_events", ParameterEvent), qos(depth=1000))


def shown(parameter):
    value = parameter.value
    kinds = {1: value.bool_value, 2: value.integer_value, 3: value.double_value, 4: value.string_value}
    kinds |= {9: value.string_array_value}
    return f"{parameter.name}={kinds[value.type]}"


def say(*words):
    """Prints a line at once, since two threads print."""
    sys.stdout.write(" ".join(map(str, words)) + "\n")
    sys.stdout.flush()


def tell():
    for event in here.values(events, seconds=120):
        # Other nodes of this domain publish on the same topic.
        if event.node != node:
            continue
        age = time.time() - event.stamp.sec - event.stamp.nanosec / 1e9
        kinds = {
            "new": event.new_parameters, "changed": event.changed_parameters, "deleted": event.deleted_parameters,
        }
        told = [word for kind, some in kinds.items() if some for word in [kind, *map(shown, some)]]
        say(*told, *([] if 0 <= age < 30 else [f"{age} s ago"]))


threading.Thread(target=tell, daemon=True).start()
print("listens", flush=True)
for line in sys.stdin:
    sets, atomic = setting(here, node)
    if line.strip() == "set":
        results = sets.call([number("speed", 2.5), number("speed", 99.0), number("speed", 3.0)]).results
        say("set", *[result.successful for result in results])
    else:
        result = atomic.call([number("speed", 3.5), texts("arm.joints", "x", "y")]).result
        say("set", result.successful)
