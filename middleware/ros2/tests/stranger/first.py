"""Makes new clients, each of which calls once at once, and checks the replies: first.py NETWORK DOMAIN COUNT."""

import sys

from node import Client, Node

from interop import AddTwoInts_Request, AddTwoInts_Response

network, domain, count = sys.argv[1], sys.argv[2], int(sys.argv[3])
here, answered = Node(network, domain), 0
for number in range(count):
    add = Client(here, "Interop/add", AddTwoInts_Request, AddTwoInts_Response)
    answered += add.call(number, 1).sum == number + 1
print("answered", answered)
