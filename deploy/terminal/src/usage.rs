//! Reads the resources of processes from /proc.

use super::model::Sample;
use std::time::Duration;

/// The resources of a process so far. `None` if it has ended.
pub(crate) fn sample(pid: i32) -> Option<Sample> {
    let stat = std::fs::read_to_string(format!("/proc/{pid}/stat")).ok()?;
    let statm = std::fs::read_to_string(format!("/proc/{pid}/statm")).ok()?;
    let page = rustix::param::page_size() as u64;
    parse(&stat, &statm, page, rustix::param::clock_ticks_per_second())
}

fn parse(stat: &str, statm: &str, page: u64, ticks: u64) -> Option<Sample> {
    // The program name is in parentheses and may contain any character.
    let (_, fields) = stat.rsplit_once(')')?;
    let mut fields = fields.split_whitespace().skip(11);
    let mut next = || fields.next()?.parse::<u64>().ok();
    let busy = next()? + next()?;
    let resident: u64 = statm.split_whitespace().nth(1)?.parse().ok()?;
    Some(Sample {
        busy: Duration::from_secs_f64(busy as f64 / ticks.max(1) as f64),
        memory: resident * page,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn any_process_name_is_parsed() {
        let stat = "42 (a ) b) S 1 42 42 0 -1 4194560 100 0 0 0 150 50 0 0 20 0 1 0 1 2 3";
        let sample = parse(stat, "1000 300 20 1 0 100 0", 4096, 100).expect("a sample");
        assert_eq!(sample.busy, Duration::from_secs(2));
        assert_eq!(sample.memory, 300 * 4096);
    }

    #[test]
    fn this_process_has_memory_and_an_unknown_one_has_none() {
        let pid = std::process::id().cast_signed();
        assert!(sample(pid).expect("a sample").memory > 100_000);
        assert_eq!(sample(i32::MAX), None);
    }
}
