"""An IDSL module with every type, for tests whose both ends are in Python."""

from build import hash_of, operation_id


def _operation(name, pattern, inputs=(), outputs=(), result=None, throws=()):
    described = {
        "name": name,
        "id": operation_id(name),
        "hash": hash_of(f"{name}{inputs}{outputs}{result}"),
        "pattern": pattern,
        "inputs": [{"name": n, "type": t} for n, t in inputs],
        "outputs": [{"name": n, "type": t} for n, t in outputs],
        "throws": [[f"Demo::{t}", operation_id(t)] for t in throws],
    }
    if result:
        described["result"] = result
    return described


NUMBERS = [
    ("int8", -(2**7), 2**7 - 1),
    ("uint8", 0, 2**8 - 1),
    ("int16", -(2**15), 2**15 - 1),
    ("uint16", 0, 2**16 - 1),
    ("int32", -(2**31), 2**31 - 1),
    ("uint32", 0, 2**32 - 1),
    ("int64", -(2**63), 2**63 - 1),
    ("uint64", 0, 2**64 - 1),
]

MODULE = {
    "module": "Demo",
    "types": [
        {"name": "Kind", "enum": [["wall", 0], ["door", 7], ["person", 8]]},
        {
            "name": "Point",
            "struct": [
                {"name": "x", "type": "float32", "unit": "mm", "range": [-1000.0, 1000.0]},
                {"name": "y", "type": "float64"},
            ],
        },
        {
            "name": "Everything",
            "struct": [
                {"name": "flag", "type": "bool"},
                *({"name": name, "type": name} for name, _, _ in NUMBERS),
                {"name": "f32", "type": "float32"},
                {"name": "f64", "type": "float64"},
                {"name": "text", "type": "string"},
                {"name": "short", "type": "string<4>"},
                {"name": "kind", "type": "Demo::Kind"},
                {"name": "point", "type": "Demo::Point"},
                {"name": "points", "type": "sequence<Demo::Point,3>"},
                *({"name": f"all_{name}", "type": f"sequence<{name}>"} for name, _, _ in NUMBERS),
                {"name": "all_f32", "type": "sequence<float32>"},
                {"name": "all_f64", "type": "sequence<float64>"},
                {"name": "all_flags", "type": "sequence<bool>"},
                {"name": "few", "type": "sequence<uint8,4>"},
                {"name": "matrix", "type": "float64[9]"},
                {"name": "names", "type": "sequence<string>"},
                {"name": "scores", "type": "dictionary<string,float64>"},
                {"name": "kinds", "type": "dictionary<Demo::Kind,Demo::Point>"},
                {"name": "maybe", "type": "Demo::Point", "optional": True},
                {"name": "class", "type": "int32"},
            ],
        },
        {
            "name": "Nonsense",
            "exception": [{"name": "what", "type": "string"}, {"name": "code", "type": "int32"}],
        },
        {"name": "Empty", "exception": []},
        {
            "name": "Image",
            "struct": [
                {"name": "number", "type": "int64"},
                {"name": "kind", "type": "Demo::Kind"},
                {"name": "frame", "type": "string<16>"},
                {"name": "center", "type": "Demo::Point"},
                {"name": "corners", "type": "sequence<Demo::Point,4>"},
                {"name": "pose", "type": "float32[6]"},
                {"name": "data", "type": "sequence<uint8,1048576>"},
            ],
        },
    ],
    "interfaces": [
        {
            "name": "Echo",
            "operations": [
                _operation(
                    "echo", "query", [("all", "Demo::Everything")], result="Demo::Everything"
                ),
                _operation("nothing", "query"),
                _operation(
                    "shift",
                    "query",
                    [("at", "Demo::Point"), ("by", "float64")],
                    [("count", "int32")],
                    "Demo::Point",
                    ["Nonsense", "Empty"],
                ),
                _operation("note", "command", [("text", "string")]),
                _operation("noted", "query", result="sequence<string>"),
                _operation("numbers", "query", [("data", "sequence<int32>")], result="sequence<float32>"),
            ],
        },
        {
            "name": "Notes",
            "operations": [
                _operation("take", "query", [("text", "string")], result="int32"),
                _operation("put", "command", [("text", "string")]),
            ],
        },
        {"name": "Images", "operations": [_operation("image", "publish", [("image", "Demo::Image")])]},
        {
            "name": "Reports",
            "operations": [_operation("report", "publish", [("all", "Demo::Everything")])],
        },
    ],
}
