//! The ring of a recorder, in memory: a crash, an event, a signal and a request write it.

use crate::network::recorded::{Tool, down, info, text, up};
use rc_record::bag::Info;
use rc_test_site::recordings::count;
use rc_test_site::site::{PATROL, Site};
use rustix::process::{Pid, Signal, kill_process};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// The whole recordings of a ring in a folder, whose names begin with `name`.
fn rings(folder: &Path, name: &str) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    let files = entries.map(|entry| entry.path());
    let mut rings: Vec<PathBuf> = files
        .filter(|path| {
            let file = path.file_name().unwrap_or_default().to_string_lossy();
            file.starts_with(name) && file.ends_with(".mcap")
        })
        .filter(|path| Info::read(path).is_ok_and(|info| info.faults.is_none()))
        .collect();
    rings.sort();
    rings
}

/// How the recordings of the ring on board begin.
const ON_BOARD: &str = "rcdeploy-ring-";

/// Why a ring was written.
fn reason(file: &Path) -> String {
    info(file).metadata["ring"]["reason"].clone()
}

#[test]
fn a_ring_on_board_is_written_when_a_component_fails_and_on_request() {
    let site = Site::new("ring");
    site.write_ddsl(
        &PATROL
            .replace("avoider.cdsl\";", "avoider.cdsl\"; restart on_failure;")
            .replace(
                "middleware iceoryx2;",
                "middleware iceoryx2;\n    record { ring 1min; };",
            ),
    );
    // The recorder of a supervisor waits for components, until the supervisor ends.
    let mut command = Command::new(env!("CARGO_BIN_EXE_rcdeploy"));
    command.args(["record", &site.network, "--supervised", "--ring", "1s"]);
    site.place(&mut command);
    command.stdin(Stdio::piped());
    let mut early = command.spawn().expect("rcdeploy");
    drop(early.stdin.take());
    assert_eq!(early.wait().expect("a child").code(), Some(0));

    up(&site);
    let folder = site.path("state/robocomp").join(&site.network);
    let ask = || site.rcdeploy(&["record", &site.network, "--now"], false);
    // The recorder begins when the network is up.
    Site::until("poses in the ring", || {
        ask();
        let last = rings(&folder, ON_BOARD).pop();
        last.is_some_and(|last| count(&info(&last), "/newFullPose") > 3)
    });
    let asked = rings(&folder, ON_BOARD);
    assert!(asked.iter().all(|file| reason(file) == "on request"));

    let pid = site.ask("avoider", "status")["pid"].as_i64();
    let pid = Pid::from_raw(pid.expect("a pid") as i32).expect("a pid");
    kill_process(pid, Signal::KILL).expect("to kill");
    let crash = || {
        let mut all = rings(&folder, ON_BOARD).into_iter();
        all.find(|file| !asked.contains(file) && reason(file).contains("avoider"))
    };
    Site::until("the ring of the crash", || crash().is_some());
    let crash = info(&crash().expect("it is there"));
    assert!(count(&crash, "/newFullPose") > 3, "{crash:?}");
    assert!(count(&crash, "/events") > 0, "{crash:?}");
    down(&site);
    assert_eq!(site.count_in_log("rcdeploy", "recorder-ended"), 0);
}

#[test]
fn a_ring_is_written_at_a_signal_and_at_an_event_that_was_named() {
    let site = Site::new("asked");
    up(&site);
    let folder = site.path("rings");
    std::fs::create_dir(&folder).expect("a folder");
    let file = text(&folder.join("own.mcap"));
    let args = ["--ring", "1min", "--on", "stopped", "-o", &file];
    let recorder = Tool::record(&site, &args);
    // Before it has begun, the signal would end it.
    let log = site.path("tool.log");
    let pid = Pid::from_child(&recorder.0).as_raw_nonzero();
    Site::until("it catches the signal", || catches(pid.get(), Signal::USR1));
    Site::until("poses in a ring", || {
        recorder.signal(Signal::USR1);
        let last = rings(&folder, "own-").pop();
        last.is_some_and(|last| count(&info(&last), "/newFullPose") > 3)
    });
    let asked = rings(&folder, "own-");
    assert!(asked.iter().all(|file| reason(file) == "on request"));

    // The failure of a component has another code, and writes nothing.
    let ask = |verb: &str, name: &str| {
        let ran = site.rcdeploy(&[verb, &site.network, name], false);
        assert_eq!(ran.code, 0, "{ran:?}");
    };
    let pid = site.ask("avoider", "status")["pid"].as_i64();
    let pid = Pid::from_raw(pid.expect("a pid") as i32).expect("a pid");
    kill_process(pid, Signal::KILL).expect("to kill");
    site.await_component("avoider", |c| c["state"] == "failed");
    ask("stop", "monitor");
    let named = || {
        let all = rings(&folder, "own-").into_iter();
        let others = all.filter(|file| reason(file) != "on request");
        others.collect::<Vec<_>>()
    };
    Site::until("the ring of the event", || !named().is_empty());
    for file in named() {
        assert!(reason(&file).contains("monitor"), "{}", reason(&file));
        assert!(count(&info(&file), "/newFullPose") > 3);
    }
    let said = std::fs::read_to_string(log).unwrap_or_default();
    assert_eq!(recorder.end(Signal::INT), Some(0), "{said}");
    down(&site);
}

/// Whether a process catches a signal, by the mask that the kernel shows.
fn catches(pid: i32, signal: Signal) -> bool {
    let status = std::fs::read_to_string(format!("/proc/{pid}/status")).unwrap_or_default();
    let mask = status.lines().find_map(|line| line.strip_prefix("SigCgt:"));
    let mask = mask.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok());
    mask.is_some_and(|mask| mask >> (signal.as_raw() - 1) & 1 == 1)
}
