"""Opens endpoints that do not match those of the component, until its input ends: misfit.py NETWORK DOMAIN."""

import sys

from interop import Archive_keep, Echoes_echo, Kind, Orders_order, Point, Report, Reports_report
from network import Network, met, qos, until

network, domain = sys.argv[1:]
here = Network(network, domain)
careless = here.writer("Reports/report", Reports_report, qos(reliable=False))
greedy = here.reader("Echoes/echo", Echoes_echo, qos(kept=True))
# The right topic with a wrong type, and a matching endpoint beside it.
wrong = here.writer("Orders/order", Archive_keep, qos(kept=True))
wrong.write(Archive_keep("never"))
right = here.writer("Orders/order", Orders_order, qos(kept=True))
met(right)
right.write(Orders_order("once"))
until("the reader of reports was found", lambda: careless.get_offered_incompatible_qos_status())
careless.write(Reports_report(Report(1, "", [], [], Kind.wall, Point(0.0, 0.0), [], [])))
print("matched", len(careless.get_matched_subscriptions()), len(wrong.get_matched_subscriptions()), flush=True)
sys.stdin.read()
