"""Opens endpoints that do not match those of the component, until its input ends: misfit.py NETWORK DOMAIN."""

import sys

from node import Node, met, qos, until

from interop import ArchiveKeep, OrdersOrder, Report

network, domain = sys.argv[1:]
here = Node(network, domain)
careless = here.writer("Reports/report", Report, qos(reliable=False))
greedy = here.reader("Echoes/echo", Report, qos(kept=True))
right = here.writer("Orders/order", OrdersOrder, qos(kept=True))
met(right)
right.write(OrdersOrder("once"))
until("the reader of reports was found", lambda: careless.get_offered_incompatible_qos_status())
careless.write(Report(1))
print("matched", len(careless.get_matched_subscriptions()), len(greedy.get_matched_publications()), flush=True)
sys.stdin.read()
