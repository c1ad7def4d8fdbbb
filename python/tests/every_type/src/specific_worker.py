"""The component in Python at the other end of the conformance tests: it has each value checked, sends
it back, and makes calls when it is asked to."""

import dataclasses
import time
from datetime import timedelta

import numpy as np
import numpy.typing as npt
from every_type import (
    CallError,
    Context,
    Everything,
    Kind,
    OutputsAnswer,
    Picture,
    PictureView,
    Point,
    Refused,
    SeveralAnswer,
    Worker,
)
from robocomp import RemoteError
from values import difference, sample, thrown

IS_SLOW = 5


class SpecificWorker(Worker):
    """The worker of `every_type`."""

    def initialize(self, ctx: Context) -> None:
        self.numbers: list[int] = []

    def compute(self, ctx: Context) -> None:
        """Has nothing to do."""

    def types_echo(self, ctx: Context, all: Everything) -> Everything:
        return all

    def types_differs(self, ctx: Context, all: Everything) -> str:
        return difference(sample(all.number), all)

    def types_make(self, ctx: Context, number: int) -> Everything:
        return sample(number)

    def types_mirrored(self, ctx: Context, number: int) -> str:
        # The server is slow when it is asked for that.
        slow = number == -IS_SLOW
        ctx.mirror.timeout = timedelta(milliseconds=50 if slow else 20_000)
        try:
            if number > 0:
                return difference(sample(number), ctx.mirror.echo(sample(number)))
            ctx.mirror.fail(-number)
        except RemoteError as error:
            return difference(thrown(-number), error)
        except Refused as error:
            return f"Refused: {error}"
        except CallError as error:
            return type(error).__name__
        return "nothing was thrown"

    def types_turned(self, ctx: Context, picture: Picture) -> Picture:
        picture.data = np.flip(picture.data)
        return picture

    def types_several(
        self,
        ctx: Context,
        number: int,
        text: str,
        outline: list[Point],
        kind: Kind,
        point: Point | None,
    ) -> SeveralAnswer:
        return SeveralAnswer(number, text, outline, kind, point)

    def types_outputs(self, ctx: Context) -> OutputsAnswer:
        return OutputsAnswer(-(2**63), ["a", ""])

    def types_ranged(self, ctx: Context, number: int) -> int:
        return number + 5

    def types_fail(self, ctx: Context, which: int) -> None:
        if which:
            raise thrown(which)

    def types_wait(self, ctx: Context, milliseconds: int) -> None:
        ctx.repeats.several(milliseconds, 0.0, "", [], Kind.NOTHING, None)
        time.sleep(milliseconds / 1000)

    def types_note(self, ctx: Context, all: Everything) -> None:
        self.numbers.append(all.number)

    def types_noted(self, ctx: Context) -> npt.NDArray[np.int32]:
        return np.array(self.numbers, np.int32)

    def samples_all(self, ctx: Context, all: Everything) -> None:
        ctx.repeats.all(all)

    def samples_several(
        self,
        ctx: Context,
        number: int,
        level: float,
        text: str,
        outline: list[Point],
        kind: Kind,
        point: Point | None,
    ) -> None:
        ctx.repeats.several(number, level, text, outline, kind, point)

    def samples_nothing(self, ctx: Context) -> None:
        ctx.repeats.nothing()

    def pictures_picture(self, ctx: Context, picture: PictureView) -> None:
        value = picture.copy()
        if picture.flag:
            ctx.copies.copy(value)
            return
        with ctx.copies.loan_copy() as copy:
            for member in dataclasses.fields(value):
                setattr(copy, member.name, getattr(value, member.name))
            copy.resize("data", len(picture.data))[:] = picture.data

    def earlier_earlier(self, ctx: Context, all: Everything) -> None:
        self.numbers.append(all.number)
        ctx.latest.latest(all)
