"""Reads kept samples, and publishes transient-local ones until its input ends: late.py NETWORK DOMAIN COUNT."""

import sys

from interop import Archive_keep, Orders_order
from network import Network, qos

network, domain, count = sys.argv[1], sys.argv[2], int(sys.argv[3])
here = Network(network, domain)
orders = here.writer("Orders/order", Orders_order, qos(kept=True, depth=3))
for number in range(5):
    orders.write(Orders_order(f"order {number}"))
print("ready", flush=True)
archive = here.reader("Archive/keep", Archive_keep, qos(kept=True, depth=100))
for kept in here.values(archive):
    print(kept.text, flush=True)
    count -= 1
    if count == 0:
        break
sys.stdin.read()
