"""Values of one data prototype as those of another one."""

import copy
import os
import re
from collections.abc import Collection, Iterator, Mapping, MutableMapping, Sequence
from types import SimpleNamespace
from typing import Any, NamedTuple, TypeAlias, overload

import numpy

from robocomp import _native
from robocomp._errors import ConversionError

_Array: TypeAlias = numpy.ndarray[Any, Any]
_Path: TypeAlias = Sequence[str]

_BLOCK = 4096
"""Rows that are converted at a time: they stay in the caches of a processor."""


class _Prototype(NamedTuple):
    """The key of a prototype."""

    name: str
    language: str
    type_name: str
    semantic: str
    sequence: str | None


class _Conversion:
    """A plan, with the members that it takes and gives."""

    def __init__(self, native: _native.Conversion, own: _Prototype, wanted: _Prototype) -> None:
        self.native = native
        self.own = own
        self.wanted = wanted
        self.sources = [member.split(".") for member in native.from_]
        self.targets = [member.split(".") for member, _ in native.to]
        self.numbers = [number for _, number in native.to]
        self.dropped = [member.split(".") for member in native.dropped]

    def rows(self, blocks: Iterator[_Array]) -> Iterator[_Array]:
        """Rows of the first prototype as rows of the second one, block by block."""
        first = 0
        for block in blocks:
            rows = numpy.zeros((len(block), self.native.width))
            rows[:, : len(self.sources)] = block
            converted = numpy.frombuffer(self.native.convert(rows.tobytes(), first))
            yield converted.reshape(rows.shape)[:, : len(self.targets)]
            first += len(block)


class _Known:
    """The prototypes that this process uses, and the plans between them that were asked for."""

    def __init__(self, files: list[str]) -> None:
        self.files = files
        self.native = _native.Prototypes(files)
        self.prototypes = {found[0]: _Prototype(*found) for found in self.native.all()}
        self.conversions: dict[tuple[str, str], _Conversion] = {}

    def conversion(self, own: str, wanted: str) -> _Conversion:
        found = self.conversions.get((own, wanted))
        if found is None:
            # A name that is not known is an error of this call.
            native = self.native.conversion(own, wanted)
            found = _Conversion(native, self.prototypes[own], self.prototypes[wanted])
            self.conversions[own, wanted] = found
        return found


_known = _Known([])


def use_prototypes(*files: str | os.PathLike[str]) -> None:
    """Reads `.dproto` files for `convert`, beside those that it reads already. A file with an error
    raises `ConversionError`, and nothing changes."""
    global _known
    paths = [os.path.abspath(os.fspath(file)) for file in files]
    _known = _Known(list(dict.fromkeys(_known.files + paths)))


@overload
def convert(
    value: _Array, to: str, *, of: str | None = None, out: _Array | None = None
) -> _Array: ...
@overload
def convert(value: object, to: str, *, of: str | None = None, out: Any = None) -> Any: ...
def convert(value: Any, to: str, *, of: str | None = None, out: Any = None) -> Any:
    """The value as one of the data prototype `to`, by the plan that `rcgen convert` prints.

    `value` is a structure of an interface, a message of rclpy, any object or mapping with the
    members of the prototype `of`, a list of these, or an array of NumPy: a structured one, or one
    whose last axis has the numbers of the prototype in their order. Where the type of a structure
    has one prototype that means the same, `of` can be left out.

    The result is `out` with the numbers of the prototype, which may be `value` itself. Without it,
    it is a copy of the value, or an object with the members of the prototype where the type of the
    value does not have them. `out` stays as it is if a value is refused.
    """
    known = _known
    if isinstance(value, _native.View):
        value = value.copy()
    if isinstance(value, (list, tuple)) and value and not _is_structure(value[0]):
        value = numpy.asarray(value, dtype=numpy.float64)
    conversion = known.conversion(of or _source(known, value, to), to)
    if isinstance(value, numpy.ndarray):
        convert_array = _structured if value.dtype.names else _plain
        return convert_array(conversion, value, out)
    convert_all = _elements if conversion.own.sequence is None else _sequences
    writes = _Writes()
    if isinstance(value, (list, tuple)):
        converted = convert_all(conversion, value, out, writes)
    else:
        converted = convert_all(conversion, [value], None if out is None else [out], writes)[0]
    # Only now: a value that is refused leaves the others as they were.
    writes.run()
    return converted


