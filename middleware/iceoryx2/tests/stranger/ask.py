"""Has a text said, and asks whether it is being said: ask.py NETWORK TEXT."""

import sys

import robocomp

network, text = sys.argv[1:]
speech = robocomp.Client(robocomp.Network(network), f"{network}/Speech")

# query void say(Datasayin request, out Dataresponse response), with
# struct Datasayin { string text; bool overwrite; } and struct Dataresponse { bool result; string reason; }
answer = speech.call(speech.request("say").put_text(text).put("?", False).data)
print("say", answer.get("?"), answer.get_text())

# query isBusy(out Dataresponse response): nothing goes in, which is one octet
answer = speech.call(speech.request("isBusy").put("B", 0).data)
print("isBusy", answer.get("?"), answer.get_text())
