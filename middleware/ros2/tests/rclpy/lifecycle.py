"""Manages a component as `ros2 lifecycle` does, beside a managed node of rclpy: lifecycle.py NETWORK FILE

The hook `configure` of the component runs until the file exists.
"""

import sys

from lifecycle_msgs.msg import Transition, TransitionEvent
from lifecycle_msgs.srv import ChangeState, GetAvailableStates, GetAvailableTransitions, GetState
from peer import Peer, qos, say
from rclpy.executors import SingleThreadedExecutor
from rclpy.lifecycle import LifecycleNode

peer = Peer("manager")
reference = LifecycleNode("reference", namespace=f"/{peer.network}")
executor = SingleThreadedExecutor()
executor.add_node(reference)
events = []
topic = peer.full("managed/transition_event")
subscription = peer.node.create_subscription(TransitionEvent, topic, events.append, qos())


def client(node, kind, name):
    return peer.node.create_client(kind, peer.full(f"{node}/{name}"))


def ask(node, kind, name, request):
    """The reply of a node; that of this program turns meanwhile."""
    service = client(node, kind, name)
    peer.until(f"{node}/{name} is served", service.service_is_ready)
    future = service.call_async(request)

    def done():
        executor.spin_once(timeout_sec=0.0)
        return future.done()

    peer.until(f"{node}/{name} replies", done)
    return future.result()


def state():
    current = ask("managed", GetState, "get_state", GetState.Request()).current_state
    return f"{current.label} [{current.id}]"


def change(label="", id=0):
    request = ChangeState.Request(transition=Transition(id=id, label=label))
    done = ask("managed", ChangeState, "change_state", request).success
    say(label or id, done, state())


def change_slowly(label, release):
    """The other services reply while the hook runs."""
    service = client("managed", ChangeState, "change_state")
    future = service.call_async(ChangeState.Request(transition=Transition(label=label)))
    peer.until("the hook runs", lambda: state() == "configuring [10]")
    kind = GetAvailableTransitions
    possible = ask("managed", kind, "get_available_transitions", kind.Request())
    labels = [one.transition.label for one in possible.available_transitions]
    say("meanwhile", state(), *labels, "replied" if future.done() else "no reply yet")
    open(release, "w").close()
    peer.until("change_state replies", future.done)
    say(label, future.result().success, state())


def described(kind, name, field):
    both = [ask(node, kind, name, kind.Request()) for node in ["managed", "reference"]]
    ours, theirs = [[str(one) for one in getattr(reply, field)] for reply in both]
    same = sorted(ours) == sorted(theirs)
    say(name, len(ours), "as rclpy" if same else f"{ours} and {theirs}")


peer.until("the topic has its publisher", lambda: peer.node.count_publishers(topic) == 1)
say("at first", state())
described(GetAvailableStates, "get_available_states", "available_states")
described(GetAvailableTransitions, "get_transition_graph", "available_transitions")
described(GetAvailableTransitions, "get_available_transitions", "available_transitions")
change("activate")
change_slowly("configure", sys.argv[2])
change(id=Transition.TRANSITION_ACTIVATE)
change(id=Transition.TRANSITION_CONFIGURE)
change("deactivate")
change("cleanup")
change("shutdown")
change("configure")
peer.until("all events are there", lambda: len(events) >= 10)
for event in events:
    assert event.timestamp > 0
    say("event", event.transition.label, event.start_state.label, event.goal_state.label)