def _is_structure(value: object) -> bool:
    return not isinstance(value, (int, float, list, tuple, numpy.ndarray, numpy.generic))


# Which prototype a value has.


def _source(known: _Known, value: Any, to: str) -> str:
    """The prototype of a value, by its type."""
    if to not in known.prototypes or (isinstance(value, (list, tuple)) and not value):
        # An unknown name is an error here. An empty list has no type, and needs none.
        return known.conversion(to, to).own.name
    all_of = known.prototypes.values()
    if isinstance(value, numpy.ndarray):
        same = [own for own in all_of if own.semantic == known.prototypes[to].semantic]
        names = ", ".join(f"`{own.name}`" for own in same if own.name != to)
        raise ConversionError(
            f"an array does not say what its numbers mean; name their prototype with of=: {names}"
        )
    kind = type(value[0] if isinstance(value, (list, tuple)) else value)
    about = [own for own in all_of if own.name != to and _is_about(own, kind)]
    fit: list[str] = []
    reason: ConversionError | None = None
    for own in about:
        try:
            known.conversion(own.name, to)
        except ConversionError as error:
            reason = error
        else:
            fit.append(own.name)
    if len(fit) == 1:
        return fit[0]
    if fit:
        names = " and ".join(f"`{name}`" for name in fit)
        raise ConversionError(f"{names} are about `{kind.__name__}`; choose one with of=")
    if reason is not None:
        raise reason
    names = ", ".join(f"`{own.name}`" for own in all_of if own.name != to)
    raise ConversionError(
        f"no prototype is about `{kind.__module__}.{kind.__qualname__}`; choose one with of=: {names}"
    )


def _plain_name(name: str) -> str:
    return re.sub(r"[^a-z0-9]", "", name.lower())


def _is_about(prototype: _Prototype, kind: type) -> bool:
    """Whether values of a class have a prototype: generated classes, those of a client, and those of
    rclpy."""
    modules = kind.__module__.split(".")
    if prototype.language == "IDSL":
        module, _, name = prototype.type_name.rpartition("::")
        own, wanted = (modules[-1], kind.__name__), (module, name)
    elif prototype.language.startswith("ROS"):
        package, _, name = prototype.type_name.replace("/msg/", "/").rpartition("/")
        own, wanted = (modules[0], kind.__name__), (package, name)
    else:
        return False
    return [*map(_plain_name, own)] == [*map(_plain_name, wanted)]


# Structures.


def _names(value: Any) -> list[str]:
    if isinstance(value, Mapping):
        return [str(key) for key in value]
    # The slots of a class of rclpy begin with `_`.
    return [name for name in dir(value) if not name.startswith("_")]


def _missing(value: Any, word: str) -> ConversionError:
    near = _native.nearest(word, _names(value))
    hint = f"; did you mean `{near}`?" if near else ""
    kind = type(value).__name__
    return ConversionError(f"a value of `{kind}` has no member `{word}`{hint}")


def _key(value: Any, word: str) -> str | int:
    """The name of a member in a value: that of the IDSL, or the one that Python has for it."""
    if word.isdecimal():
        try:
            has_element = not isinstance(value, Mapping) and int(word) < len(value)
        except TypeError:
            # It has members only.
            has_element = False
        if has_element:
            return int(word)
        raise _missing(value, word)
    for name in (word, _native.name_of("member", word)):
        if name in value if isinstance(value, Mapping) else hasattr(value, name):
            return name
    raise _missing(value, word)


def _at(value: Any, key: str | int) -> Any:
    is_member = isinstance(key, str) and not isinstance(value, Mapping)
    return getattr(value, key) if is_member else value[key]  # type: ignore[arg-type]


