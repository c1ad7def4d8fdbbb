"""Slot arrays under test: members that the worker opens, and fakes for each."""

import pytest
from robocomp import Error, NoServer, StartError

from rack_python import FullPoseEuler, Member, MemberError, Params, TData
from rack_python.testing import Fault, TestContext
from specific_worker import SpecificWorker


def of(*members: str) -> TestContext:
    return TestContext(Params(members=list(members)))


def published(test: TestContext, name: str) -> list[float]:
    return [pose.x for _, pose in test.poses.member(name).take_samples()]


def test_handlers_learn_which_member_is_asked() -> None:
    test = of("front", "back")
    worker = test.start(SpecificWorker)
    members = test.ctx.lasers.members()
    assert [(m.index, m.name) for m in members] == [(0, "front"), (1, "back")]
    assert list(test.ctx.lasers) == members and len(test.ctx.lasers) == 2
    for member, dist in zip(members, (1000.0, 2000.0)):
        assert worker.lasers_get_laser_data(test.ctx, member) == [TData(dist=dist)]
        found = worker.lasers_get_laser_conf_data(test.ctx, member)
        assert found.device == member.name
    assert test.ctx.lasers.get("left") is None


def test_each_member_has_a_fake_peer_of_its_own() -> None:
    test = of("front", "back")
    # Before the worker opens the member, and afterwards.
    test.sources.member("front").on_get_laser_data([TData(dist=7.0)])
    test.list_members("sources", ["front", "back"])
    worker = test.start(SpecificWorker)
    back = test.sources.member("back")
    back.on_get_laser_data(lambda: [TData(dist=9.0)])
    lasers = test.ctx.lasers.members()

    def scan(member: Member) -> list[TData]:
        return worker.lasers_get_laser_data(test.ctx, member)

    assert [scan(laser) for laser in lasers] == [[TData(dist=7.0)], [TData(dist=9.0)]]
    assert len(test.sources.all()) == 2
    assert [len(fake.calls()) for fake in test.sources.all()] == [1, 1]
    back.fail(Fault.NO_SERVER)
    assert scan(lasers[1]) == [] and scan(lasers[0]) == [TData(dist=7.0)]
    source = test.ctx.sources.get("back")
    assert source is not None
    assert not test.ctx.sources[source].is_connected
    with pytest.raises(NoServer, match="`test/rack_python/sources/back`"):
        test.ctx.sources[source].get_laser_data()
    worker.compute(test.ctx)
    assert (published(test, "front"), published(test, "back")) == ([1.0], [2.0])


def test_default_answers_reach_members_that_the_worker_opens_later() -> None:
    test = of("front", "back")
    test.answer_defaults()
    test.sources.member("front").on_get_laser_data([TData(dist=7.0)])
    test.list_members("sources", ["front", "back"])
    worker = test.start(SpecificWorker)
    front, back = test.ctx.lasers.members()
    assert worker.lasers_get_laser_data(test.ctx, front) == [TData(dist=7.0)]
    assert worker.lasers_get_laser_data(test.ctx, back) == []
    # The defaults have answered: a call without an answer is refused, and the worker returns none.
    (source,) = [s for s in test.ctx.sources if s.name == "back"]
    assert test.ctx.sources[source].get_laser_conf_data().device == ""


def test_samples_come_with_their_member() -> None:
    test = of("front", "back")
    test.list_members("tracks", ["back"])
    worker = test.start(SpecificWorker)
    [back] = test.ctx.tracks
    worker.tracks_new_full_pose(test.ctx, back, FullPoseEuler(x=42.0))
    worker.compute(test.ctx)
    assert (published(test, "front"), published(test, "back")) == ([1.0], [42.0])


def test_what_is_no_member_is_refused_with_its_reason() -> None:
    test = of()
    test.ctx.lasers.open("front")
    for name, reason in (
        ("Front", "`lasers` already has the member `front`; give `Front` another name"),
        ("a/b\n", r"`a/b\\n` cannot be a member of `lasers`: the name of a member has"),
    ):
        with pytest.raises(MemberError, match=reason):
            test.ctx.lasers.open(name)
    for number in range(1, 128):
        test.ctx.lasers.open(f"m{number}")
    with pytest.raises(MemberError, match="has 128 members, which is the maximum"):
        test.ctx.lasers.open("more")
    assert len(test.ctx.lasers) == 128


def test_a_member_of_another_array_is_no_key() -> None:
    test = of("front")
    test.start(SpecificWorker)
    [laser] = test.ctx.lasers
    with pytest.raises(LookupError, match="'front' is not a member of this slot array"):
        test.ctx.poses[laser]
    [pose] = test.ctx.poses
    assert laser != pose and laser in test.ctx.lasers and pose not in test.ctx.lasers


def test_members_are_opened_in_initialize_and_are_those_of_the_network() -> None:
    test = of("front")
    test.start(SpecificWorker)
    with pytest.raises(MemberError, match="`lasers.late` comes too late; open members"):
        test.ctx.lasers.open("late")
    test = of("front", "up")
    test.list_members("lasers", ["front", "back"])
    with pytest.raises(StartError, match="it lists `back`, which the worker does not"):
        test.start(SpecificWorker)
    with pytest.raises(Error, match="rack_python has no slot array `laser`"):
        test.list_members("laser", [])
