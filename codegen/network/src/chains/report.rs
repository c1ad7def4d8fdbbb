//! Chains for people: which hop costs what, and what helps.

use super::{CheckedChain, Port, TransportFrom};
use crate::bounds::{Cost, Way};
use crate::model::Network;
use rc_diagnostics::Diagnostic;
use serde::Serialize;
use std::fmt;
use std::time::Duration;

/// A chain of the preview.
#[derive(Clone, Debug, Serialize)]
pub struct ChainReport {
    /// Full name in the network.
    pub name: String,
    /// The message that begins it: `COMPONENT.SLOT.OPERATION`.
    pub from: String,
    /// The message that ends it.
    pub to: String,
    /// The most time from its beginning to its end, as declared, in milliseconds.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub within_ms: Option<f64>,
    /// The most age of data at its end, as declared, in milliseconds.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub age_ms: Option<f64>,
    /// The longest time from its beginning to its end. `None`: there is no bound.
    pub worst_ms: Option<f64>,
    /// The oldest data at its end. `None`: there is no bound.
    pub oldest_ms: Option<f64>,
    /// The components that it passes.
    pub hops: Vec<HopReport>,
    /// Facts on which its worst case depends.
    pub notes: Vec<String>,
}

/// A component on a chain.
#[derive(Clone, Debug, Serialize)]
pub struct HopReport {
    /// Full name of the component.
    pub component: String,
    /// The operation that it receives: `SLOT.OPERATION`.
    pub receives: String,
    /// `handler`, or `compute` if it waits for a period.
    pub reacts_in: &'static str,
    /// The way of the message to it, in milliseconds.
    pub transport_ms: Option<f64>,
    /// Waiting for its next period.
    pub period_ms: Option<f64>,
    /// Its handlers and its `compute()`.
    pub work_ms: Option<f64>,
}

fn milliseconds(nanoseconds: u64) -> f64 {
    nanoseconds as f64 / 1e6
}

/// A time as people read it in a sentence: `112 ms`, `1.25 ms`. Rounded up to 10 µs.
pub(super) fn time(time: Duration) -> String {
    let hundredths = time.as_nanos().div_ceil(10_000);
    let (whole, rest) = (hundredths / 100, hundredths % 100);
    let text = match rest {
        0 => whole.to_string(),
        rest if rest % 10 == 0 => format!("{whole}.{}", rest / 10),
        rest => format!("{whole}.{rest:02}"),
    };
    format!("{text} ms")
}

fn of(nanoseconds: u64) -> String {
    time(Duration::from_nanos(nanoseconds))
}

/// Warns of a chain whose worst case is over its limit.
pub(super) fn slow_chain(network: &Network, checked: &CheckedChain) -> Option<Diagnostic> {
    let chain = &network.deployment.chains[checked.declared];
    let (limit, costs, worst) = (chain.within?, checked.costs.as_ref()?, checked.worst()?);
    if worst <= limit {
        return None;
    }
    let hops = checked.path.links.iter().zip(costs);
    let hops = hops.map(|(link, cost)| {
        let path = &network.deployment.instances[link.to.instance].path;
        format!("{path} {}", of(cost.total()))
    });
    let message = format!(
        "chain `{}` takes {} in the worst case, {} more than `within` allows: {}",
        chain.name.text,
        time(worst),
        time(worst.saturating_sub(limit)),
        hops.collect::<Vec<_>>().join(", ")
    );
    let warning = Diagnostic::warning("slow-chain", chain.name.span, message);
    Some(warning.help(advice(network, checked, costs)))
}