def _put(value: Any, key: str | int, number: Any) -> None:
    if isinstance(key, str) and not isinstance(value, MutableMapping):
        setattr(value, key, number)
    else:
        value[key] = number


def _get(value: Any, path: _Path) -> Any:
    for word in path:
        value = _at(value, _key(value, word))
    return value


class _Writes:
    """Members that get new values: all or none."""

    def __init__(self) -> None:
        self.waiting: list[tuple[Any, str | int, Any]] = []

    def add(self, target: Any, path: _Path, value: Any) -> Any:
        """Gives a member a value later. Returns the object that has the member."""
        owner = _get(target, path[:-1])
        self.waiting.append((owner, _key(owner, path[-1]), value))
        return owner

    def run(self) -> None:
        done: list[tuple[Any, str | int, Any]] = []
        try:
            for owner, key, value in self.waiting:
                done.append((owner, key, _at(owner, key)))
                _put(owner, key, value)
        except BaseException:
            for owner, key, old in reversed(done):
                _put(owner, key, old)
            raise


def _has(value: Any, paths: Sequence[_Path]) -> bool:
    try:
        for path in paths:
            _get(value, path)
    except ConversionError:
        return False
    return True


def _grouped(leaves: Sequence[tuple[_Path, Any]]) -> dict[str, list[tuple[_Path, Any]]]:
    """Paths by their first words."""
    found: dict[str, list[tuple[_Path, Any]]] = {}
    for path, leaf in leaves:
        found.setdefault(path[0], []).append((path[1:], leaf))
    return found


def _places(words: Collection[str]) -> list[int] | None:
    """The places of the elements of an array by their names. `None` if these are not numbers."""
    if not all(word.isdecimal() for word in words):
        return None
    places = [int(word) for word in words]
    missing = [place for place in range(len(places)) if place not in places]
    if missing:
        raise ConversionError(f"the prototype has no member for the element {missing[0]} of an array")
    return places


def _object(leaves: Sequence[tuple[_Path, Any]]) -> Any:
    """An object with these members. Those whose names are numbers are elements of an array."""
    if leaves and not leaves[0][0]:
        return leaves[0][1]
    members = {word: _object(inner) for word, inner in _grouped(leaves).items()}
    if _places(members) is None:
        return SimpleNamespace(**members)
    return numpy.array([members[word] for word in sorted(members, key=int)])


def _kept(dropped: _Path) -> ConversionError:
    """The result would have the covariance of the value, in its old units and axes."""
    name = ".".join(dropped)
    return ConversionError(f"the covariance `{name}` is not converted; give an `out` without it")


def _elements(
    conversion: _Conversion, values: Sequence[Any], out: Any, writes: _Writes
) -> list[Any]:
    """The converted structures of a list."""
    _check_length(values, out)
    sources = conversion.sources

    def rows(part: Sequence[Any]) -> _Array:
        numbers = [[_get(value, path) for path in sources] for value in part]
        return numpy.array(numbers, dtype=numpy.float64).reshape(len(part), len(sources))

    blocks = (rows(values[at : at + _BLOCK]) for at in range(0, len(values), _BLOCK))
    results: list[list[Any]] = []
    for block in conversion.rows(blocks):
        results.extend(block.tolist())
    made = []
    for at, (value, numbers) in enumerate(zip(values, results, strict=True)):
        for place, kind in enumerate(conversion.numbers):
            if kind is not None and not kind.startswith("float"):
                numbers[place] = int(numbers[place])
        leaves = list(zip(conversion.targets, numbers, strict=True))
        if out is None and not _has(value, conversion.targets):
            made.append(_object(leaves))
            continue
        target = out[at] if out is not None else value
        for dropped in conversion.dropped:
            if _has(target, [dropped]):
                raise _kept(dropped)
        if out is None:
            target = copy.deepcopy(value)
        for (path, number), kind in zip(leaves, conversion.numbers, strict=True):
            _check_element(writes.add(target, path, number), number, kind, at)
        made.append(target)
    return made


