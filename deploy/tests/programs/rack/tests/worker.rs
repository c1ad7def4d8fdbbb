//! Slot arrays under test: members that the worker opens, fakes for each, and members over a real
//! middleware.

use rack::SpecificWorker;
use rack_generated::testing::{Fault, PosesSample, TestContext};
use rack_generated::{
    Context, FullPoseEuler, Lasers, MemberError, Params, TData, Tracks, Worker, WorkerError,
};

fn of(members: &[&str]) -> TestContext {
    let members = members.iter().map(|name| (*name).to_owned()).collect();
    TestContext::new(Params { members })
}

fn measure(dist: f32) -> TData {
    TData { angle: 0.0, dist }
}

#[test]
fn handlers_learn_which_member_is_asked() -> Result<(), WorkerError> {
    let mut test = of(&["front", "back"]);
    let mut worker = SpecificWorker::initialize(&mut test)?;
    let members = test.lasers.members().to_vec();
    let named: Vec<_> = members.iter().map(|m| (m.index(), m.name())).collect();
    assert_eq!(named, [(0, "front"), (1, "back")]);
    for (member, dist) in members.iter().zip([1000.0, 2000.0]) {
        let scan = worker.get_laser_data(&mut test, member);
        assert_eq!(scan, [measure(dist)]);
        let configuration = worker.get_laser_conf_data(&mut test, member);
        assert_eq!(configuration.device, member.name());
    }
    Ok(())
}

#[test]
fn each_member_has_a_fake_peer_of_its_own() -> Result<(), WorkerError> {
    let mut test = of(&["front", "back"]);
    // Before the worker opens the member, and afterwards.
    test.sources
        .member("front")
        .on_get_laser_data(|| vec![measure(7.0)]);
    test.list_members("sources", &["front", "back"]);
    let mut worker = SpecificWorker::initialize(&mut test)?;
    let back = test.sources.member("back");
    back.on_get_laser_data(|| vec![measure(9.0)]);
    let lasers = test.lasers.members().to_vec();
    assert_eq!(worker.get_laser_data(&mut test, &lasers[0]), [measure(7.0)]);
    assert_eq!(worker.get_laser_data(&mut test, &lasers[1]), [measure(9.0)]);
    assert_eq!(
        (
            back.calls().len(),
            test.sources.member("front").calls().len()
        ),
        (1, 1)
    );
    back.fail(Fault::NoServer);
    assert_eq!(worker.get_laser_data(&mut test, &lasers[1]), []);
    assert_eq!(worker.get_laser_data(&mut test, &lasers[0]), [measure(7.0)]);

    worker.compute(&mut test)?;
    let published = |test: &TestContext, name: &str| {
        let samples = test.poses.member(name).take_samples();
        let poses = samples
            .into_iter()
            .map(|PosesSample::NewFullPose { pose }| pose.x);
        poses.collect::<Vec<f32>>()
    };
    assert_eq!(published(&test, "front"), [1.0]);
    assert_eq!(published(&test, "back"), [2.0]);
    Ok(())
}

#[test]
fn default_answers_reach_members_that_the_worker_opens_later() -> Result<(), WorkerError> {
    let mut test = of(&["front", "back"]);
    test.answer_defaults();
    test.sources
        .member("front")
        .on_get_laser_data(|| vec![measure(7.0)]);
    test.list_members("sources", &["front", "back"]);
    let mut worker = SpecificWorker::initialize(&mut test)?;
    let lasers = test.lasers.members().to_vec();
    assert_eq!(worker.get_laser_data(&mut test, &lasers[0]), [measure(7.0)]);
    let ctx: &mut Context = &mut test;
    let back = ctx.sources.get("back").cloned().expect("a member");
    assert_eq!(ctx.sources[&back].get_laser_data(), Ok(Vec::new()));
    Ok(())
}

#[test]
fn samples_come_with_their_member() -> Result<(), WorkerError> {
    let mut test = of(&["front", "back"]);
    test.list_members("tracks", &["back"]);
    let mut worker = SpecificWorker::initialize(&mut test)?;
    let back = test.tracks.members()[0].clone();
    let pose = FullPoseEuler {
        x: 42.0,
        ..FullPoseEuler::default()
    };
    <SpecificWorker as Tracks<Context>>::new_full_pose(&mut worker, &mut test, &back, pose);
    worker.compute(&mut test)?;
    let x = |name: &str| {
        let samples = test.poses.member(name).samples();
        samples
            .into_iter()
            .map(|PosesSample::NewFullPose { pose }| pose.x)
            .collect::<Vec<_>>()
    };
    assert_eq!((x("front"), x("back")), (vec![1.0], vec![42.0]));
    Ok(())
}

#[test]
fn what_is_no_member_is_refused_with_its_reason() {
    let mut test = of(&[]);
    let said = |error: Result<_, MemberError>| error.map(|_| ()).expect_err("an error").to_string();
    test.lasers.open("front").expect("a member");
    for (name, reason) in [
        (
            "Front",
            "`lasers` already has the member `front`; give `Front` another name",
        ),
        (
            "a/b\n",
            "`a/b\\n` cannot be a member of `lasers`: the name of a member has a letter, then letters, digits and single `_`, none at the end",
        ),
    ] {
        assert_eq!(said(test.lasers.open(name)), reason);
    }
    for number in 1..128 {
        test.lasers.open(&format!("m{number}")).expect("a member");
    }
    assert_eq!(
        said(test.lasers.open("more")),
        "`lasers` has 128 members, which is the maximum; there is no place for `more`"
    );
    assert_eq!(test.lasers.len(), 128);
}

#[test]
fn members_are_opened_in_initialize_and_are_those_of_the_network() {
    let mut test = of(&["front"]);
    test.start::<SpecificWorker>().expect("a worker");
    let late = test.lasers.open("late").map(|_| ()).expect_err("too late");
    assert_eq!(
        late.to_string(),
        "`lasers.late` comes too late; open members in `initialize`"
    );
    let mut test = of(&["front", "up"]);
    test.list_members("lasers", &["front", "back"]);
    let wrong = test.start::<SpecificWorker>().err().expect("an error");
    let said = wrong.to_string();
    assert!(
        said.contains("it lists `back`, which the worker does not open"),
        "{said}"
    );
}

#[test]
#[should_panic(expected = "`front` is a member of another slot array")]
fn a_member_of_another_array_is_no_index() {
    let mut test = of(&["front"]);
    SpecificWorker::initialize(&mut test).expect("a worker");
    let laser = test.lasers.members()[0].clone();
    let ctx: &Context = &test;
    let _ = &ctx.poses[&laser];
}
