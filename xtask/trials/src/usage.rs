//! Resource usage of processes and networks: processor time, memory, descriptors.

use crate::programs::Failure;
use rc_middleware::RunDirectory;
use std::fs;
use std::os::unix::fs::MetadataExt as _;
use std::path::Path;
use std::time::Duration;

/// Processor time of all threads of a process, in nanoseconds.
pub(crate) fn processor_time(pid: u32) -> Result<Duration, Failure> {
    let mut total = Duration::ZERO;
    for task in fs::read_dir(format!("/proc/{pid}/task"))? {
        let text = fs::read_to_string(task?.path().join("schedstat"))?;
        let nanoseconds = text.split(' ').next().unwrap_or_default().parse()?;
        total += Duration::from_nanos(nanoseconds);
    }
    Ok(total)
}

/// Processor time of all processes that this one has started and waited for, in steps of a tick of
/// the clock.
pub(crate) fn processor_time_of_children() -> Result<Duration, Failure> {
    // The fields `cutime` and `cstime` of proc(5), after the name, which may have spaces.
    let stat = fs::read_to_string("/proc/self/stat")?;
    let fields = stat.rsplit(')').next().unwrap_or_default();
    let ticks = fields.split_ascii_whitespace().skip(13).take(2);
    let ticks: u64 = ticks.map(str::parse::<u64>).sum::<Result<_, _>>()?;
    let second = rustix::param::clock_ticks_per_second();
    Ok(Duration::from_nanos(ticks * 1_000_000_000 / second))
}

/// Context switches of all threads of a process since their start, voluntary and involuntary.
pub(crate) fn context_switches(pid: u32) -> Result<u64, Failure> {
    let mut total = 0;
    for task in fs::read_dir(format!("/proc/{pid}/task"))? {
        let status = fs::read_to_string(task?.path().join("status"))?;
        let counts = status
            .lines()
            .filter_map(|line| line.split_once("ctxt_switches:"));
        for (_, count) in counts {
            total += count.trim().parse::<u64>()?;
        }
    }
    Ok(total)
}

/// Proportional and whole resident memory, in MB.
pub(crate) fn memory(pid: u32) -> Result<(f64, f64), Failure> {
    let [pss, rss] = rollup(pid, ["Pss:", "Rss:"])?;
    Ok((pss, rss))
}

/// Proportional resident memory without the pages of files, in MB. The share of the pages of
/// executables and libraries would grow when other processes end.
pub(crate) fn made_memory(pid: u32) -> Result<f64, Failure> {
    let [anonymous, shared] = rollup(pid, ["Pss_Anon:", "Pss_Shmem:"])?;
    Ok(anonymous + shared)
}

/// Private memory, in MB.
pub(crate) fn own_memory(pid: u32) -> Result<f64, Failure> {
    let [anonymous] = rollup(pid, ["Pss_Anon:"])?;
    Ok(anonymous)
}

/// Lines of the kernel's summary of a process' memory, in MB.
fn rollup<const N: usize>(pid: u32, names: [&str; N]) -> Result<[f64; N], Failure> {
    let path = format!("/proc/{pid}/smaps_rollup");
    let text = fs::read_to_string(&path)?;
    let mut found = [0.0; N];
    for (name, found) in names.iter().zip(&mut found) {
        let line = text.lines().find_map(|line| line.strip_prefix(name));
        let kilobytes = line.and_then(|line| line.split_whitespace().next());
        let kilobytes: f64 = kilobytes.ok_or(format!("no {name} in {path}"))?.parse()?;
        *found = kilobytes * 1024.0 / 1e6;
    }
    Ok(found)
}

/// The number of open descriptors of a process.
pub(crate) fn descriptors(pid: u32) -> Result<usize, Failure> {
    Ok(fs::read_dir(format!("/proc/{pid}/fd"))?.count())
}

/// Shared memory of a network, in MB. Files that are removed meanwhile count as empty.
pub(crate) fn shared_memory(directory: &RunDirectory) -> f64 {
    let files = rc_iceoryx2::leftovers(directory);
    // The sum of nothing is -0.
    files.iter().map(|path| taken(path)).sum::<f64>().abs() / 1e6
}

/// Allocated bytes; files of shared memory are sparse.
fn taken(path: &Path) -> f64 {
    let Ok(found) = fs::symlink_metadata(path) else {
        return 0.0;
    };
    let inside = fs::read_dir(path).into_iter().flatten().flatten();
    let inside: f64 = inside.map(|entry| taken(&entry.path())).sum();
    found.blocks() as f64 * 512.0 + inside
}
