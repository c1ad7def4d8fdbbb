//! The processors that a thread may run on, and its real-time priority. Threads and processes that it
//! starts inherit both.
//!
#![doc = include_str!("example.md")]

use rustix::io::Errno;
use rustix::process::{Resource, getrlimit};
use rustix::thread::{CpuSet, sched_getaffinity, sched_setaffinity};
use std::collections::BTreeSet;
use std::io;

/// The list of the processors that are online.
const ONLINE: &str = "/sys/devices/system/cpu/online";

/// Lets the calling thread run on these processors (empty: any) with this `SCHED_FIFO` priority.
///
/// # Errors
/// The machine does not have the processors, or the system forbids them or the priority. The text
/// says what to do.
pub fn set(cpu: &[u16], priority: Option<u8>) -> Result<(), String> {
    set_affinity(cpu)?;
    priority.map_or(Ok(()), set_priority)
}

/// Checks that the system permits a real-time priority.
///
/// # Errors
/// The system forbids it. The text says what to do.
pub fn permits(priority: u8) -> Result<(), String> {
    on_a_thread(|| set_priority(priority))
}

/// Runs work that changes the scheduling of its thread.
///
/// # Errors
/// The error of the work, or of the system if it makes no thread.
pub fn on_a_thread<T: Send>(work: impl FnOnce() -> Result<T, String> + Send) -> Result<T, String> {
    std::thread::scope(|scope| {
        let thread = std::thread::Builder::new().spawn_scoped(scope, work);
        let thread = thread.map_err(|e| format!("cannot make a thread: {e}"))?;
        let ended = thread.join();
        ended.unwrap_or_else(|_| Err("the thread that starts it panicked".to_owned()))
    })
}

fn set_affinity(cpu: &[u16]) -> Result<(), String> {
    if cpu.is_empty() {
        return Ok(());
    }
    missing(cpu)?;
    let mut wanted = CpuSet::new();
    cpu.iter().for_each(|at| wanted.set(usize::from(*at)));
    let allowed = sched_setaffinity(None, &wanted).and_then(|()| sched_getaffinity(None));
    // The system silently removes processors that the cgroup does not permit.
    match allowed {
        Ok(allowed) if allowed == wanted => Ok(()),
        Ok(_) | Err(Errno::INVAL) => Err(format!(
            "its cgroup may not use all of the processors {}; change its `cpuset.cpus` (`AllowedCPUs` of systemd, `--cpuset-cpus` of a container), or `cpu`",
            processors(cpu)
        )),
        Err(error) => Err(format!(
            "cannot let it run on the processors {}: {error}",
            processors(cpu)
        )),
    }
}

/// Checks that the machine has these processors.
///
/// # Errors
/// The text names missing and existing ones.
pub fn missing(cpu: &[u16]) -> Result<(), String> {
    // Without a list, the system refuses missing processors itself.
    let Ok(online) = online() else { return Ok(()) };
    let missing: Vec<u16> = cpu
        .iter()
        .copied()
        .filter(|at| !online.contains(at))
        .collect();
    if missing.is_empty() {
        return Ok(());
    }
    let online: Vec<u16> = online.into_iter().collect();
    let plural = if missing.len() == 1 { "" } else { "s" };
    Err(format!(
        "this machine has no processor{plural} {}; there are {}",
        processors(&missing),
        processors(&online)
    ))
}

fn set_priority(priority: u8) -> Result<(), String> {
    fifo(priority).map_err(
        |error| match error.raw_os_error().map(Errno::from_raw_os_error) {
            Some(Errno::PERM) => {
                let limit = getrlimit(Resource::Rtprio).current.unwrap_or(u64::MAX);
                forbidden(priority, limit)
            }
            _ => format!("cannot give it the real-time priority {priority}: {error}"),
        },
    )
}

