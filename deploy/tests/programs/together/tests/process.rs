//! Several components in one process, over real shared memory, with this test as their supervisor.

use rc_management::component::{Parameters, Request, State, Status};
use rc_management::lines::{Line, Lines, Overlong};
use rc_management::link::{ComponentMessage, Heartbeat};
use rc_management::{Client, rpc};
use rc_test_support::python::skipped;
use rustix::net::{SendAncillaryBuffer, SendAncillaryMessage, SendFlags, sendmsg};
use rustix::process::{Pid, Signal, kill_process};
use rustix::thread::{CpuSet, sched_getaffinity};
use std::fs::File;
use std::io::{IoSlice, Read};
use std::mem::MaybeUninit;
use std::os::fd::{AsFd, OwnedFd};
use std::os::unix::net::UnixStream;
use std::path::PathBuf;
use std::process::{Child, Command, ExitStatus, Stdio};
use std::sync::atomic::{AtomicU32, Ordering};
use std::time::{Duration, Instant};
use tempfile::TempDir;

/// No test waits longer for anything.
const LIMIT: Duration = Duration::from_secs(30);
const PROGRAM: &str = env!("CARGO_BIN_EXE_rc-test-together");

/// A component of the process: what its command line has, and this end of its link.
struct Member {
    name: String,
    link: UnixStream,
    lines: Lines,
}

/// The process, and this test as its supervisor.
struct Supervised {
    child: Child,
    /// The link of the process.
    link: Option<UnixStream>,
    members: Vec<Member>,
    network: String,
    folder: TempDir,
}

/// A network of this test alone.
fn network() -> String {
    static COUNT: AtomicU32 = AtomicU32::new(0);
    let count = COUNT.fetch_add(1, Ordering::Relaxed);
    format!("together-{}-{count}", std::process::id())
}

/// The words of one component: `COMPONENT NAME OPTIONS ARGUMENTS`.
fn member(network: &str, words: &str) -> Vec<String> {
    let mut words = words.split('|').map(|word| word.trim().to_owned());
    let (component, name) = (words.next(), words.next());
    let (mut options, mut rest) = (Vec::new(), Vec::new());
    for word in words {
        let list = match word.split(' ').next() {
            Some("--after" | "--cpu" | "--priority" | "--stop") => &mut options,
            _ => &mut rest,
        };
        let (option, value) = word.split_once(' ').expect("an option and its value");
        list.extend([option.to_owned(), value.to_owned()]);
    }
    let (component, name) = (component.expect("a component"), name.expect("a name"));
    if component == "neighbour" {
        // Each of them serves at its own address.
        rest.extend([
            "--bind".to_owned(),
            format!("BatteryStatus={name}/BatteryStatus"),
        ]);
    }
    let mut all = vec!["--member".to_owned(), component];
    all.append(&mut options);
    all.extend(["--network", network, "--name", &name].map(str::to_owned));
    all.append(&mut rest);
    all
}

impl Supervised {
    /// Starts components: `COMPONENT | NAME | --OPTION VALUE | …` for each.
    fn start(members: &[&str]) -> Self {
        let folder = tempfile::tempdir().expect("a folder");
        let network = network();
        let (link, theirs) = UnixStream::pair().expect("a pair");
        let (mut args, mut all, mut handed) = (Vec::new(), Vec::new(), Vec::<OwnedFd>::new());
        for words in members {
            let words = member(&network, words);
            let at = words.iter().position(|word| word == "--name");
            let name = words[at.expect("a name") + 1].clone();
            let (ours, theirs) = UnixStream::pair().expect("a pair");
            ours.set_read_timeout(Some(LIMIT)).expect("a limit");
            let path = folder.path().join(format!("{name}.log"));
            let log = File::options().create(true).append(true).open(path);
            handed.extend([theirs.into(), log.expect("a log").into()]);
            args.extend(words);
            all.push(Member {
                name,
                link: ours,
                lines: Lines::new(Overlong::Skip),
            });
        }
        let borrowed: Vec<_> = handed.iter().map(AsFd::as_fd).collect();
        let message = SendAncillaryMessage::ScmRights(&borrowed);
        let mut space = vec![MaybeUninit::uninit(); message.size()];
        let mut control = SendAncillaryBuffer::new(&mut space);
        assert!(control.push(message));
        let byte = [IoSlice::new(b"\n")];
        sendmsg(&link, &byte, &mut control, SendFlags::empty()).expect("room");
        let errors = File::create(folder.path().join("process.log")).expect("a log");
        let child = Command::new(PROGRAM)
            .args(args)
            .env("RC_SUPERVISED", "1")
            .env("XDG_RUNTIME_DIR", folder.path())
            .env_remove("RUST_LOG")
            .stdin(Stdio::from(OwnedFd::from(theirs)))
            .stderr(errors)
            .spawn()
            .expect("it starts");
        Self {
            child,
            link: Some(link),
            members: all,
            network,
            folder,
        }
    }

