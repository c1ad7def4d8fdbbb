"""The values of `values.rs`, made again, and what differs between two values."""

import dataclasses
from typing import Any

import numpy as np
from every_type import (
    Arrays,
    Bare,
    Bounded,
    Broken,
    Defaults,
    Dictionaries,
    Everything,
    Gone,
    Kind,
    Numbers,
    Optionals,
    Point,
    Sequences,
    VeryBroken,
)

LEAST, MOST, SOME = 1, 2, 3


def numbers(which: int) -> Numbers:
    if which == LEAST:
        return Numbers(
            flag=False,
            b=0,
            s=-(2**15),
            i=-(2**31),
            l=-(2**63),
            f=-3.4028234663852886e38,
            d=-1.7976931348623157e308,
            small=-(2**7),
            positive=0,
            middle=-(2**15),
            port=0,
            large=-(2**31),
            address=0,
            huge=-(2**63),
            mask=0,
            coarse=2.0**-149,
            fine=5e-324,
        )
    if which == MOST:
        return Numbers(
            flag=True,
            b=2**8 - 1,
            s=2**15 - 1,
            i=2**31 - 1,
            l=2**63 - 1,
            f=3.4028234663852886e38,
            d=1.7976931348623157e308,
            small=2**7 - 1,
            positive=2**8 - 1,
            middle=2**15 - 1,
            port=2**16 - 1,
            large=2**31 - 1,
            address=2**32 - 1,
            huge=2**63 - 1,
            mask=2**64 - 1,
            coarse=float("inf"),
            fine=float("-inf"),
        )
    return Numbers(True, 1, -2, 3, -4, 0.5, -0.25, -5, 6, -7, 8, -9, 10, -11, 12, 1.5, -2.5)


def outline(length: int) -> list[Point]:
    return [Point(at + 0.5, -1e300) for at in range(length)]


def names() -> dict[str, float]:
    return {"": 0.0, "Grüße, 世界": -12.5}


def sequences(which: int) -> Sequences:
    if which == LEAST:
        return Sequences()
    least, most = numbers(LEAST), numbers(MOST)
    return Sequences(
        flags=np.array([True, False, True]),
        bytes_=np.arange(256, dtype=np.uint8),
        smalls=np.array([least.small, 0, most.small], np.int8),
        shorts=np.array([least.s, 0, most.s], np.int16),
        ports=np.array([0, most.port], np.uint16),
        ints=np.array([least.i, 0, most.i], np.int32),
        addresses=np.array([0, most.address], np.uint32),
        longs=np.array([least.l, 0, most.l], np.int64),
        masks=np.array([0, most.mask], np.uint64),
        floats=np.array([least.f, 0.5, most.f, least.coarse], np.float32),
        doubles=np.array([least.d, 0.5, most.d, most.fine], np.float64),
        texts=["", "Grüße, 世界", "x" * 1000],
        kinds=[Kind.PERSON, Kind.NOTHING, Kind.WALL, Kind.DOOR],
        points=outline(100),
        rows=[least, most, numbers(SOME)],
        outlines=[[], outline(3), outline(1)],
        matrix=[np.array([1.0, 2.0]), np.array([], np.float64), np.array([3.0])],
        paths=[[], [["a", "b"], []], [["c"]]],
        tables=[{}, names()],
    )


def bounded(which: int) -> Bounded:
    if which == LEAST:
        return Bounded()
    return Bounded(
        text="Grüße!",
        bytes_=np.array([1, 2, 3, 255], np.uint8),
        doubles=np.array([0.5, -0.5]),
        texts=["four", "üß"],
        rows=[np.array([1, 2, 3], np.int32), np.array([-4], np.int32)],
        kinds=[Kind.DOOR, Kind.WALL],
        outline=outline(3),
    )


