"""Opens endpoints at the topics of the component with other types, until its input ends: other_type.py NETWORK DOMAIN."""

import sys

from node import Node, met, qos

from interop import OrdersOrder, String

network, domain = sys.argv[1:]
here = Node(network, domain)
reports = here.writer("Reports/report", String)
echoes = here.reader("Echoes/echo", String)
right = here.writer("Orders/order", OrdersOrder, qos(kept=True))
met(right)
for number in range(20):
    reports.write(String(f"no report {number}"))
right.write(OrdersOrder("once"))
print("matched", len(reports.get_matched_subscriptions()), len(echoes.get_matched_publications()), flush=True)
sys.stdin.read()
