"""Values: frozen, slotted, keyword-only dataclasses that are cheap to define.

`dataclasses.dataclass` compiles six methods for every class, 0.4 ms together; a check defines a
hundred classes before it reads its mission.  Here one method is compiled, ``__init__``, and the
others are shared.  What comes out is a dataclass: `dataclasses.replace`, `dataclasses.fields` and
`dataclasses.field` work as ever.
"""

from __future__ import annotations

from dataclasses import MISSING, FrozenInstanceError, dataclass, field, fields
from typing import TYPE_CHECKING, Any, TypeVar, dataclass_transform, overload

if TYPE_CHECKING:
    from collections.abc import Callable

T = TypeVar("T")


@overload
def frozen(cls: type[T], /) -> type[T]: ...
@overload
def frozen(*, eq: bool) -> Callable[[type[T]], type[T]]: ...
@dataclass_transform(frozen_default=True, kw_only_default=True, field_specifiers=(field,))
def frozen(cls: type[Any] | None = None, /, *, eq: bool = True) -> Any:
    """Make a class a value.

    Parameters
    ----------
    cls : type
        Annotated as for `dataclasses.dataclass`; its bases have no fields.
    eq : bool
        Whether values with equal fields are equal, and hash by them; else each is equal to itself
        alone, as suits what holds arrays.
    """
    if cls is None:
        return lambda decorated: _made_frozen(decorated, eq=eq)
    return _made_frozen(cls, eq=eq)


def _made_frozen(cls: type[Any], *, eq: bool) -> Any:  # noqa: ANN401 - a class with methods to set
    made: Any = dataclass(cls, init=False, repr=False, eq=False, slots=True, kw_only=True)
    made.__init__ = _make_init(made)
    shared = [_refused_setattr, _refused_delattr, _getstate, _setstate, _repr]
    if eq:
        shared += [_eq, _hash]
    for method in shared:
        name = f"__{method.__name__.rpartition('_')[2]}__"
        if name not in cls.__dict__:
            setattr(made, name, method)
    return made


def _make_init(made: type[Any]) -> Callable[..., None]:
    """Return an ``__init__`` that fills the slots by their descriptors: assignment is refused."""
    known: dict[str, Any] = {"MISSING": MISSING}
    arguments, body = [], []
    for each in fields(made):
        name = each.name
        if not each.init:  # left to ``__post_init__``
            continue
        known[f"set_{name}"] = getattr(made, name).__set__
        default, given = "", name
        if each.default is not MISSING:
            known[f"default_{name}"] = each.default
            default = f"=default_{name}"
        elif each.default_factory is not MISSING:
            known[f"make_{name}"] = each.default_factory
            default, given = "=MISSING", f"make_{name}() if {name} is MISSING else {name}"
        arguments.append(name + default)
        body.append(f" set_{name}(self, {given})")
    if hasattr(made, "__post_init__"):
        body.append(" self.__post_init__()")
    signature = ", ".join(["self", "*", *arguments] if arguments else ["self"])
    source = "\n".join([f"def __init__({signature}):", *body, " return None"])
    exec(source, known)
    init: Callable[..., None] = known["__init__"]
    init.__qualname__ = f"{made.__qualname__}.__init__"
    return init


def _values(self: Any, names: list[str]) -> tuple[Any, ...]:  # noqa: ANN401 - any value
    return tuple([getattr(self, name) for name in names])


def _compared(self: Any) -> tuple[Any, ...]:  # noqa: ANN401 - any value
    return _values(self, [each.name for each in fields(self) if each.compare])


# The methods that values share; what follows the last underscore is what they are called there.


def _repr(self: object) -> str:
    shown = [f"{f.name}={getattr(self, f.name)!r}" for f in fields(self) if f.repr]  # type: ignore[arg-type] # a value
    return f"{type(self).__qualname__}({', '.join(shown)})"


def _eq(self: object, other: object) -> Any:  # noqa: ANN401 - a bool or NotImplemented
    if type(other) is not type(self):
        return NotImplemented
    return _compared(self) == _compared(other)


def _hash(self: object) -> int:
    return hash(_compared(self))


def _getstate(self: Any) -> tuple[Any, ...]:  # noqa: ANN401 - any value
    return _values(self, list(self.__dataclass_fields__))


def _setstate(self: Any, state: tuple[Any, ...]) -> None:  # noqa: ANN401 - any value
    for name, each in zip(self.__dataclass_fields__, state, strict=True):
        object.__setattr__(self, name, each)


def _refused_setattr(self: object, name: str, value: object) -> None:  # noqa: ARG001 - given by Python
    msg = f"cannot assign to field {name!r}"
    raise FrozenInstanceError(msg)


def _refused_delattr(self: object, name: str) -> None:  # noqa: ARG001 - given by Python
    msg = f"cannot delete field {name!r}"
    raise FrozenInstanceError(msg)
