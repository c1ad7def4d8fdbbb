"""Parses files with generated parsers, and reads the queries beside the grammars. For each file it prints "yes" if
the file has no error, or else "no". Arguments: the folder of the parsers, that of the grammars, the list of files,
and a folder to write into."""

import ctypes
import subprocess
import sys
from pathlib import Path

from tree_sitter import Language, Parser, Query

parsers, grammars, listed, place = map(Path, sys.argv[1:])


def language(name: str) -> Language:
    library = place / f"{name}.so"
    source = parsers / name
    subprocess.check_call(
        ["cc", "-shared", "-fPIC", "-I", source, "-o", library, source / "parser.c"]
    )
    function = getattr(ctypes.CDLL(str(library)), f"tree_sitter_{name}")
    function.restype = ctypes.c_void_p
    capsule = ctypes.pythonapi.PyCapsule_New
    capsule.restype = ctypes.py_object
    capsule.argtypes = [ctypes.c_void_p, ctypes.c_char_p, ctypes.c_void_p]
    known = Language(capsule(function(), b"tree_sitter.Language", None))
    for query in sorted((grammars / name / "queries").iterdir()):
        Query(known, query.read_text())
    return known


languages: dict[str, Parser] = {}
for file in map(Path, listed.read_text().splitlines()):
    name = file.suffix[1:]
    if name not in languages:
        languages[name] = Parser(language(name))
    tree = languages[name].parse(file.read_bytes())
    print("no" if tree.root_node.has_error else "yes")