    /// Waits until all components are ready.
    fn ready(members: &[&str]) -> Self {
        let mut process = Self::start(members);
        for at in 0..process.members.len() {
            process.until(at, |message| *message == ComponentMessage::Ready);
        }
        process
    }

    /// The messages of a component up to the first one that `is` wanted.
    fn until(&mut self, at: usize, is: impl Fn(&ComponentMessage) -> bool) {
        let member = &mut self.members[at];
        let mut messages = Vec::new();
        let start = Instant::now();
        while !messages.iter().any(&is) {
            assert!(start.elapsed() < LIMIT, "{}: {messages:?}", member.name);
            let (lines, ended) = member.lines.read(&member.link);
            assert!(
                !ended,
                "the link of {} has ended: {messages:?}",
                member.name
            );
            let lines = lines.iter().filter_map(Line::bytes);
            messages.extend(lines.filter_map(|line| ComponentMessage::decode(line).ok()));
        }
    }

    /// Waits for a heartbeat that `is` wanted.
    fn heartbeat(&mut self, at: usize, is: impl Fn(&Heartbeat) -> bool) {
        self.until(at, |message| match message {
            ComponentMessage::Heartbeat(heartbeat) => is(heartbeat),
            _ => false,
        });
    }

    fn connect(&self, name: &str) -> Client {
        let folder = self.folder.path().join("robocomp").join(&self.network);
        let socket = folder.join(format!("{name}.sock"));
        Client::connect(&socket, LIMIT).expect("it listens")
    }

    fn status(&self, name: &str) -> Status {
        let answer = self.connect(name).call(&Request::Status, LIMIT);
        answer.expect("a status")
    }

    fn set(&self, name: &str, parameter: &str, value: impl Into<serde_json::Value>) {
        let changes = [(parameter.to_owned(), value.into())];
        let changes = changes.into_iter().collect();
        let request = Request::ParametersSet { changes };
        let _: serde_json::Value = self.connect(name).call(&request, LIMIT).expect("a change");
    }

    /// The value of a parameter.
    fn parameter(&self, name: &str, parameter: &str) -> serde_json::Value {
        let paths = Some(vec![parameter.to_owned()]);
        let request = Request::Parameters { paths };
        let all: Parameters = self.connect(name).call(&request, LIMIT).expect("a list");
        rpc::result(&all.parameters[0]).expect("JSON")["value"].clone()
    }

    fn log_path(&self, name: &str) -> PathBuf {
        self.folder.path().join(format!("{name}.log"))
    }

    /// The log of a component, or the output of the process (`process`).
    fn log(&self, name: &str) -> String {
        std::fs::read_to_string(self.log_path(name)).expect("a log")
    }

    /// Waits until a log has a line with this text.
    fn logged(&self, name: &str, text: &str) {
        let start = Instant::now();
        while !self.log(name).contains(text) {
            assert!(start.elapsed() < LIMIT, "{text}: {}", self.log(name));
            std::thread::sleep(Duration::from_millis(5));
        }
    }

    fn signal(&self, signal: Signal) {
        kill_process(Pid::from_child(&self.child), signal).expect("it runs");
    }

    fn end(&mut self) -> ExitStatus {
        let start = Instant::now();
        loop {
            if let Some(status) = self.child.try_wait().expect("a child") {
                return status;
            }
            assert!(start.elapsed() < LIMIT, "it does not end");
            std::thread::sleep(Duration::from_millis(5));
        }
    }

