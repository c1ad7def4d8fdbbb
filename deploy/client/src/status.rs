//! The status of a network, with components started by hand, and a table for people.

use crate::connection;
use crate::{Error, by_hand, place, states};
use rc_management::Client;
use rc_management::component::{self, ClockKind, ClockStatus};
use rc_management::supervisor::{ComponentState, ComponentStatus, NetworkStatus};
use serde::{Serialize, Serializer};
use serde_json::{Value, json};
use std::fmt::{self, Write};
use std::time::{Duration, Instant};

/// A network with all its components.
#[derive(Clone, Debug)]
pub struct NetworkReport {
    /// The name of the network.
    pub network: String,
    /// The status from its supervisor, if it has one.
    pub supervised: Option<NetworkStatus>,
    /// The components that were started by hand.
    pub by_hand: Vec<ComponentStatus>,
}

/// Finds the components of a network: those of its supervisor, and those that were started by hand.
pub fn report(network: &str) -> Result<NetworkReport, Error> {
    let (supervised, not_up) = match connection::status(network) {
        Ok(status) => (Some(status), None),
        Err(error @ Error::NotUp { .. }) => (None, Some(error)),
        Err(error) => return Err(error),
    };
    let supervised = supervised.map(|mut status| {
        refresh(&mut status);
        status
    });
    let known = supervised.iter().flat_map(|status| &status.components);
    let by_hand = by_hand::components(network, known.map(|c| c.name.as_str()));
    if let Some(error) = not_up
        && by_hand.is_empty()
    {
        return Err(error);
    }
    Ok(NetworkReport {
        network: network.to_owned(),
        supervised,
        by_hand,
    })
}

/// How long all components together may take to report their status, and one of them.
const FRESH_LIMIT: Duration = Duration::from_millis(500);
const ONE_LIMIT: Duration = Duration::from_millis(100);

/// Asks the components themselves for the values that the supervisor has from their last
/// heartbeats, so that the effect of a request is visible in the next status.
fn refresh(status: &mut NetworkStatus) {
    let directory = place::directory(&status.network);
    let deadline = Instant::now() + FRESH_LIMIT;
    for component in status.components.iter_mut().filter(|c| c.ready) {
        let limit = deadline.saturating_duration_since(Instant::now());
        let path = directory.socket(&component.name.replace('.', "-"));
        let Ok(mut client) = Client::connect(&path, limit.min(ONE_LIMIT)) else {
            continue;
        };
        let request = component::Request::Status;
        let report = client.call::<component::Status>(&request, limit.min(ONE_LIMIT));
        if let Ok(report) = report
            && i32::try_from(report.pid).ok() == component.pid
        {
            let fresh = by_hand::status(&report);
            component.machine = fresh.machine;
            component.clock = fresh.clock;
            component.lifecycle = component.lifecycle.and(fresh.lifecycle);
            let runs = [ComponentState::Running, ComponentState::Emergency];
            component.forwarded = fresh.forwarded;
            component.messages = fresh.messages;
            // The state of a proxy is that of the components behind it.
            let is_own = component.behind.is_empty();
            if is_own && runs.contains(&component.state) && runs.contains(&fresh.state) {
                component.state = fresh.state;
            }
        }
    }
}

impl NetworkReport {
    /// All components, those of the supervisor first.
    pub fn components(&self) -> impl Iterator<Item = &ComponentStatus> {
        let supervised = self.supervised.iter().flat_map(|status| &status.components);
        supervised.chain(&self.by_hand)
    }
}

impl Serialize for NetworkReport {
    /// The document of `rcdeploy status`: that of the supervisor, with all components.
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut document = match &self.supervised {
            Some(status) => serde_json::to_value(status).map_err(serde::ser::Error::custom)?,
            None => json!({
                "network": self.network, "pid": null, "guard": null, "ddsl": null,
                "digest": null, "changed": false, "directory": null, "troubles": [],
            }),
        };
        let components: Vec<&ComponentStatus> = self.components().collect();
        let components = serde_json::to_value(components).map_err(serde::ser::Error::custom)?;
        if let Value::Object(members) = &mut document {
            members.insert("components".to_owned(), components);
        }
        document.serialize(serializer)
    }
}

/// The status as a table for people.
pub fn table(status: &NetworkStatus) -> String {
    let mut table = String::new();
    // A string takes all text.
    let _ = write_head(status, &mut table);
    let components: Vec<&ComponentStatus> = status.components.iter().collect();
    let _ = write_components(&components, &mut table);
    table
}

/// The report as a table for people.
pub fn report_table(report: &NetworkReport) -> String {
    let mut table = String::new();
    let _ = match &report.supervised {
        Some(status) => write_head(status, &mut table),
        None => writeln!(table, "network {} has no supervisor", report.network),
    };
    let components: Vec<&ComponentStatus> = report.components().collect();
    let _ = write_components(&components, &mut table);
    table
}

