"""Prints the classes of the files on the command line as JSON, for rcgen: it runs none of them."""

import ast
import json
import sys

# Below Python 3.8, texts of types cannot be printed; components need more.
if sys.version_info < (3, 11):
    print(json.dumps({"version": sys.version.split()[0]}))
    sys.exit()


def text(node):
    """An annotation as it is written; a text in it is the type that it names."""
    if node is None:
        return None
    if isinstance(node, ast.Constant) and isinstance(node.value, str):
        return node.value
    return ast.unparse(node)


def method(node):
    of = node.args
    positional = of.posonlyargs + of.args
    return {
        "name": node.name,
        "line": node.lineno,
        "column": node.col_offset,
        "parameters": [[arg.arg, text(arg.annotation)] for arg in positional],
        "defaults": len(of.defaults),
        "more": of.vararg is not None,
        "keywords": sum(default is None for default in of.kw_defaults),
        "returns": text(node.returns),
        "decorated": any(last(mark) not in ("override", "final") for mark in node.decorator_list),
        "coroutine": isinstance(node, ast.AsyncFunctionDef),
    }


def body(statements):
    """The functions of a class, of which the last one of a name counts, and other names that it binds."""
    methods, names = {}, set()
    for item in statements:
        if isinstance(item, (ast.FunctionDef, ast.AsyncFunctionDef)):
            methods[item.name] = method(item)
            continue
        # A name that is bound inside an `if` or a `try` may exist or not: it counts as bound.
        for node in ast.walk(item):
            if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef)):
                names.add(node.name)
            elif isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store):
                names.add(node.id)
            elif isinstance(node, (ast.Import, ast.ImportFrom)):
                names.update((alias.asname or alias.name).split(".")[0] for alias in node.names)
    return {"methods": list(methods.values()), "names": sorted(names)}


def last(node):
    """The last word of a base: `Worker` of `generated.Worker`, and of `Worker[T]`."""
    if isinstance(node, ast.Subscript):
        node = node.value
    return node.attr if isinstance(node, ast.Attribute) else getattr(node, "id", "")


def read(path):
    found = {"path": path, "classes": []}
    try:
        with open(path, "rb") as file:
            tree = ast.parse(file.read(), path)
    except SyntaxError as error:
        found["error"] = {
            "message": error.msg,
            "line": error.lineno or 1,
            "column": max((error.offset or 1) - 1, 0),
        }
        return found
    except (ValueError, OSError) as error:
        found["error"] = {"message": str(error), "line": 1, "column": 0}
        return found
    except (RecursionError, MemoryError):
        found["error"] = {"message": "it is nested too deeply", "line": 1, "column": 0}
        return found
    for node in ast.walk(tree):
        if isinstance(node, ast.ClassDef):
            found["classes"].append(
                {
                    "name": node.name,
                    "line": node.lineno,
                    "end": node.end_lineno,
                    "bases": [last(base) for base in node.bases],
                    **body(node.body),
                }
            )
    return found


print(
    json.dumps(
        {"version": sys.version.split()[0], "files": [read(path) for path in sys.argv[1:]]}
    )
)
