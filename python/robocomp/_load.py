"""Extension modules that cargo built."""

import importlib.machinery
import importlib.util
import os
import sys


def load(name: str, variable: str, crate: str, library: str) -> None:
    """Loads the extension module that a variable names. A wheel may have its own."""
    path = os.environ.get(variable)
    if name in sys.modules:
        return
    if not path:
        if importlib.util.find_spec(name) is None:
            if _is_wheel():
                raise ImportError(
                    f"robocomp is from a wheel, which has no `{name}`; "
                    "name the framework by a path in Cargo.toml of the workspace"
                )
            raise ImportError(
                f"robocomp has no extension module `{name}`; "
                f"build it with `cargo build --release -p {crate}`, "
                f"and let {variable} name target/release/{library}"
            )
        return
    loader = importlib.machinery.ExtensionFileLoader(name, path)
    spec = importlib.util.spec_from_file_location(name, path, loader=loader)
    if spec is None or not os.path.exists(path):
        raise ImportError(
            f"{variable} names {path}, which does not exist; "
            f"build it with: cargo build --release -p {crate}"
        )
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    loader.exec_module(module)


def _is_wheel() -> bool:
    """Whether the extension module of the framework lies in its package."""
    folders = sys.modules["robocomp"].__path__
    return importlib.machinery.PathFinder.find_spec("robocomp._native", folders) is not None
