//! The last start of a network: when each component began and was ready, what it waited for, and
//! the chain of components that took longest. The supervisor writes it beside the logs.

use crate::error::Error;
use crate::logs;
use rc_diagnostics::foreign::clean;
use serde::{Deserialize, Serialize};
use std::collections::BTreeSet;
use std::fmt;
use std::io;
use std::path::{Path, PathBuf};

/// The name of its file.
const FILE: &str = "start.json";

/// A start of a network.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct StartReport {
    /// The network.
    pub network: String,
    /// When the supervisor began, RFC 3339.
    pub began: String,
    /// Milliseconds from there until the network was up. `None`: it did not come up.
    pub up_ms: Option<f64>,
    /// The phases of all components that began.
    pub phases: Vec<Phase>,
}

/// A part of the start of a component.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Phase {
    /// The component and the part.
    #[serde(flatten)]
    pub key: PhaseKey,
    /// Milliseconds from the begin of the start until it began.
    pub began_ms: f64,
    /// Milliseconds from the begin of the start until it ended. `None`: it did not.
    pub ended_ms: Option<f64>,
    /// The phase that ended last of those that it had to wait for.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub waited_for: Option<PhaseKey>,
}

/// Names a phase.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct PhaseKey {
    /// The component.
    pub component: String,
    /// The part of its start.
    pub phase: PhaseKind,
}

/// The parts of a start.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum PhaseKind {
    /// From the start of its process until it is ready; a managed component is then configured.
    Start,
    /// From the request to activate a managed component until it is active.
    Activate,
}

/// A report with its critical chain, as tools print it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CriticalChain {
    /// The start.
    #[serde(flatten)]
    pub start: StartReport,
    /// The phases from the last one to the first one. Each waited for the next one.
    pub chain: Vec<Link>,
}

/// A phase of the critical chain.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Link {
    /// The component and the part.
    #[serde(flatten)]
    pub key: PhaseKey,
    /// When it ended, in milliseconds from the begin of the start.
    pub ended_ms: Option<f64>,
    /// How long it took, in milliseconds.
    pub took_ms: Option<f64>,
    /// Milliseconds from the end of the phase that it waited for, else from the begin of the start,
    /// until it began: the time of the supervisor, of other starts, or of its host.
    pub idle_ms: f64,
}

/// The file of a network's last start, in the folder of its logs.
pub fn file(directory: &Path) -> PathBuf {
    directory.join(FILE)
}

/// Reads the last start of a network.
pub fn read(network: &str) -> Result<CriticalChain, Error> {
    let path = file(&logs::directory(network));
    let failed = |source: io::Error| Error::System {
        action: format!("read {}", path.display()),
        source,
    };
    let text = rc_files::read(&path).map_err(|error| match error.kind() {
        io::ErrorKind::NotFound => {
            let text = format!("network {network} has not started on this machine, or is starting");
            failed(io::Error::new(io::ErrorKind::NotFound, text))
        }
        _ => failed(error),
    })?;
    let start: StartReport =
        serde_json::from_str(&text).map_err(|error| failed(io::Error::other(error)))?;
    Ok(CriticalChain::of(start))
}

/// Writes the start of a network into the folder of its logs.
pub fn write(directory: &Path, report: &StartReport) -> io::Result<()> {
    let text = serde_json::to_string_pretty(report).map_err(io::Error::other)? + "\n";
    rc_files::write_with(&file(directory), |out| out.write_all(text.as_bytes()))
}

impl CriticalChain {
    /// Finds the chain: the phase that ended last, or the first one that never did, and back.
    pub fn of(start: StartReport) -> Self {
        let unfinished = start.phases.iter().filter(|phase| phase.ended_ms.is_none());
        let first = unfinished.min_by(|a, b| a.began_ms.total_cmp(&b.began_ms));
        let ended = start.phases.iter().filter(|phase| phase.ended_ms.is_some());
        let last = ended.max_by(|a, b| {
            a.ended_ms
                .partial_cmp(&b.ended_ms)
                .unwrap_or(std::cmp::Ordering::Equal)
        });
        let (mut chain, mut seen) = (Vec::new(), BTreeSet::new());
        let mut at = first.or(last);
        while let Some(phase) = at.filter(|phase| seen.insert(&phase.key)) {
            let before = phase.waited_for.as_ref();
            at = before.and_then(|key| start.phases.iter().find(|phase| phase.key == *key));
            let released = at.and_then(|before| before.ended_ms).unwrap_or(0.0);
            chain.push(Link {
                key: phase.key.clone(),
                ended_ms: phase.ended_ms,
                took_ms: phase.ended_ms.map(|ended| rounded(ended - phase.began_ms)),
                idle_ms: rounded(phase.began_ms - released),
            });
        }
        Self { start, chain }
    }
}

