"""Publishes the time of the network."""

from collections.abc import Sequence
from datetime import timedelta

from robocomp import Order

from clock_python import Context, Fatal, ParamChange, Worker

# The shortest period of a component.
SHORTEST = timedelta(microseconds=100)
# The period while nothing sets the pace.
IDLE = timedelta(milliseconds=10)


class SpecificWorker(Worker):
    """Advances time by a step in each `compute`."""

    def initialize(self, ctx: Context) -> None:
        if not ctx.time.is_active:
            raise Fatal(
                "the network has another clock; write `time simulated by NAME;` in its .ddsl"
            )
        self.pace(ctx)

    def compute(self, ctx: Context) -> None:
        # While a follower is missing, the runtime goes on waiting.
        if not ctx.params.paused and not self.is_over(ctx) and not ctx.time.missing():
            ctx.time.advance(ctx.params.step)

    def params_changed(self, ctx: Context, changes: Sequence[ParamChange]) -> None:
        self.pace(ctx)

    def is_over(self, ctx: Context) -> bool:
        """Whether the last tick of the run is over."""
        end = ctx.params.end
        return end > timedelta(0) and ctx.now() >= end

    def pace(self, ctx: Context) -> None:
        """Sets how fast time passes, and for whom it waits."""
        params = ctx.params
        is_paced = params.rate > 0.0
        ctx.time.set_paced(is_paced)
        ctx.time.set_order(Order.AT_ONCE if params.at_once else Order.IN_TURN)
        if params.wait:
            ctx.time.wait_for_all(params.limit)
        else:
            ctx.time.wait_for_nobody()
        ctx.period = max(params.step / params.rate, SHORTEST) if is_paced else IDLE
