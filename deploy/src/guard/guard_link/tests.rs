//! A guard whose part the test takes.

use super::*;
use crate::process::identity::Identity;
use std::io::{BufRead, BufReader, Read, Write};
use std::net::Shutdown;

/// A guard whose answers the test gives. Its process ends with it.
fn guard(services: usize) -> (Guard, UnixStream) {
    let (link, theirs) = UnixStream::pair().expect("a pair");
    link.set_nonblocking(true).expect("a mode");
    let limit = Some(Duration::from_secs(10));
    theirs.set_read_timeout(limit).expect("a limit");
    let child = Command::new("cat")
        .stdin(Stdio::piped())
        .stdout(Stdio::null())
        .spawn()
        .expect("it starts");
    let guard = Guard::of(child, link, services, MAX_REPORTS).expect("a guard");
    (guard, theirs)
}

fn answer(guard: &mut Guard, mut theirs: &UnixStream, answer: &Answer) {
    theirs.write_all(&lines::encode(answer)).expect("it reads");
    guard.turn();
}

/// Says that it has guarded, and created so many services, some time ago.
fn guarding(services: usize, held: usize) -> (Guard, UnixStream) {
    let (mut guard, theirs) = guard(services);
    answer(&mut guard, &theirs, &Answer::Held { count: held });
    guard.moved = ago(Duration::from_mins(1));
    (guard, theirs)
}

fn ago(time: Duration) -> Instant {
    Instant::now().checked_sub(time).expect("a time")
}

/// Lets it be stuck until its limit. Returns why it is killed.
fn stuck(mut guard: Guard) -> String {
    let deadline = guard.deadline().expect("it is busy");
    assert_eq!(deadline, guard.moved + STEP_LIMIT);
    let early = deadline
        .checked_sub(Duration::from_nanos(1))
        .expect("a time");
    guard.check(early);
    assert_eq!(guard.failure, None);
    guard.check(deadline);
    assert_eq!(guard.deadline(), None, "it is killed once");
    assert!(first_readable([&guard.pidfd], KILL_LIMIT).is_some());
    guard.reap()
}

/// Sends more than its socket holds.
fn fill(guard: &mut Guard) {
    guard.output.push(&vec![b' '; 2 << 20]);
    guard.write();
    assert!(!guard.output.is_empty());
}

#[test]
fn its_answers_say_how_far_it_is() {
    let (mut guard, theirs) = guard(3);
    assert_eq!(guard.held(), None);
    answer(&mut guard, &theirs, &Answer::Guarding);
    assert_eq!(guard.held(), Some(0));
    answer(&mut guard, &theirs, &Answer::Held { count: 2 });
    answer(&mut guard, &theirs, &Answer::Held { count: 1 });
    answer(&mut guard, &theirs, &Answer::Cleaning);
    assert_eq!(guard.held(), Some(2));
    for component in ["a", "b"] {
        let component = component.to_owned();
        answer(&mut guard, &theirs, &Answer::Removed { component });
    }
    assert_eq!(guard.take_removed(), ["a", "b"]);
    assert_eq!(guard.take_removed(), [""; 0]);
    answer(&mut guard, &theirs, &Answer::Released);
    assert_eq!(guard.held(), Some(3));
    assert_eq!(guard.failure, None);
}

#[test]
fn another_program_is_no_guard() {
    let (mut guard, mut theirs) = guard(0);
    theirs.write_all(b"usage: cat\n").expect("it reads");
    guard.turn();
    assert!(first_readable([&guard.pidfd], KILL_LIMIT).is_some());
    guard.fail("another reason");
    assert_eq!(
        guard.reap(),
        "it is another program; does it know the argument `guard`?"
    );
}

#[test]
fn its_end_is_described() {
    let (mut guard, _theirs) = guard(0);
    drop(guard.child.stdin.take());
    assert!(first_readable([&guard.pidfd], Duration::from_secs(10)).is_some());
    assert_eq!(guard.reap(), "exit status: 0");
    // The reader of its link is gone.
    let (mut guard, theirs) = self::guard(0);
    theirs.shutdown(Shutdown::Both).expect("a socket");
    guard.ended(1);
    assert!(guard.output.is_empty());
    assert!(first_readable([&guard.pidfd], KILL_LIMIT).is_some());
    assert!(guard.reap().contains("SIGKILL"));
}

#[test]
fn a_guard_that_is_stuck_is_killed() {
    let text = |at: &str| format!("it {at}, and came no further for 12s");
    assert_eq!(stuck(guard(1).0), text("did not start"));
    let (one, _theirs) = guarding(2, 1);
    assert_eq!(stuck(one), text("has created 1 of 2 services"));
    let (mut cleans, _theirs) = guarding(2, 2);
    cleans.clean_up(1);
    cleans.moved = ago(Duration::from_mins(1));
    assert_eq!(stuck(cleans), text("does not clean up"));
    let (mut full, _theirs) = guarding(2, 2);
    fill(&mut full);
    assert_eq!(stuck(full), text("does not read"));
}

#[test]
fn a_guard_with_nothing_to_do_has_no_limit() {
    let (mut guard, theirs) = guarding(2, 2);
    assert!(!guard.is_busy());
    assert_eq!((guard.deadline(), guard.patience()), (None, None));
    guard.check(Instant::now() + Duration::from_hours(1));
    assert_eq!(guard.failure, None);
    // Its limit begins with its next task.
    guard.clean_up(1);
    assert!(guard.deadline().is_some_and(|at| at > Instant::now()));
    answer(&mut guard, &theirs, &Answer::Cleaned { deaths: 1 });
    assert_eq!(guard.deadline(), None);
    let (none, _theirs) = guarding(0, 0);
    assert_eq!(none.deadline(), None);
}

