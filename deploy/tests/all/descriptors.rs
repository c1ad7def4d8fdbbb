//! A supervisor without a free file descriptor, or with few of them.

use crate::bench::{Bench, well};
use rustix::process::{Pid, Resource, Rlimit, Signal, getrlimit, prlimit};
use std::os::unix::net::UnixStream;
use std::time::Duration;

/// More clients than the supervisor has gaps between its descriptors.
const CLIENTS: usize = 8;
/// The maximum processor time of a waiting supervisor per second, in hundredths of a second.
const TICKS: u64 = 20;

/// Processor time of a process so far, in clock ticks: `utime` and `stime` of proc(5).
fn ticks(pid: i32) -> u64 {
    let stat = std::fs::read_to_string(format!("/proc/{pid}/stat")).expect("it runs");
    let (_, rest) = stat.rsplit_once(')').expect("a name");
    let fields = rest.split_ascii_whitespace().skip(11).take(2);
    fields
        .map(|field| field.parse::<u64>().expect("ticks"))
        .sum()
}

#[test]
fn a_supervisor_without_a_free_descriptor_waits_for_one() {
    let bench = Bench::new();
    let up = bench.start_well();
    let pid = up.identity().pid;
    let process = Pid::from_raw(pid);
    let open = std::fs::read_dir(format!("/proc/{pid}/fd")).expect("it runs");
    let open = open.filter_map(|entry| entry.ok()?.file_name().to_str()?.parse::<u64>().ok());
    let limit = Rlimit {
        current: open.max().map(|most| most + 1),
        maximum: getrlimit(Resource::Nofile).maximum,
    };
    let before = prlimit(process, Resource::Nofile, limit).expect("a lower limit");
    let socket = bench.run_directory().join("rcdeploy.sock");
    let clients: Vec<UnixStream> = (0..CLIENTS)
        .map(|_| UnixStream::connect(&socket).expect("a supervisor"))
        .collect();
    let start = ticks(pid);
    std::thread::sleep(Duration::from_secs(1));
    let taken = ticks(pid) - start;
    assert!(taken <= TICKS, "{taken} ticks in a second");
    // It accepts connections again as soon as a descriptor is free.
    prlimit(process, Resource::Nofile, before).expect("the limit before");
    assert_eq!(bench.status().network, bench.network);
    drop(clients);
    up.signal(Signal::TERM);
    assert_eq!(up.end().0, Some(0));
    bench.assert_nothing_left();
}

/// Starts the driver with a limit of open files: `-Sn 64` is one that it may raise.
fn limited(bench: &Bench, components: usize, limit: &str) -> crate::bench::Up {
    let names: Vec<String> = (0..components).map(|at| format!("c{at}")).collect();
    let plan = bench.write(names.iter().map(|name| well(name)).collect());
    let script = format!("ulimit {limit} && exec \"$@\"");
    bench.start_plan(&plan, &["sh", "-c", &script, "sh"], &[])
}

/// A component costs the supervisor three descriptors.
#[test]
fn a_low_soft_limit_is_raised_for_the_supervisor_and_kept_for_components() {
    let bench = Bench::new();
    let mut up = limited(&bench, 25, "-Sn 64");
    up.await_event("up", None);
    let component = bench.status().components[0].pid.expect("it runs");
    let limits = std::fs::read_to_string(format!("/proc/{component}/limits")).expect("it runs");
    let line = limits
        .lines()
        .find(|line| line.starts_with("Max open files"));
    let soft = line.and_then(|line| line.split_whitespace().nth(3));
    assert_eq!(soft, Some("64"), "{limits}");
    up.signal(Signal::TERM);
    assert_eq!(up.end().0, Some(0));
    bench.assert_nothing_left();
}

#[test]
fn a_limit_that_is_too_low_refuses_the_start_and_says_what_to_do() {
    let bench = Bench::new();
    let mut up = limited(&bench, 25, "-n 128");
    let message = up.await_event("refused", None);
    for part in [
        "25 components need 200 open files",
        "is 128",
        "`ulimit -n 200`",
    ] {
        assert!(message.contains(part), "{message}");
    }
    assert_eq!(up.end().0, Some(1));
    assert!(bench.journal().is_empty() && !bench.run_directory().exists());
}