/// The largest cost of a chain, with advice.
fn advice(network: &Network, checked: &CheckedChain, costs: &[Cost]) -> String {
    let links = checked.path.links.iter().zip(costs);
    let parts = links.flat_map(|(link, cost)| {
        [
            (
                cost.period,
                if link.way == Way::Handler { 3 } else { 0 },
                link.to,
            ),
            (cost.work, 1, link.to),
            (cost.transport, 2, link.to),
        ]
    });
    let Some((cost, kind, port)) = parts.max_by_key(|(cost, kind, _)| (*cost, 3 - *kind)) else {
        return String::new();
    };
    let component = &network.deployment.instances[port.instance].path;
    let cost = of(cost);
    match kind {
        3 => format!(
            "{cost} of them, `{}` waits for what it is collected with: shorten `within` of `collect` in {component}",
            message_name(network, port)
        ),
        0 => format!(
            "{cost} of them are the period of {component}: react in the handler of `{}`, or halve the period",
            message_name(network, port)
        ),
        1 if checked.assumed.contains(&port.instance) => format!(
            "{cost} of them is the work of {component}, whose budgets are assumed: declare them in its `reactions`"
        ),
        1 => format!("{cost} of them is the work of {component}: shorten its budgets"),
        _ => {
            let mut links = checked.path.links.iter().zip(&checked.transports);
            let from = links
                .find(|(link, _)| link.to == port)
                .map(|(_, from)| from);
            let advice = match from {
                Some(TransportFrom::Declared) => "which the network declares",
                Some(TransportFrom::Measured) => "as measured on this machine",
                _ => "which is assumed: measure it with `rcdeploy transport`, or declare it",
            };
            format!("{cost} of them is the way of a message to {component}, {advice}")
        }
    }
}

/// `SLOT.OPERATION`
fn message_name(network: &Network, port: Port) -> String {
    let name = network.port_name(port);
    let path = &network.deployment.instances[port.instance].path;
    let own = name.strip_prefix(path.as_str());
    own.and_then(|own| own.strip_prefix('.'))
        .unwrap_or(&name)
        .to_owned()
}

/// Warns of a chain whose data may be older than its limit.
pub(super) fn stale_chain(network: &Network, checked: &CheckedChain) -> Option<Diagnostic> {
    let chain = &network.deployment.chains[checked.declared];
    let limit = chain.age?;
    let message = match checked.oldest {
        Some(oldest) if oldest <= limit => return None,
        Some(oldest) => format!(
            "the data of chain `{}` are {} old in the worst case, {} more than `age` allows",
            chain.name.text,
            time(oldest),
            time(oldest.saturating_sub(limit))
        ),
        None => format!(
            "the data of chain `{}` may be of any age: the rate of its first message is not known",
            chain.name.text
        ),
    };
    let help = "an effect uses the newest message, which is as old as the periods of those who send it: shorten them, or react in handlers";
    Some(Diagnostic::warning("stale-chain", chain.name.span, message).help(help))
}

impl ChainReport {
    /// The chains of a network.
    pub fn all(network: &Network) -> Vec<Self> {
        let chains = network.chains.iter();
        chains.map(|chain| Self::of(network, chain)).collect()
    }

    fn of(network: &Network, checked: &CheckedChain) -> Self {
        let chain = &network.deployment.chains[checked.declared];
        let path = &checked.path;
        let hops = path.links.iter().enumerate().map(|(at, link)| {
            let cost = checked.costs.as_ref().and_then(|costs| costs.get(at));
            HopReport {
                component: network.deployment.instances[link.to.instance].path.clone(),
                receives: message_name(network, link.to),
                reacts_in: match link.way {
                    Way::Handler => "handler",
                    Way::Compute => "compute",
                },
                transport_ms: cost.map(|cost| milliseconds(cost.transport)),
                period_ms: cost.map(|cost| milliseconds(cost.period)),
                work_ms: cost.map(|cost| milliseconds(cost.work)),
            }
        });
        let first = path.links.first().map(|link| link.from.unwrap_or(link.to));
        let last = path.sent.or(path.links.last().map(|link| link.to));
        let name =
            |port: Option<Port>| port.map_or_else(String::new, |port| network.port_name(port));
        let in_ms = |time: Duration| time.as_secs_f64() * 1e3;
        Self {
            name: chain.path.clone(),
            from: name(first),
            to: name(last),
            within_ms: chain.within.map(in_ms),
            age_ms: chain.age.map(in_ms),
            worst_ms: checked.worst().map(in_ms),
            oldest_ms: checked.oldest.map(in_ms),
            hops: hops.collect(),
            notes: notes(network, checked),
        }
    }
}