    /// The code of the end, and the last words of the process.
    fn failed(&mut self) -> (Option<i32>, String) {
        let code = self.end().code();
        let printed = self.log("process");
        (code, printed.lines().last().unwrap_or_default().to_owned())
    }
}

impl Drop for Supervised {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

#[test]
fn shipped_components_of_one_process_call_each_other_over_shared_memory() {
    let mut process = Supervised::ready(&["simulator | world", "avoider | left | --after world"]);
    let start = Instant::now();
    // The world has served scans, which the avoider asks for in its period.
    while process.status("world").slots[0].handlers.count < 5 {
        assert!(start.elapsed() < LIMIT, "{:?}", process.status("left"));
        std::thread::sleep(Duration::from_millis(5));
    }
    let (world, left) = (process.status("world"), process.status("left"));
    assert_eq!(
        (world.component.as_str(), left.component.as_str()),
        ("simulator", "avoider")
    );
    assert_eq!(
        (world.pid, left.pid),
        (process.child.id(), process.child.id())
    );
    process.heartbeat(0, |_| true);
    process.heartbeat(1, |_| true);
    process.signal(Signal::TERM);
    assert!(process.end().success(), "{}", process.log("process"));
    assert_eq!(process.log("process"), "");
}

#[test]
fn one_component_runs_twice_with_parameters_of_its_own() {
    let mut process = Supervised::ready(&[
        "neighbour | left | --set level=10.0",
        "neighbour | right | --set level=20.0 | --bind other=left/BatteryStatus | --set does=call",
    ]);
    process.logged("right", "the other has 10");
    // One of them gets another value, the other one keeps its own.
    process.set("left", "level", 30.0);
    process.logged("right", "the other has 30");
    assert_eq!(process.parameter("left", "level"), 30.0);
    assert_eq!(process.parameter("right", "level"), 20.0);
    // Each log has the lines of its component alone.
    process.logged("left", "left begins");
    assert!(
        !process.log("left").contains("right"),
        "{}",
        process.log("left")
    );
    assert!(!process.log("left").contains("the other"));
    assert!(!process.log("right").contains("left begins"));
    // A component that stops ends alone.
    let _: serde_json::Value = process
        .connect("right")
        .call(&Request::Stop, LIMIT)
        .expect("a stop");
    process.logged("right", "right ends");
    process.heartbeat(0, |_| true);
    assert_eq!(process.status("left").state, State::Running);
    // So does one whose link is closed; it is the last one here.
    drop(process.members.remove(0));
    assert!(process.end().success());
    assert!(process.log("left").contains("left ends"));
}

#[test]
fn a_panic_ends_the_process_and_names_its_component() {
    for (does, words) in [
        (
            "panic",
            "right: error: the component panicked: the cable burns (",
        ),
        ("fail", "right: error: the cable is cut"),
    ] {
        let mut process = Supervised::ready(&["neighbour | left", "neighbour | right"]);
        process.set("right", "does", does);
        let (code, last) = process.failed();
        assert_eq!(code, Some(3));
        assert!(last.starts_with(words), "{last}");
        assert!(process.log("right").lines().any(|line| line == last));
        // The other one has ended in order.
        let left = process.log("left");
        assert!(
            left.contains("left ends") && !left.contains("error"),
            "{left}"
        );
    }
}

#[test]
fn a_component_that_cannot_start_ends_the_process_with_its_reason() {
    for (trouble, code, words) in [
        (
            "--set does=fail at start",
            3,
            "right: error: initialize(): the cable is loose",
        ),
        (
            "--set does=panic at start",
            3,
            "right: error: the component panicked: the cable burns (",
        ),
        (
            "--set level=101",
            1,
            "right: error: its configuration is wrong",
        ),
    ] {
        let mut process = Supervised::start(&[
            "neighbour | left",
            &format!("neighbour | right | --after left | {trouble}"),
        ]);
        let (ended, last) = process.failed();
        assert_eq!(ended, Some(code), "{}", process.log("process"));
        assert!(last.starts_with(words), "{last}");
        assert!(process.log("left").contains("left ends"));
    }
}

#[test]
fn a_component_that_hangs_is_named_while_the_others_run_on() {
    let mut process = Supervised::ready(&["neighbour | left", "neighbour | right"]);
    process.set("right", "does", "hang");
    process.heartbeat(1, |heartbeat| heartbeat.age_ms > 1000);
    process.heartbeat(0, |heartbeat| heartbeat.age_ms < 1000);
    assert_eq!(process.status("right").state, State::Running);
    // The first signal ends the other one, a later one the process.
    process.signal(Signal::TERM);
    process.logged("left", "left ends");
    std::thread::sleep(Duration::from_millis(400));
    process.signal(Signal::TERM);
    let (code, last) = process.failed();
    assert_eq!(code, Some(3));
    assert_eq!(last, "right: ended at once by a second signal");
}

#[test]
fn a_component_that_does_not_end_holds_the_end_up_for_its_limit_only() {
    let mut process = Supervised::ready(&[
        "neighbour | left | --stop 0.2 | --set does=hang at the end",
        "neighbour | right",
    ]);
    process.set("right", "does", "panic");
    let (code, last) = process.failed();
    assert_eq!(code, Some(3));
    assert_eq!(last, "left: error: it has not ended within its limit");
    assert!(
        process
            .log("process")
            .contains("right: error: the component panicked")
    );
}

#[test]
fn two_components_that_call_each_other_time_out() {
    let process = Supervised::ready(&[
        "neighbour | left | --bind other=right/BatteryStatus | --set does=call",
        "neighbour | right | --bind other=left/BatteryStatus | --set does=call back",
    ]);
    // The left one waits for the right one, whose handler waits for the left one.
    process.logged("left", "no answer to its own call");
    assert!(
        process.log("left").contains("within 300ms"),
        "{}",
        process.log("left")
    );
    // Nothing is left of that: as soon as the right one does not call back, it answers.
    process.set("right", "does", "");
    process.logged("left", "the other has 50");
    // Both call each other at once: each of them answers, or times out, and turns on.
    process.set("right", "does", "call");
    let computed = |name: &str| process.status(name).compute.count;
    let before = [computed("left"), computed("right")];
    let start = Instant::now();
    while computed("left") < before[0] + 3 || computed("right") < before[1] + 3 {
        assert!(start.elapsed() < LIMIT);
        std::thread::sleep(Duration::from_millis(5));
    }
}

#[test]
fn the_end_of_the_supervisor_ends_all_components() {
    let mut process = Supervised::ready(&["neighbour | left", "neighbour | right"]);
    process.link = None;
    assert!(process.end().success());
    for name in ["left", "right"] {
        assert!(process.log(name).contains(&format!("{name} ends")));
    }
}

#[test]
fn components_start_after_those_that_they_need() {
    let process = Supervised::ready(&[
        "neighbour | c | --after b",
        "neighbour | b | --after a",
        "neighbour | a | --after d",
        // These two need each other, and start together.
        "neighbour | d | --after e",
        "neighbour | e | --after d",
    ]);
    let began = |name: &str| {
        process.logged(name, "begins");
        let log = process.log(name);
        log.split(' ').next().expect("a time").to_owned()
    };
    let times = ["d", "a", "b", "c"].map(began);
    assert!(times.is_sorted(), "{times:?}");
    began("e");
}

/// The policy (1 is `SCHED_FIFO`) and the real-time priority of the thread of a component: fields 41
/// and 40 of proc(5).
fn scheduling(process: &Supervised, name: &str) -> (u32, u32) {
    let tasks = format!("/proc/{}/task", process.child.id());
    let tasks = std::fs::read_dir(tasks).expect("threads").flatten();
    let mut stats = tasks.filter_map(|task| std::fs::read_to_string(task.path().join("stat")).ok());
    let stat = stats.find(|stat| stat.contains(&format!("({name})")));
    let stat = stat.expect("its thread");
    let (_, rest) = stat.rsplit_once(')').expect("a name");
    let fields: Vec<&str> = rest.split_whitespace().collect();
    let number = |field: usize| fields[field - 3].parse().expect("a number");
    (number(41), number(40))
}

#[test]
fn the_thread_of_a_component_has_its_own_priority() {
    let test = "the_thread_of_a_component_has_its_own_priority";
    let tried = Command::new("chrt").args(["-f", "7", "true"]).output();
    if !tried.is_ok_and(|tried| tried.status.success()) {
        return skipped(test, "this user may set no real-time priorities");
    }
    let process = Supervised::ready(&[
        "neighbour | first | --priority 7",
        "neighbour | second | --priority 5",
        "neighbour | third",
    ]);
    assert_eq!(scheduling(&process, "first"), (1, 7));
    assert_eq!(scheduling(&process, "second"), (1, 5));
    assert_eq!(scheduling(&process, "third"), (0, 0));
}

#[test]
fn the_thread_of_a_component_has_its_own_processors() {
    let allowed = sched_getaffinity(None).expect("a list");
    let Some(last) = (0..CpuSet::MAX_CPU).rev().find(|at| allowed.is_set(*at)) else {
        panic!("no processor")
    };
    let process = Supervised::ready(&[
        &format!("neighbour | left | --cpu {last}"),
        "neighbour | right",
    ]);
    let tasks = format!("/proc/{}/task", process.child.id());
    let mut seen = Vec::new();
    for task in std::fs::read_dir(tasks).expect("threads").flatten() {
        let comm = std::fs::read_to_string(task.path().join("comm")).unwrap_or_default();
        let tid = task
            .file_name()
            .to_string_lossy()
            .parse()
            .expect("a number");
        // A thread may have ended meanwhile.
        let Ok(set) = sched_getaffinity(Pid::from_raw(tid)) else {
            continue;
        };
        match comm.trim() {
            "left" => {
                assert!(set.count() == 1 && set.is_set(last));
                seen.push("left");
            }
            "right" => {
                assert_eq!(set, allowed);
                seen.push("right");
            }
            _ => {}
        }
    }
    seen.sort_unstable();
    assert_eq!(seen, ["left", "right"]);
    let mut wrong = Supervised::start(&["neighbour | left | --cpu 1023"]);
    let (code, last) = wrong.failed();
    assert_eq!(code, Some(3));
    assert!(
        last.starts_with("left: error: this machine has no processor 1023"),
        "{last}"
    );
}

/// Runs the program by hand, without a supervisor.
fn by_hand(args: &[&str]) -> (Option<i32>, String, String) {
    let folder = tempfile::tempdir().expect("a folder");
    let output = Command::new(PROGRAM)
        .args(args)
        .env("XDG_RUNTIME_DIR", folder.path())
        .env_remove("RUST_LOG")
        .output()
        .expect("it runs");
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    (
        output.status.code(),
        text(&output.stdout),
        text(&output.stderr),
    )
}

#[test]
fn by_hand_the_lines_of_each_component_have_its_name() {
    let network = network();
    let mut args = Vec::new();
    for name in ["left", "right"] {
        let words = format!("neighbour | {name} | --set does=stop");
        args.extend(member(&network, &words));
    }
    let args: Vec<&str> = args.iter().map(String::as_str).collect();
    let (code, _, errors) = by_hand(&args);
    assert_eq!(code, Some(0), "{errors}");
    for name in ["left", "right"] {
        let of_it =
            |line: &&str| line.starts_with(&format!("{name} | ")) && line.contains("begins");
        assert_eq!(errors.lines().filter(of_it).count(), 1, "{errors}");
    }
}

#[test]
fn a_wrong_command_line_says_what_is_allowed() {
    for (args, words) in [
        (&[][..], "name its components: --member COMPONENT"),
        (&["--name", "a"], "`--name` is not part of a component"),
        (&["--member", "neighbor"], "did you mean `neighbour`?"),
        (
            &["--member", "neighbour", "--after", "b"],
            "no component of this process has the --name `b`",
        ),
        (
            &["--member", "neighbour", "--priority", "100"],
            "a number from 1 to 99",
        ),
        (
            &["--member", "neighbour", "--cpu", "a"],
            "a list such as 0-3,8",
        ),
        (
            &["--member", "neighbour", "--stop", "-1"],
            "--stop takes seconds",
        ),
        (
            &["--member", "neighbour", "--bind", "x=a"],
            "neighbour: `x` is not a slot of neighbour",
        ),
        (
            &["--member", "neighbour", "--member", "neighbour"],
            "two components have the --name `neighbour`",
        ),
        (
            &["--member", "neighbour", "--help", "--member", "avoider"],
            "take one component",
        ),
    ] {
        let (code, _, errors) = by_hand(args);
        assert_eq!(code, Some(2), "{args:?}: {errors}");
        assert!(errors.contains(words), "{args:?}: {errors}");
    }
    // A supervisor that hands nothing over is not a supervisor of this process.
    let output = Command::new(PROGRAM)
        .args(["--member", "neighbour"])
        .env("RC_SUPERVISED", "1")
        .stdin(Stdio::null())
        .output();
    let output = output.expect("it runs");
    let errors = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(3), "{errors}");
    assert!(errors.contains("its supervisor"), "{errors}");
}

