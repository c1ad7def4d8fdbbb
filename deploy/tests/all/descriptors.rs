//! A supervisor without a free file descriptor.

use crate::bench::Bench;
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