/// The assumptions behind the worst case of a chain.
fn notes(network: &Network, checked: &CheckedChain) -> Vec<String> {
    let names = |all: Vec<usize>| {
        let names = all
            .iter()
            .map(|at| network.deployment.instances[*at].path.as_str());
        names.collect::<Vec<_>>().join(", ")
    };
    let on = |is_meant: &dyn Fn(usize) -> bool| {
        let mut all: Vec<usize> = Vec::new();
        for link in &checked.path.links {
            let at = link.to.instance;
            if is_meant(at) && !all.contains(&at) {
                all.push(at);
            }
        }
        all
    };
    let mut notes = Vec::new();
    if !checked.assumed.is_empty() {
        notes.push(format!(
            "budgets are assumed: {}",
            names(checked.assumed.clone())
        ));
    }
    let is_from = |from: TransportFrom| checked.transports.contains(&from);
    if is_from(TransportFrom::Measured) {
        let but = if is_from(TransportFrom::Assumed) {
            ", and assumed where it was not"
        } else {
            ""
        };
        notes.push(format!("transport is measured on this machine{but}"));
    } else if is_from(TransportFrom::Assumed) {
        notes.push("transport is assumed".to_owned());
    }
    for outside in &checked.outside {
        if checked.path.links.iter().any(|link| outside.is(link)) {
            notes.push(format!(
                "programs outside send {} for {} within {}",
                network.port_name(outside.to),
                network.port_name(outside.from),
                of(outside.within)
            ));
        }
    }
    let simulated = on(&|at| network.clocks[at].kind != "system");
    if !simulated.is_empty() {
        notes.push(format!(
            "periods follow the network's time: {}",
            names(simulated)
        ));
    }
    let managed = on(&|at| {
        let project = network.projects[at].as_deref();
        project.is_some_and(|project| project.component.managed)
    });
    if !managed.is_empty() {
        notes.push(format!("holds while active: {}", names(managed)));
    }
    notes
}

impl fmt::Display for ChainReport {
    /// A line for the chain, and one for each hop.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let text = |ms: f64| time(Duration::from_secs_f64(ms / 1e3));
        let limit = |name: &str, ms: Option<f64>| {
            ms.map_or_else(String::new, |ms| format!(" ({name} {})", text(ms)))
        };
        let worst = self.worst_ms.map_or_else(|| "no bound".to_owned(), text);
        let oldest = self.oldest_ms.map_or_else(
            || "data of any age".to_owned(),
            |ms| format!("data at most {} old", text(ms)),
        );
        writeln!(f, "chain {}: {} → {}", self.name, self.from, self.to)?;
        writeln!(
            f,
            "    at worst {worst}{}; {oldest}{}",
            limit("within", self.within_ms),
            limit("age", self.age_ms)
        )?;
        for hop in &self.hops {
            write!(f, "    {}.{}", hop.component, hop.receives)?;
            if let (Some(transport), Some(period), Some(work)) =
                (hop.transport_ms, hop.period_ms, hop.work_ms)
            {
                write!(f, ": {} on the way", text(transport))?;
                if period > 0.0 {
                    let until = match hop.reacts_in {
                        "handler" => "it is collected",
                        _ => "`compute`",
                    };
                    write!(f, ", {} until {until}", text(period))?;
                }
                write!(f, ", {} work", text(work))?;
            }
            writeln!(f)?;
        }
        for note in &self.notes {
            writeln!(f, "    {note}")?;
        }
        Ok(())
    }
}