#[test]
fn one_component_has_the_options_of_its_own_program() {
    let (code, help, _) = by_hand(&["--member", "neighbour", "--help"]);
    assert_eq!(code, Some(0));
    assert!(help.contains("--bind"), "{help}");
    let (code, checked, _) = by_hand(&["--member", "neighbour", "--check"]);
    assert_eq!((code, checked.as_str()), (Some(0), "neighbour: ok\n"));
    let (_, help, _) = by_hand(&["--help"]);
    for word in ["--member", "avoider", "neighbour", "simulator"] {
        assert!(help.contains(word), "{help}");
    }
}

/// Other messages on the link of a process are ignored.
#[test]
fn words_on_the_link_of_the_process_do_no_harm() {
    let process = Supervised::ready(&["neighbour | left"]);
    let link = process.link.as_ref().expect("a link");
    std::io::Write::write_all(&mut { link }, &[b'x'; 5000]).expect("room");
    process.set("left", "level", 1.0);
    link.set_nonblocking(true).expect("a socket");
    let answered = Read::read(&mut { link }, &mut [0]);
    assert_eq!(
        answered.map_err(|error| error.kind()),
        Err(std::io::ErrorKind::WouldBlock)
    );
}

/// The code and the output of a probe of all these components.
fn probe(process: &Supervised, names: &[&str]) -> (Option<i32>, String) {
    let words = names.iter().flat_map(|name| {
        let mut words = member(&process.network, &format!("neighbour | {name}"));
        words.push("--probe".to_owned());
        words
    });
    let output = Command::new(PROGRAM)
        .args(words)
        .env("XDG_RUNTIME_DIR", process.folder.path())
        .output()
        .expect("it runs");
    let printed = String::from_utf8_lossy(&output.stdout).into_owned();
    (output.status.code(), printed)
}

