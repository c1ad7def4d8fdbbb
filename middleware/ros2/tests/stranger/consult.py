"""Makes the component call the oracle, once for each line `LIMIT QUESTION` of its input: consult.py NETWORK DOMAIN."""

import sys

from node import Client, Node

from interop import InteropConsult_Request, InteropConsult_Response

network, domain = sys.argv[1:]
interop = Client(Node(network, domain), "Interop/consult", InteropConsult_Request, InteropConsult_Response)
print("ready", flush=True)
for line in sys.stdin:
    limit, question = line.split()
    print(interop.call(question, int(limit)).result, flush=True)
