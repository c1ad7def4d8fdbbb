//! The check of another machine of a network.

use super::{Finding, Grade};
use crate::process::identity::Mark;
use crate::remote::complaint::Complaint;
use crate::remote::{is_served, ssh};
use rc_ddsl::model::Processor;
use rc_deploy_network::plan::{Elsewhere, Host};
use rc_diagnostics::foreign;
use std::io::Read;
use std::time::{Duration, Instant};

/// How long the machine may take to answer. ssh itself gives up after five seconds.
const LIMIT: Duration = Duration::from_secs(15);

/// The longest answer.
const MOST: usize = 64 << 10;

/// The kind of the machine, and the free kB of its shared memory.
const SCRIPT: &str = "echo; echo \"rcdeploy agent: $(uname -sm)\"; df -Pk /dev/shm | tail -n 1";

/// Whether a machine can be reached, and is of the kind of this one.
pub(crate) fn of_host(host: &Host, mark: &Mark) -> Finding {
    let check = format!("host {}", host.name);
    match answer(host, mark) {
        Ok(said) => judged(&check, &said, host.elsewhere.as_ref()),
        Err(why) => Finding {
            check,
            grade: Grade::Error,
            found: why,
            fix: Some(format!("try `ssh {} true`", ssh::destination(host))),
        },
    }
}

/// The output of the script there.
pub(crate) fn answer(host: &Host, mark: &Mark) -> Result<String, String> {
    let failed = |error: std::io::Error| error.to_string();
    let (complaint, log) = Complaint::new().map_err(failed)?;
    let (mut child, stream) = ssh::start(host, SCRIPT, log, mark)?;
    let end = Instant::now() + LIMIT;
    let mut said = Vec::new();
    let mut part = [0; 4096];
    let mut late = false;
    while said.len() < MOST {
        let left = end.saturating_duration_since(Instant::now());
        if left.is_zero() {
            late = true;
            break;
        }
        stream.set_read_timeout(Some(left)).map_err(failed)?;
        match (&stream).read(&mut part) {
            Ok(0) => break,
            Ok(count) => said.extend_from_slice(&part[..count]),
            // The time is over, or the connection is: the next turn finds out.
            Err(error) if error.kind() == std::io::ErrorKind::WouldBlock => {}
            Err(error) => return Err(failed(error)),
        }
    }
    let _ = child.kill();
    let _ = child.wait();
    let said = String::from_utf8_lossy(&said).into_owned();
    if said.contains(ssh::TOKEN) {
        return Ok(said);
    }
    let noticed = if late {
        "it does not answer"
    } else {
        "its login ends without an answer"
    };
    Err(ssh::explain(host, noticed, &complaint.text()))
}

/// The processor of a machine, which answers with its kind. `None` if it does not answer, or has one
/// without a name.
pub(crate) fn processor(host: &Host, mark: &Mark) -> Option<Processor> {
    let said = answer(host, mark).ok()?;
    let (kind, _) = kind(&said);
    Processor::from_machine(kind.strip_prefix("Linux ")?)
}

/// The kind of a machine in its answer, and the next line.
fn kind(said: &str) -> (String, Option<&str>) {
    let mut lines = said
        .lines()
        .skip_while(|line| !line.starts_with(ssh::TOKEN));
    let kind = lines.next().unwrap_or_default();
    let kind = foreign::clean(kind.trim_start_matches(ssh::TOKEN).trim());
    (kind, lines.next())
}

/// The interpretation of the answer of a machine, whose programs may be made for it.
fn judged(check: &str, said: &str, elsewhere: Option<&Elsewhere>) -> Finding {
    let (kind, memory) = kind(said);
    let here = rustix::system::uname();
    let here = format!(
        "{} {}",
        here.sysname().to_string_lossy(),
        here.machine().to_string_lossy()
    );
    let machine = kind.split(' ').nth(1).unwrap_or_default();
    let declared = elsewhere.map(|elsewhere| elsewhere.machine.as_deref());
    let is_right = match declared {
        Some(Some(declared)) => is_served(declared, machine),
        Some(None) => true,
        None => kind == here,
    };
    if !is_right {
        let found = format!("it is a machine of the kind {kind}, and this one is {here}");
        let fix = Processor::from_machine(machine).map_or_else(
            || "run the network from a machine like it".to_owned(),
            |processor| format!("write `arch {processor};` in its `Host`"),
        );
        return Finding::error(check, found, fix);
    }
    // Name, all, used and free kB (POSIX, df -P).
    let free = memory.and_then(|line| line.split_whitespace().nth(3));
    match free.and_then(|text| text.parse::<u64>().ok()) {
        Some(free) if free < 64 << 10 => {
            let found = format!("it answers; {free} kB of its shared memory are free");
            let fix = "mount -o remount,size=1G /dev/shm, there";
            Finding::warning(check, found, fix)
        }
        _ => match declared {
            None => Finding::ok(check, format!("it answers, and is {kind}, as this machine")),
            Some(_) => Finding::ok(check, format!("it answers, and is {kind}")),
        },
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_kind_and_the_memory_of_a_machine_are_compared() {
        let here = rustix::system::uname();
        let here = format!(
            "{} {}",
            here.sysname().to_string_lossy(),
            here.machine().to_string_lossy()
        );
        let said = |kind: &str, free: &str| {
            format!("Welcome!\nrcdeploy agent: {kind}\ntmpfs 65536 0 {free} 0% /dev/shm\n")
        };
        let grade = |said: &str| judged("host robot", said, None).grade;
        assert_eq!(grade(&said(&here, "12000000")), Grade::Ok);
        assert_eq!(grade(&said(&here, "600")), Grade::Warning);
        assert_eq!(grade(&said("Linux other", "12000000")), Grade::Error);
        let there = Elsewhere {
            machine: Some("aarch64".to_owned()),
            there: true,
            program: None,
        };
        let arm = |said: &str| judged("host robot", said, Some(&there));
        assert_eq!(arm(&said("Linux aarch64", "12000000")).grade, Grade::Ok);
        assert_eq!(arm(&said(&here, "12000000")).grade, Grade::Error);
        let fix = judged("host robot", &said("Linux aarch64", "1"), None).fix;
        assert_eq!(fix.as_deref(), Some("write `arch arm64;` in its `Host`"));
        // Without `df`, nothing is said about memory.
        assert_eq!(grade(&format!("rcdeploy agent: {here}\n")), Grade::Ok);
    }
}