def _check_length(values: Sequence[Any], out: Any) -> None:
    if out is not None and len(out) != len(values):
        raise ConversionError(f"{len(values)} values do not fit `out`, which has {len(out)}")


def _check_element(owner: Any, number: Any, kind: str | None, at: int) -> None:
    """Refuses a number that an array, which is a member, would cut."""
    if isinstance(owner, numpy.ndarray) and owner.dtype != object:
        _check_number(owner.dtype, kind)
        _store(numpy.empty(1, dtype=owner.dtype), numpy.array([number]), at)


def _sequences(
    conversion: _Conversion, values: Sequence[Any], out: Any, writes: _Writes
) -> list[Any]:
    """The structures of a list, each with a member whose elements are values."""
    _check_length(values, out)
    targets = [None] * len(values) if out is None else out
    return [
        _sequence(conversion, value, target, writes)
        for value, target in zip(values, targets, strict=True)
    ]


def _sequence(conversion: _Conversion, value: Any, out: Any, writes: _Writes) -> Any:
    """A structure with a member whose elements are values."""
    own, wanted = conversion.own.sequence, conversion.wanted.sequence
    assert own is not None
    path = (wanted or own).split(".")
    elements = _get(value, own.split("."))
    if isinstance(elements, numpy.ndarray):
        convert_array = _structured if elements.dtype.names else _plain
        elements = convert_array(conversion, elements, None)
    else:
        elements = _elements(conversion, elements, None, writes)
    if out is None and not _has(value, [path]):
        return _object([(path, elements)])
    target = copy.deepcopy(value) if out is None else out
    writes.add(target, path, elements)
    return target


# Arrays.


def _check_number(kind: Any, number: str | None) -> None:
    """Refuses arrays whose numbers the results of a plan are not."""
    dtype = numpy.dtype(kind)
    if dtype.kind != "f" and dtype.name != number:
        wanted = f"`{number}`" if number else "floating-point numbers"
        raise TypeError(f"the results are {wanted}; the array holds `{dtype}`")


def _store(into: _Array, part: _Array, first: int) -> None:
    """Writes numbers that must fit."""
    with numpy.errstate(over="ignore"):
        into[...] = part
    lost = numpy.isfinite(part) & ~numpy.isfinite(into)
    if lost.any():
        place = first + int(numpy.argwhere(lost)[0][0])
        error = ConversionError(f"value {place} is refused: a number does not fit `{into.dtype}`")
        error.code, error.index = "bad-value", place
        raise error


def _columns(members: Sequence[_Path]) -> list[int]:
    """Where a plain array has the numbers of these members: at their places if the prototype is about
    an array, else in their order."""
    places = _places([path[0] if len(path) == 1 else "" for path in members])
    return list(range(len(members))) if places is None else places


def _plain(conversion: _Conversion, value: _Array, out: _Array | None) -> _Array:
    """An array whose last axis has the numbers of a value."""
    taken, given = len(conversion.sources), len(conversion.targets)
    if value.dtype.kind not in "fiu":
        raise TypeError(f"an array of numbers is expected; it holds `{value.dtype}`")
    if value.ndim == 0 or value.shape[-1] != taken:
        members = ", ".join(".".join(path) for path in conversion.sources)
        raise ConversionError(
            f"`{conversion.own.name}` has {taken} numbers ({members}); "
            f"the array has the shape {value.shape}"
        )
    shape = (*value.shape[:-1], given)
    if out is not None and out.shape != shape:
        raise ConversionError(f"the result has the shape {shape}; `out` has {out.shape}")
    kind = out.dtype if out is not None else value.dtype
    if out is None and kind.kind != "f":
        kind = numpy.dtype(numpy.float64)
    for number in conversion.numbers:
        _check_number(kind, number)
    columns, order = _columns(conversion.sources), numpy.argsort(_columns(conversion.targets))
    flat = value.reshape(-1, taken)
    result = numpy.empty((len(flat), given), dtype=kind)
    starts = range(0, len(flat), _BLOCK)
    blocks = (flat[at : at + _BLOCK, columns] for at in starts)
    for at, block in zip(starts, conversion.rows(blocks), strict=True):
        _store(result[at : at + len(block)], block[:, order], at)
    if out is None:
        return result.reshape(shape)
    # Only now: a value that is refused leaves the array as it was.
    out[...] = result.reshape(shape)
    return out


