//! `rcdeploy bench`: the latency of each connection of a running network, beside the last run.

use super::arguments::format;
use super::completion::networks;
use super::networks::running;
use super::output::{Failure, counted, print_note, show};
use clap::Args;
use rc_command_line::words;
use rc_deploy_client::{Format, logs};
use rc_diagnostics::foreign::clean;
use rc_management::chains::Times;
use rc_observe::{ConnectionLatency, Network, latencies};
use serde::{Deserialize, Serialize};
use std::fmt;
use std::path::PathBuf;
use std::time::Duration;

/// Arguments of `bench`.
#[derive(Args)]
pub(super) struct Bench {
    /// The network or its .ddsl. Optional if only one network runs.
    #[arg(add = networks())]
    network: Option<String>,
    /// How long messages are counted.
    #[arg(long, value_name = "SECONDS", default_value_t = 5, value_parser = clap::value_parser!(u64).range(1..=3600))]
    seconds: u64,
    /// The form of the output: human or json (one document).
    #[arg(long, default_value = "human", value_parser = format, add = words(&["human", "json"]))]
    format: Format,
}

/// A run of `bench`.
#[derive(Debug, Serialize, Deserialize)]
struct Run {
    network: String,
    /// The machine that has measured. Several machines may share a home folder.
    machine: String,
    connections: Vec<ConnectionLatency>,
}

/// A run beside the last one.
#[derive(Debug, Serialize)]
struct Compared {
    network: String,
    machine: String,
    connections: Vec<ComparedLatency>,
    /// The connections of the last run that this one has not.
    gone: Vec<String>,
    /// Whether there was a last run.
    #[serde(skip)]
    is_first: bool,
}

#[derive(Debug, Serialize)]
struct ComparedLatency {
    #[serde(flatten)]
    now: ConnectionLatency,
    /// The times of the last run.
    last: Option<Times>,
}

/// Where the last run of a network is: beside its logs.
fn place(network: &str) -> PathBuf {
    logs::directory(network).join("bench.json")
}

pub(super) fn bench(options: Bench) -> Result<u8, Failure> {
    let network = Network::look(&running(options.network)?)?;
    let measured = latencies(&network, Duration::from_secs(options.seconds));
    for note in &measured.notes {
        print_note(note);
    }
    let run = Run {
        network: network.name.clone(),
        machine: rustix::system::uname()
            .nodename()
            .to_string_lossy()
            .into_owned(),
        connections: measured.connections,
    };
    let path = place(&network.name);
    let failed = |error: std::io::Error| Failure(3, format!("{}: {error}", path.display()));
    let last = match rc_files::read(&path) {
        Ok(text) => serde_json::from_str::<Run>(&text).ok(),
        Err(_) => None,
    };
    let text = serde_json::to_string_pretty(&run).map_err(std::io::Error::other);
    let text = text.map_err(failed)? + "\n";
    logs::open_directory(&network.name)?;
    rc_files::write_with(&path, |out| out.write_all(text.as_bytes())).map_err(failed)?;
    let last = last.filter(|last| last.machine == run.machine);
    let compared = Compared::new(run, last);
    show(options.format, &compared, ToString::to_string)
}

/// A connection, as people read it.
fn name(one: &ConnectionLatency) -> String {
    let from = one.from.as_deref().unwrap_or("outside");
    format!("{} -> {}", clean(from), clean(&one.to))
}

impl Compared {
    fn new(run: Run, last: Option<Run>) -> Self {
        let is_first = last.is_none();
        let mut last = last.map(|last| last.connections).unwrap_or_default();
        let connections = run.connections.into_iter().map(|now| {
            // A connection over another middleware is another one.
            let is_same = |one: &ConnectionLatency| {
                (&one.from, &one.to, &one.middleware) == (&now.from, &now.to, &now.middleware)
            };
            let known = last.iter().position(is_same).map(|at| last.swap_remove(at));
            ComparedLatency {
                last: known.and_then(|known| known.times),
                now,
            }
        });
        let connections = connections.collect();
        let mut gone: Vec<String> = last.iter().map(name).collect();
        gone.sort();
        Self {
            network: run.network,
            machine: run.machine,
            connections,
            gone,
            is_first,
        }
    }
}

