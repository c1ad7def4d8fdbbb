"""Has the envoy ask the oracle, once for each line `LIMIT QUESTION` of its input: consult.py NETWORK DOMAIN."""

import sys

from node import Client, Node

from envoy import EnvoyConsult_Request, EnvoyConsult_Response

network, domain = sys.argv[1:]
envoy = Client(Node(network, domain), "Envoy/consult", EnvoyConsult_Request, EnvoyConsult_Response)
print("ready", flush=True)
for line in sys.stdin:
    limit, question = line.split()
    print(envoy.call(question, int(limit)).result, flush=True)
