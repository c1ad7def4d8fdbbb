"""The component in Python of the test of ages: it prints what it sees, each line once until another one."""

import os

from aged import (
    CallError,
    Context,
    Fresh,
    FullPoseEuler,
    Made,
    NoValue,
    Stale,
    TBattery,
    TData,
    Worker,
)


class SpecificWorker(Worker):
    """The worker of `aged`."""

    def initialize(self, ctx: Context) -> None:
        self.seen: set[str] = set()
        self.last = ""
        self.number = 0
        try:
            ctx.poses.new_full_pose()
        except NoValue:
            self.see("no value")
        if ctx.name == "giver":
            percentage = float(os.environ["AGED_BATTERY"])
            ctx.battery_status.set_get_battery_state(TBattery(percentage=percentage))

    def see(self, what: str) -> None:
        if what not in self.seen:
            self.seen.add(what)
            print(what, flush=True)

    def compute(self, ctx: Context) -> None:
        if ctx.name == "giver":
            self.give(ctx)
        else:
            self.ask(ctx)

    def give(self, ctx: Context) -> None:
        self.number += 1
        ctx.laser_pub.push_laser_data([TData(dist=float(self.number))])
        ctx.sent.new_full_pose(FullPoseEuler(x=float(self.number)))
        try:
            first = ctx.poses.new_full_pose()
            scan = ctx.scans.push_laser_data()
        except NoValue:
            return
        if first.made is not Made.COMPUTED or scan.made is not Made.COMPUTED:
            return
        again = ctx.poses.new_full_pose()
        assert again.made is Made.CACHED and first.is_fresh and first.age <= again.age
        assert again.value == first.value
        self.see(f"both are {again.with_(scan).made.value}")

    def ask(self, ctx: Context) -> None:
        try:
            battery = ctx.other.get_battery_state()
            how = ctx.other.freshness
            assert how is not None and how.is_fresh
            now = f"{battery.percentage:.0f} is {how.made.value}"
        except CallError as error:
            now = type(error).__name__
        if now != self.last:
            self.last = now
            print(now, flush=True)
        try:
            ctx.strict.get_battery_state()
        except Stale as error:
            self.see("stale" if error.age.total_seconds() > 0.05 else "not stale")
        except CallError:
            pass

    def view(
        self, ctx: Context, push_laser_data: Fresh[list[TData]], new_full_pose: Fresh[FullPoseEuler]
    ) -> None:
        assert push_laser_data.value[0].dist == new_full_pose.value.x
        assert push_laser_data.age >= new_full_pose.age
        if ctx.name == "giver":
            self.see("collected")

    def battery_status_get_battery_state(self, ctx: Context) -> TBattery:
        self.see("handled")
        return TBattery()