#[test]
fn only_progress_gives_a_busy_guard_more_time() {
    let (mut guard, theirs) = guarding(2, 1);
    let before = guard.moved;
    guard.ended(1);
    // Sent bytes are progress; a waiting task makes none.
    assert!(guard.moved > before);
    guard.moved = before;
    guard.write();
    assert_eq!(guard.moved, before, "there was nothing to write");
    fill(&mut guard);
    guard.moved = before;
    guard.ended(2);
    guard.turn();
    assert_eq!(guard.moved, before, "it does not read");
    let mut some = vec![0; 64 << 10];
    (&theirs).read_exact(&mut some).expect("bytes");
    guard.turn();
    assert!(guard.moved > before);
    guard.moved = before;
    answer(&mut guard, &theirs, &Answer::Cleaning);
    assert!(guard.moved > before);
}

#[test]
fn its_link_is_polled_for_what_waits() {
    let (mut guard, _theirs) = guard(0);
    assert_eq!(guard.link().1, PollFlags::IN);
    fill(&mut guard);
    assert_eq!(guard.link().1, PollFlags::IN | PollFlags::OUT);
}

#[test]
fn components_wait_for_a_clean_up_for_a_while() {
    let (mut guard, theirs) = guarding(0, 0);
    guard.clean_up(2);
    guard.clean_up(3);
    assert_eq!(guard.patience(), Some(guard.moved + CLEAN_PATIENCE));
    assert_eq!(guard.cleaned(), 0);
    answer(&mut guard, &theirs, &Answer::Cleaned { deaths: 2 });
    assert_eq!(guard.cleaned(), 2);
    guard.moved = ago(CLEAN_PATIENCE);
    assert_eq!(guard.cleaned(), 3, "they clean up for themselves");
    answer(&mut guard, &theirs, &Answer::Cleaned { deaths: 3 });
    answer(&mut guard, &theirs, &Answer::Cleaned { deaths: 2 });
    assert_eq!((guard.cleaned(), guard.patience()), (3, None));
}

#[test]
fn it_gets_the_reports() {
    let (mut guard, theirs) = guard(0);
    let process = Identity {
        pid: 7,
        starttime: 8,
    };
    let component = RegisteredProcess {
        name: "a".to_owned(),
        process,
        stop_ms: 9,
    };
    guard.started(&component);
    guard.ended(7);
    guard.clean_up(1);
    let lines = BufReader::new(theirs).lines().take(3);
    let reports: Vec<Report> = lines
        .map(|line| serde_json::from_str(&line.expect("a line")).expect("a report"))
        .collect();
    assert_eq!(
        reports,
        [
            Report::Started(component),
            Report::Ended { pid: 7 },
            Report::CleanUp { deaths: 1 }
        ]
    );
}

#[test]
fn a_guard_releases_its_services_or_is_killed() {
    let (mut released, theirs) = guarding(1, 1);
    let peer = std::thread::spawn(move || {
        let mut lines = BufReader::new(&theirs).lines();
        let line = lines.next().expect("a line").expect("a line");
        assert_eq!(line, r#""release""#);
        let answer = lines::encode(&Answer::Released);
        (&theirs).write_all(&answer).expect("it reads");
        theirs
    });
    released.release();
    let theirs = peer.join().expect("the answer");
    assert_eq!(released.failure, None);
    // It is released already.
    released.release();
    assert_eq!(released.failure, None);
    drop(theirs);

    let why = Some("it does not release its services".to_owned());
    let begun = Instant::now();
    let (mut starts, _theirs) = guard(1);
    starts.release();
    assert_eq!(starts.failure, why);
    let (mut ends, _theirs) = guarding(1, 1);
    drop(ends.child.stdin.take());
    ends.release();
    assert_eq!(ends.failure, why);
    assert!(begun.elapsed() < STEP_LIMIT);
}

#[test]
fn a_wait_for_it_ends_with_an_answer_its_end_or_the_limit() {
    let (mut guard, mut theirs) = guard(1);
    assert!(guard.await_turn(Duration::from_millis(1)));
    let text = lines::encode(&Answer::Guarding);
    theirs.write_all(&text).expect("it reads");
    assert!(guard.await_turn(Duration::from_mins(1)));
    assert_eq!(guard.held(), Some(0));
    drop(guard.child.stdin.take());
    assert!(!guard.await_turn(Duration::from_mins(1)));
}

#[test]
fn a_guard_that_is_dismissed_gets_a_farewell() {
    let (link, theirs) = UnixStream::pair().expect("a pair");
    link.set_nonblocking(true).expect("a mode");
    let mut child = Command::new("head")
        .arg("-n1")
        .stdin(Stdio::from(OwnedFd::from(theirs)))
        .stdout(Stdio::piped())
        .spawn()
        .expect("it starts");
    let mut output = child.stdout.take().expect("a pipe");
    let guard = Guard::of(child, link, 0, MAX_REPORTS).expect("a guard");
    let process = Identity::of(guard.pid()).expect("it runs");
    assert!(guard.age() > Duration::ZERO);
    guard.dismiss();
    let mut text = String::new();
    output.read_to_string(&mut text).expect("its output");
    assert_eq!(text, "\"farewell\"\n");
    assert!(!process.is_alive());
}
