//! Values that know their age: two processes of the component `aged`, of which one is killed.

use crate::network::Network;
use crate::process::Package;
use crate::{LIMIT, until};
use std::io::{BufRead, BufReader};
use std::process::{Child, Stdio};
use std::sync::mpsc::{Receiver, channel};

/// A component that prints what it sees.
struct Seeing {
    process: Child,
    lines: Receiver<String>,
    seen: Vec<String>,
    _package: Package,
}

impl Drop for Seeing {
    fn drop(&mut self) {
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

impl Seeing {
    fn start(network: &Network, mut package: Package, name: &str, more: &[&str]) -> Self {
        let command = package.command.args(network.arguments());
        command.args(["--name", name]).args(more);
        let mut process = command.stdout(Stdio::piped()).spawn().expect("the program");
        let output = BufReader::new(process.stdout.take().expect("its output"));
        let (sender, lines) = channel();
        std::thread::spawn(move || {
            for line in output.lines().map_while(Result::ok) {
                if sender.send(line).is_err() {
                    break;
                }
            }
        });
        Self {
            process,
            lines,
            seen: Vec::new(),
            _package: package,
        }
    }

    /// Waits for a line.
    fn sees(&mut self, line: &str) {
        while !self.seen.iter().any(|seen| seen == line) {
            let next = self.lines.recv_timeout(LIMIT);
            let next = next.unwrap_or_else(|_| panic!("no `{line}`: {:?}", self.seen));
            self.seen.push(next);
        }
    }

    /// What it has seen since the last time, in this order.
    fn take(&mut self) -> Vec<String> {
        self.seen.extend(self.lines.try_iter());
        std::mem::take(&mut self.seen)
    }
}

/// Runs the suite of ages. `package` makes the component `aged` with this result of its battery.
/// `carries_ages`: whether replies of this middleware say how old their values are.
///
/// # Panics
/// The component does not do what it should.
pub fn ages(network: &Network, carries_ages: bool, package: &dyn Fn(&str) -> Package) {
    // Both implement the battery; the one that asks has it elsewhere.
    let own = network.bind("BatteryStatus", "unused");
    let server = ["other", "strict"].map(|slot| network.bind(slot, "BatteryStatus"));
    let own = ["--bind", &own];
    let bound = [own[0], own[1], "--bind", &server[0], "--bind", &server[1]];
    let mut asker = Seeing::start(network, package("0"), "asker", &bound);
    asker.sees("NoServer");
    asker.take();

    let mut giver = Seeing::start(network, package("7"), "giver", &[]);
    for line in ["no value", "collected", "both are partly cached"] {
        giver.sees(line);
    }
    asker.sees("7 is computed");
    asker.sees("7 is cached");
    if carries_ages {
        // The value is as old as the giver.
        asker.sees("stale");
    }
    let seen = asker.take();
    assert!(!seen.iter().any(|line| line == "not stale"), "{seen:?}");

    giver.process.kill().expect("a process");
    giver.process.wait().expect("its end");
    asker.sees("NoServer");
    let seen = asker.take();
    let is_gone = |line: &&String| ["ServerDied", "Deadline", "NoServer"].contains(&line.as_str());
    // A last answer of the giver may have come before its end.
    let last = |line: &&String| carries_ages && *line == "stale";
    assert!(
        seen.iter().skip_while(last).all(|line| is_gone(&line)),
        "kept replies end with their server: {seen:?}"
    );
    assert!(
        !giver.take().iter().any(|line| line == "handled"),
        "the last value answers"
    );

    let mut other = Seeing::start(network, package("8"), "giver", &[]);
    asker.sees("8 is cached");
    let seen = asker.take();
    let first = seen.iter().find(|line| !is_gone(line));
    assert_eq!(first.map(String::as_str), Some("8 is computed"), "{seen:?}");
    assert!(!seen.iter().any(|line| line.starts_with('7')), "{seen:?}");
    other.sees("collected");
    let mut all = vec![asker, other];
    for one in &mut all {
        let _ = one.process.kill();
    }
    until("both have ended", || {
        all.iter_mut()
            .all(|one| matches!(one.process.try_wait(), Ok(Some(_))))
    });
}