def _column(array: _Array, path: _Path) -> _Array:
    """The numbers of a member of a structured array."""
    for word in path:
        if word.isdecimal():
            if array.ndim == 0 or int(word) >= array.shape[-1]:
                raise ConversionError(f"an array of the shape {array.shape} has no element {word}")
            array = array[..., int(word)]
            continue
        names = array.dtype.names or ()
        wanted = (word, _native.name_of("member", word))
        found = [name for name in wanted if name in names]
        if not found:
            near = _native.nearest(word, list(names))
            hint = f"; did you mean `{near}`?" if near else ""
            raise ConversionError(f"the array has no field `{word}`{hint}")
        array = array[found[0]]
    return array


def _has_column(array: _Array, path: _Path) -> bool:
    try:
        _column(array, path)
    except ConversionError:
        return False
    return True


def _fields(leaves: Sequence[tuple[_Path, Any]]) -> Any:
    """The type of a structured array with these members."""
    if not leaves[0][0]:
        return leaves[0][1]
    inner = {word: _fields(inner) for word, inner in _grouped(leaves).items()}
    if _places(inner) is not None:
        return (next(iter(inner.values())), (len(inner),))
    return [(word, kind) if not isinstance(kind, tuple) else (word, *kind) for word, kind in inner.items()]


def _structured(conversion: _Conversion, value: _Array, out: _Array | None) -> _Array:
    """An array whose fields have the names of the members."""
    sources = [_column(value, path) for path in conversion.sources]
    if out is not None and out.shape != value.shape:
        raise ConversionError(f"the result has the shape {value.shape}; `out` has {out.shape}")
    result = out
    if result is None:
        has_all = all(_has_column(value, path) for path in conversion.targets)
        result = value.copy() if has_all else _with_fields(conversion, value)
    for dropped in conversion.dropped:
        if _has_column(result, dropped):
            raise _kept(dropped)
    targets = [_column(result, path) for path in conversion.targets]
    for target, number in zip(targets, conversion.numbers, strict=True):
        _check_number(target.dtype, number)
    if any(source.shape != value.shape for source in [*sources, *targets]):
        raise ConversionError("a member that is to be converted is not a single number")
    columns = [source.reshape(-1) for source in sources]
    results = [numpy.empty(value.size, dtype=target.dtype) for target in targets]
    starts = range(0, value.size, _BLOCK)
    blocks = (
        numpy.stack([column[at : at + _BLOCK] for column in columns], axis=-1, dtype=numpy.float64)
        for at in starts
    )
    for at, block in zip(starts, conversion.rows(blocks), strict=True):
        for place, column in enumerate(results):
            _store(column[at : at + len(block)], block[:, place], at)
    # Only now, as for plain arrays.
    for target, column in zip(targets, results, strict=True):
        target[...] = column.reshape(value.shape)
    return result


def _with_fields(conversion: _Conversion, value: _Array) -> _Array:
    """An array with the fields of the second prototype, and those that the first one does not use."""
    leaves = zip(conversion.targets, conversion.numbers, strict=True)
    new = _fields([(path, number or "float64") for path, number in leaves])
    if isinstance(new, tuple):
        raise ConversionError(
            f"`{conversion.wanted.name}` has no names for its numbers; convert a plain array"
        )
    used = {path[0] for path in conversion.sources}
    used |= {dropped[0] for dropped in conversion.dropped}
    used |= {_native.name_of("member", name) for name in used}
    names = {field[0] for field in new}
    assert value.dtype.names is not None
    kept = [name for name in value.dtype.names if name not in used | names]
    kinds = [(name, value.dtype[name]) for name in kept]
    result = numpy.empty(value.shape, dtype=[*new, *kinds])
    for name in kept:
        result[name] = value[name]
    return result