def arrays(which: int) -> Arrays:
    if which == LEAST:
        return Arrays()
    least, most = numbers(LEAST), numbers(MOST)
    return Arrays(
        flags=np.array([True, False, True]),
        bytes_=np.array([0, 1, 254, 255], np.uint8),
        smalls=np.array([least.small, most.small], np.int8),
        shorts=np.array([least.s, most.s], np.int16),
        ports=np.array([1, most.port], np.uint16),
        ints=np.array([least.i, most.i], np.int32),
        addresses=np.array([1, most.address], np.uint32),
        longs=np.array([least.l, most.l], np.int64),
        masks=np.array([1, most.mask], np.uint64),
        floats=np.array([0.5, -1.5, 2.5], np.float32),
        doubles=np.arange(40) / 4,
        texts=["", "Grüße"],
        words=["four", "ü"],
        kinds=[Kind.PERSON, Kind.DOOR],
        corners=outline(4),
        outlines=[outline(2), []],
        tables=[names(), {}],
    )


def dictionaries(which: int) -> Dictionaries:
    if which == LEAST:
        return Dictionaries()
    return Dictionaries(
        by_text=names(),
        by_bool={False: "no", True: "yes"},
        by_byte={0: 1, 255: -1},
        by_int8={-128: 1, 127: -1},
        by_short={-(2**15): np.array([1, 2], np.int32), 2**15 - 1: np.array([], np.int32)},
        by_uint16={0: Kind.DOOR, 2**16 - 1: Kind.NOTHING},
        by_int={-(2**31): Point(1.0, 2.0), 2**31 - 1: Point()},
        by_uint32={0: outline(3), 2**32 - 1: []},
        by_long={-(2**63): names(), 2**63 - 1: {}},
        by_uint64={0: True, 2**64 - 1: False},
        by_word={"": [], "four": ["a", "b"]},
        by_kind={Kind.NOTHING: numbers(LEAST), Kind.PERSON: numbers(MOST)},
    )


def optionals(which: int) -> Optionals:
    if which == LEAST:
        return Optionals()
    if which == MOST:
        # Present, and empty.
        return Optionals(False, 0, 0.0, "", Kind.NOTHING, Point(), np.array([], np.float32), [], {})
    floats = np.array([0.5, -0.5], np.float32)
    some = [[], outline(2)]
    return Optionals(True, -(2**63), 1e-300, "text", Kind.DOOR, Point(1.0, 2.0), floats, some, names())


def defaults(which: int) -> Defaults:
    if which == LEAST:
        return Defaults()
    none = np.array([7], np.int32)
    return Defaults(False, -1, 1, 0.0, "", "", Kind.WALL, None, Point(1.0, 1.0), none)


def sample(which: int) -> Everything:
    return Everything(
        number=which,
        bare=Bare(),
        numbers=numbers(which),
        sequences=sequences(which),
        bounded=bounded(which),
        arrays=arrays(which),
        dictionaries=dictionaries(which),
        optionals=optionals(which),
        defaults=defaults(which),
    )


def thrown(which: int) -> Broken | VeryBroken | Gone:
    if which == LEAST:
        return Broken()
    if which == MOST:
        return VeryBroken("Grüße", -(2**31), outline(2), Kind.DOOR, names())
    return Gone()


def difference(own: Any, other: Any, place: str = "value") -> str:
    """Where two values differ, or one has another type; empty if they are the same."""
    if type(own) is not type(other):
        return f"{place}: {other!r} is no {type(own).__name__}"
    if dataclasses.is_dataclass(own):
        parts = [
            (f"{place}.{field.name}", getattr(own, field.name), getattr(other, field.name))
            for field in dataclasses.fields(own)
        ]
    elif isinstance(own, np.ndarray):
        same = own.dtype == other.dtype and np.array_equal(own, other)
        return "" if same else f"{place}: {other!r} is not {own!r}"
    elif isinstance(own, list):
        if len(own) != len(other):
            return f"{place}: {len(other)} elements, not {len(own)}"
        parts = [(f"{place}[{at}]", *pair) for at, pair in enumerate(zip(own, other, strict=True))]
    elif isinstance(own, dict):
        keys = {(type(key), key) for key in own}
        if keys != {(type(key), key) for key in other}:
            return f"{place}: the keys {list(other)!r} are not {list(own)!r}"
        parts = [(f"{place}[{key!r}]", own[key], other[key]) for key in own]
    else:
        return "" if own == other else f"{place}: {other!r} is not {own!r}"
    return next(filter(None, (difference(*pair, name) for name, *pair in parts)), "")