/// Advice about a priority that is not permitted.
fn forbidden(priority: u8, limit: u64) -> String {
    let limits = if limit >= u64::from(priority) {
        // Not the limit is the reason, but a cgroup without real-time bandwidth, or a seccomp
        // filter.
        "its cgroup or its container has no real time (`cpu.rt_runtime_us`, seccomp)".to_owned()
    } else {
        format!(
            "allow it with the line `USER - rtprio {priority}` in /etc/security/limits.conf and a new login (the limit is {limit} now), \
             with `LimitRTPRIO={priority}` of a unit, with `--ulimit rtprio={priority}` of a container, or with the capability CAP_SYS_NICE"
        )
    };
    format!(
        "the system forbids the real-time priority {priority}; {limits}, or leave `priority` out"
    )
}

/// Gives the calling thread a priority of `SCHED_FIFO`.
#[expect(unsafe_code, reason = "no safe crate has this call")]
fn fifo(priority: u8) -> io::Result<()> {
    // SAFETY: all bytes zero are a value of this structure of numbers, and the call only reads it;
    // 0 is the thread itself.
    let done = unsafe {
        let mut parameters: libc::sched_param = std::mem::zeroed();
        parameters.sched_priority = libc::c_int::from(priority);
        libc::sched_setscheduler(0, libc::SCHED_FIFO, &raw const parameters)
    };
    if done == 0 {
        Ok(())
    } else {
        Err(io::Error::last_os_error())
    }
}

/// Processors as people write them: `0-3, 8`.
pub fn processors(cpu: &[u16]) -> String {
    let mut sorted = cpu.to_vec();
    sorted.sort_unstable();
    sorted.dedup();
    let runs = sorted.chunk_by(|a, b| a + 1 == *b);
    let texts = runs.map(|run| match run {
        [from, .., to] if run.len() > 2 => format!("{from}-{to}"),
        _ => run
            .iter()
            .map(u16::to_string)
            .collect::<Vec<_>>()
            .join(", "),
    });
    texts.collect::<Vec<_>>().join(", ")
}

fn online() -> io::Result<BTreeSet<u16>> {
    let text = std::fs::read_to_string(ONLINE)?;
    read_list(text.trim()).ok_or_else(|| io::ErrorKind::InvalidData.into())
}

/// Parses a list such as `0-3,8`. `None` if the text is not such a list.
pub fn read_list(text: &str) -> Option<BTreeSet<u16>> {
    let mut all = BTreeSet::new();
    for part in text.split(',') {
        let (from, to) = part.split_once('-').unwrap_or((part, part));
        all.extend(from.parse::<u16>().ok()?..=to.parse().ok()?);
    }
    Some(all)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lists_of_processors_are_parsed_and_printed() {
        let all = read_list("0-3,8").expect("a list");
        assert_eq!(all.iter().copied().collect::<Vec<_>>(), [0, 1, 2, 3, 8]);
        assert_eq!(read_list("0-"), None);
    }

    #[test]
    fn processors_are_printed_in_ranges() {
        assert_eq!(processors(&[8, 2, 1, 0, 3]), "0-3, 8");
        assert_eq!(processors(&[3, 2]), "2, 3");
    }

    #[test]
    fn a_missing_processor_is_reported_with_the_existing_ones() {
        let first = *online().expect("Linux lists them").first().expect("one");
        assert_eq!(missing(&[first]), Ok(()));
        let error = missing(&[first, 1023]).expect_err("no machine has so many");
        assert!(
            error.starts_with("this machine has no processor 1023; there are"),
            "{error}"
        );
    }

    #[test]
    fn a_missing_permission_is_reported_with_its_remedy() {
        let error = forbidden(10, 0);
        for word in [
            "priority 10",
            "rtprio 10",
            "CAP_SYS_NICE",
            "limits.conf",
            "is 0 now",
        ] {
            assert!(error.contains(word), "{error}");
        }
        assert!(forbidden(10, 99).contains("cpu.rt_runtime_us"));
    }
}