/// To microseconds.
fn rounded(ms: f64) -> f64 {
    (ms * 1e3).round() / 1e3
}

impl fmt::Display for CriticalChain {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (network, began) = (clean(&self.start.network), clean(&self.start.began));
        match self.start.up_ms {
            Some(ms) => writeln!(
                f,
                "network {network} was up {:.3} s after its start at {began}",
                ms / 1e3
            )?,
            None => writeln!(
                f,
                "network {network} did not come up after its start at {began}"
            )?,
        }
        if self.chain.is_empty() {
            return writeln!(f, "no component has started");
        }
        writeln!(f, "each component waited for the one below it:")?;
        writeln!(
            f,
            "{:>10}  {:>10}  {:>10}",
            "ready at", "took", "idle before"
        )?;
        for link in &self.chain {
            let seconds = |ms: Option<f64>| {
                ms.map_or_else(|| "never".to_owned(), |ms| format!("{:.3} s", ms / 1e3))
            };
            let activates = match link.key.phase {
                PhaseKind::Start => "",
                PhaseKind::Activate => " (activated)",
            };
            writeln!(
                f,
                "{:>10}  {:>10}  {:>11}  {}{activates}",
                seconds(link.ended_ms),
                seconds(link.took_ms),
                seconds(Some(link.idle_ms)),
                clean(&link.key.component)
            )?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use expect_test::expect;

    fn key(component: &str, phase: PhaseKind) -> PhaseKey {
        PhaseKey {
            component: component.to_owned(),
            phase,
        }
    }

    fn phase(name: &str, times: (f64, Option<f64>), waited_for: Option<&str>) -> Phase {
        Phase {
            key: key(name, PhaseKind::Start),
            began_ms: times.0,
            ended_ms: times.1,
            waited_for: waited_for.map(|name| key(name, PhaseKind::Start)),
        }
    }

    fn start(up_ms: Option<f64>, phases: Vec<Phase>) -> CriticalChain {
        CriticalChain::of(StartReport {
            network: "robot".to_owned(),
            began: "2026-01-31T12:00:00.000Z".to_owned(),
            up_ms,
            phases,
        })
    }

    #[test]
    fn the_chain_goes_from_the_last_component_back_to_the_first() {
        let all = vec![
            phase("quick", (3.0, Some(20.0)), None),
            phase("base", (4.0, Some(900.0)), None),
            phase("driver", (905.4, Some(1200.0)), Some("base")),
            phase("other", (21.0, Some(1100.0)), Some("quick")),
            Phase {
                key: key("driver", PhaseKind::Activate),
                ..phase("", (1200.5, Some(1234.0)), Some("driver"))
            },
        ];
        expect![[r"
            network robot was up 1.235 s after its start at 2026-01-31T12:00:00.000Z
            each component waited for the one below it:
              ready at        took  idle before
               1.234 s     0.034 s      0.001 s  driver (activated)
               1.200 s     0.295 s      0.005 s  driver
               0.900 s     0.896 s      0.004 s  base
        "]]
        .assert_eq(&start(Some(1235.0), all).to_string());
    }

    #[test]
    fn a_component_that_was_never_ready_ends_the_chain() {
        let all = vec![
            phase("base", (4.0, Some(900.0)), None),
            phase("driver", (901.0, None), Some("base")),
            phase("other", (902.0, Some(5000.0)), None),
        ];
        let chain = start(None, all);
        let names: Vec<&str> = chain
            .chain
            .iter()
            .map(|link| &*link.key.component)
            .collect();
        assert_eq!(names, ["driver", "base"]);
        assert!(chain.to_string().contains("did not come up"), "{chain}");
    }

    /// The file is read as it is, and may be anything.
    #[test]
    fn a_chain_in_a_circle_ends() {
        let all = vec![
            phase("a", (1.0, Some(2.0)), Some("b")),
            phase("b", (1.0, Some(1.5)), Some("a")),
        ];
        assert_eq!(start(Some(2.0), all).chain.len(), 2);
        assert!(
            start(None, Vec::new())
                .to_string()
                .ends_with("no component has started\n")
        );
    }
}