fn write_head(status: &NetworkStatus, f: &mut String) -> fmt::Result {
    writeln!(
        f,
        "network {} from {}, supervised by process {}",
        status.network,
        status.ddsl.display(),
        status.pid
    )?;
    if status.changed {
        writeln!(
            f,
            "{} is not what the network was started from any more; what runs stays as it is until `rcdeploy down` and `up`",
            status.ddsl.display()
        )?;
    }
    for trouble in &status.troubles {
        writeln!(f, "{}: {}", trouble.code, trouble.message)?;
    }
    Ok(())
}

fn write_components(components: &[&ComponentStatus], f: &mut String) -> fmt::Result {
    let width = components.iter().map(|c| c.name.len()).max();
    let width = width.unwrap_or(0).max(9);
    let over = components.iter().map(|c| c.middleware.len()).max();
    let over = over.unwrap_or(0).max(10);
    writeln!(
        f,
        "{:width$}  {:9}  {:>8}  {:>9}  {:over$}",
        "component", "state", "pid", "up", "middleware"
    )?;
    for component in components {
        let pid = component
            .pid
            .map_or_else(String::new, |pid| pid.to_string());
        let up = component
            .uptime_s
            .map_or_else(String::new, |s| format!("{s:.1} s"));
        write!(
            f,
            "{:width$}  {:9}  {pid:>8}  {up:>9}  {:over$}",
            component.name, component.state, component.middleware
        )?;
        if let Some(lifecycle) = component.lifecycle {
            write!(f, "  {lifecycle}")?;
        }
        if component.by_hand {
            write!(f, "  by hand")?;
        }
        if let Some(process) = &component.process {
            write!(f, "  in process {process}")?;
        }
        if !component.behind.is_empty() {
            write!(f, "  proxy of {}", component.behind.join(", "))?;
        }
        if let Some(host) = &component.host {
            write!(f, "  on {host}")?;
        }
        if !component.cpu.is_empty() {
            write!(f, "  cpu {}", rc_scheduling::processors(&component.cpu))?;
        }
        if let Some(priority) = component.priority {
            write!(f, "  priority {priority}")?;
        }
        if let Some(exit) = &component.exit {
            write!(f, "  {exit}")?;
        }
        match component.restarts {
            0 => {}
            1 => write!(f, "  restarted once")?,
            times => write!(f, "  restarted {times} times")?,
        }
        for (slot, lost) in &component.lost {
            write!(f, "  {slot} lost {lost}")?;
        }
        for (slot, converted) in &component.converted {
            write!(f, "  {slot} converted {}", converted.messages)?;
            if converted.bad_values > 0 {
                write!(f, " and refused {}", converted.bad_values)?;
            }
            if converted.unplaced > 0 {
                write!(f, ", without a transform {}", converted.unplaced)?;
            }
            if converted.locked > 0 {
                write!(f, ", at a gimbal lock {}", converted.locked)?;
            }
        }
        if let Some(clock) = &component.clock {
            write!(f, "  {}", clock_text(clock))?;
        }
        writeln!(f)?;
        if let Some(machine) = &component.machine {
            let up = component.uptime_s.unwrap_or_default();
            let (now, last) = states::lines(machine, up);
            let last = last
                .first()
                .map_or_else(String::new, |last| format!("; {last}"));
            writeln!(f, "{:width$}  {now}{last}", "")?;
        }
        if !component.transports.is_empty() {
            let each = component.transports.iter();
            let each: Vec<String> = each
                .map(|(slot, over)| {
                    let carried = component.messages.get(slot).into_iter().flatten();
                    let carried = carried.map(|of| format!("{} ({})", of.middleware, of.messages));
                    let carried = carried.collect::<Vec<_>>().join(", ");
                    let over = if carried.is_empty() { over } else { &carried };
                    format!("{slot} over {over}")
                })
                .collect();
            writeln!(f, "{:width$}  {}", "", each.join("; "))?;
        }
        for (slot, forwarded) in &component.forwarded {
            writeln!(
                f,
                "{:width$}  {slot} forwarded {}, delay {} µs, at most {} µs",
                "", forwarded.messages, forwarded.mean_us, forwarded.most_us
            )?;
        }
        for trouble in &component.troubles {
            writeln!(f, "{:width$}  {}: {}", "", trouble.code, trouble.message)?;
        }
    }
    Ok(())
}

/// A clock that is not that of the system, for people: `simulated 12.340 s`.
pub fn clock_text(clock: &ClockStatus) -> String {
    let stands = clock.lost_ms.is_some() || !clock.waiting_for.is_empty();
    let stands = if stands { ", stands" } else { "" };
    match clock.kind {
        ClockKind::Source => format!(
            "publishes time {:.3} s, tick {}{stands}",
            clock.time_s, clock.tick
        ),
        ClockKind::Nodes => format!("time of /clock {:.3} s{stands}", clock.time_s),
        kind @ (ClockKind::System | ClockKind::Simulated) => {
            format!("{} time {:.3} s{stands}", kind.word(), clock.time_s)
        }
    }
}