impl fmt::Display for Compared {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let is_silent = |one: &&ComparedLatency| one.now.messages == Some(0);
        let (silent, shown): (Vec<_>, Vec<_>) = self.connections.iter().partition(is_silent);
        let names: Vec<String> = shown.iter().map(|one| name(&one.now)).collect();
        let width = names.iter().map(|name| name.chars().count()).max();
        let width = width.unwrap_or(0).max("connection".len());
        let over = shown.iter().map(|one| one.now.middleware.len());
        let over = over.max().unwrap_or(0).max("over".len());
        writeln!(
            f,
            "{:width$}  {:over$}  messages  {:<19}{:<19}worst ms",
            "connection", "over", "p50 ms", "p99 ms"
        )?;
        for (name, one) in names.iter().zip(&shown) {
            let now = &one.now;
            let count = now
                .messages
                .map_or_else(|| "chain".to_owned(), |count| count.to_string());
            write!(
                f,
                "{name:width$}  {:over$}  {count:>8}",
                clean(&now.middleware)
            )?;
            let Some(times) = now.times else {
                let why = match now.messages {
                    Some(1..) => "the clock of the sender is unknown",
                    Some(0) | None => "no message",
                };
                writeln!(f, "  {why}")?;
                continue;
            };
            let pairs = [
                (times.p50_ms, one.last.map(|last| last.p50_ms)),
                (times.p99_ms, one.last.map(|last| last.p99_ms)),
                (times.worst_ms, one.last.map(|last| last.worst_ms)),
            ];
            let mut line = String::new();
            for (now, last) in pairs {
                let difference =
                    last.map_or_else(String::new, |last| format!(" ({:+.3})", now - last));
                line += &format!("  {:<17}", format!("{now:.3}{difference}"));
            }
            write!(f, "{}", line.trim_end())?;
            if let Some(error) = now.error_ms {
                write!(f, "  ± {error:.3}")?;
            }
            writeln!(f)?;
        }
        match silent.len() as u64 {
            0 if shown.is_empty() => writeln!(f, "no component receives anything")?,
            0 => {}
            count => {
                let count = counted(count, "operation");
                writeln!(f, "{count} without a message; `--format json` lists all")?;
            }
        }
        for gone in &self.gone {
            writeln!(f, "{gone}: was in the last run")?;
        }
        if !self.is_first {
            writeln!(f, "In parentheses: the difference to the last run.")?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use expect_test::expect;

    fn one(
        from: Option<&str>,
        to: &str,
        messages: Option<u64>,
        ms: Option<f64>,
    ) -> ConnectionLatency {
        ConnectionLatency {
            from: from.map(str::to_owned),
            to: to.to_owned(),
            middleware: "dds".to_owned(),
            messages,
            times: ms.map(|ms| Times {
                p50_ms: ms,
                p99_ms: 2.0 * ms,
                worst_ms: 10.0 * ms,
            }),
            error_ms: None,
        }
    }

    fn run(connections: Vec<ConnectionLatency>) -> Run {
        Run {
            network: "robot".to_owned(),
            machine: "here".to_owned(),
            connections,
        }
    }

    #[test]
    fn a_run_stands_beside_the_last_one() {
        let scan = |ms| one(Some("lidar.Scan"), "avoider.Scan.push", Some(50), Some(ms));
        let silent = one(Some("panel.Base"), "base.Base.stop", Some(0), None);
        let first = run(vec![scan(0.25), one(None, "old.X.y", Some(1), Some(1.0))]);
        let error = ConnectionLatency {
            error_ms: Some(0.2),
            ..one(Some("lidar"), "far.Scan.push", None, Some(0.5))
        };
        let over_dds = scan(0.2);
        let otherwise = ConnectionLatency {
            middleware: "iceoryx2".to_owned(),
            ..scan(0.1)
        };
        let now = run(vec![over_dds, otherwise, silent, error]);
        expect![[r"
            connection                       over      messages  p50 ms             p99 ms             worst ms
            lidar.Scan -> avoider.Scan.push  dds             50  0.200 (-0.050)     0.400 (-0.100)     2.000 (-0.500)
            lidar.Scan -> avoider.Scan.push  iceoryx2        50  0.100              0.200              1.000
            lidar -> far.Scan.push           dds          chain  0.500              1.000              5.000  ± 0.200
            1 operation without a message; `--format json` lists all
            outside -> old.X.y: was in the last run
            In parentheses: the difference to the last run.
        "]]
        .assert_eq(&Compared::new(now, Some(first)).to_string());
    }
}