#[test]
fn a_component_that_ends_early_leaves_its_process_ready() {
    let mut process = Supervised::start(&[
        "neighbour | brief | --set does=stop",
        "neighbour | calm",
        "neighbour | late | --after calm",
    ]);
    process.until(1, |message| *message == ComponentMessage::Ready);
    process.until(2, |message| *message == ComponentMessage::Ready);
    let start = Instant::now();
    while process.status("calm").done_beside != ["brief"] {
        assert!(start.elapsed() < LIMIT, "{:?}", process.status("calm"));
        std::thread::sleep(Duration::from_millis(5));
    }
    let (code, printed) = probe(&process, &["brief", "calm", "late"]);
    assert_eq!(code, Some(0), "{printed}");
    let lines = [
        "brief: has ended in order",
        "calm: running",
        "late: running",
    ];
    assert_eq!(printed.lines().collect::<Vec<_>>(), lines);
    // A component that never existed is not reported.
    let (code, printed) = probe(&process, &["calm", "other"]);
    assert_eq!(code, Some(3), "{printed}");
    process.set("late", "does", "stop");
    process.set("calm", "does", "stop");
    assert!(process.end().success());
    let (code, _) = probe(&process, &["brief", "calm", "late"]);
    assert_eq!(code, Some(3));
}
