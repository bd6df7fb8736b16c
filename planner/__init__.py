"""mavjoule: a MAVLink mission energy planner and pre-flight checker.

The public names are listed once, in the stub beside this file, and imported at their first use, so that
``import planner`` costs nothing.
"""

from __future__ import annotations

__version__ = "0.1.0"


def __getattr__(name: str) -> object:
    """Import a public name from its module, at its first use; ``__all__`` lists them."""
    from importlib import import_module
    from pathlib import Path

    stub = Path(__file__).with_suffix(".pyi").read_text(encoding="utf-8")
    # Words, not patterns: the import of a module of the package asks here too.
    imports = (line.split() for line in stub.splitlines() if line.startswith("from "))
    homes = {words[-1]: words[1] for words in imports}
    if name == "__all__":
        value: object = sorted([*homes, "__version__"])
    elif name in homes:
        home = homes[name]
        is_package = home == __name__
        value = (
            import_module(f"{home}.{name}") if is_package else getattr(import_module(home), name)
        )
    else:
        msg = f"module 'planner' has no attribute {name!r}"
        raise AttributeError(msg)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    """Return the public names."""
    return __getattr__("__all__")
