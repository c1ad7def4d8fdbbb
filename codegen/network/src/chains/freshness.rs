//! Checks `fresh`, `deadline` and `serve latest` of slots against the periods and the ways of those
//! who send.

use super::Port;
use super::check::ChainCheck;
use super::flow::{Flow, nanoseconds};
use crate::bounds::Rate;
use crate::model::Network;
use rc_cdsl::model::{Role, Slot};
use rc_ddsl::Endpoint;
use rc_diagnostics::{Diagnostic, Diagnostics};
use rc_vocabulary::duration::text_of;
use std::time::Duration;

/// Reports values that are never fresh, or not in all of a period, and deadlines that are missed in
/// each.
pub(crate) fn check(network: &Network, found: &mut Diagnostics) {
    let projects = network.projects.iter().flatten();
    let mut slots = projects.flat_map(|project| &project.component.slots);
    let is_asked = slots.any(|slot| {
        let qos = slot.whole_qos();
        qos.fresh.is_some() || slot.role.is_topic() && qos.deadline.is_some()
    });
    if !is_asked || network.projects.iter().any(Option::is_none) {
        return;
    }
    let check = ChainCheck {
        network,
        flow: Flow::new(network),
    };
    for connection in &network.connections.connections {
        let consumer = network.slot(connection.consumer);
        let provider = network.slot(connection.provider);
        let (Some(consumer), Some(provider)) = (consumer, provider) else {
            continue;
        };
        let ends = (connection.consumer, connection.provider);
        let (own, offered) = (consumer.whole_qos(), provider.whole_qos());
        if consumer.role == Role::SubscribesTo {
            // The publisher offers no longer one than the subscriber asks for.
            let deadlines = [(consumer, own.deadline), (provider, offered.deadline)];
            let shortest = deadlines
                .into_iter()
                .filter_map(|(slot, at)| Some((at?, slot)));
            if let Some((deadline, slot)) = shortest.min_by_key(|(deadline, _)| *deadline) {
                let missed = |from, to| check.missed(from, to, slot, deadline);
                found.extend(check.topics(ends, &missed));
            }
        }
        let Some(fresh) = own.fresh else {
            continue;
        };
        match consumer.role {
            Role::SubscribesTo => {
                let stale = |from, to| check.topic(from, to, consumer, fresh);
                found.extend(check.topics(ends, &stale));
            }
            _ => found.extend(check.query(ends.0, consumer, provider, fresh)),
        }
    }
}

impl ChainCheck<'_> {
    /// First report about a topic of a connection.
    fn topics(
        &self,
        (consumer, provider): (Endpoint, Endpoint),
        report: &dyn Fn(Port, Port) -> Option<Diagnostic>,
    ) -> Option<Diagnostic> {
        let operations = self.network.slot(consumer)?.interface;
        let component = &self.network.projects[consumer.instance]
            .as_deref()?
            .component;
        let count = component.library.interface(operations).operations.len();
        (0..count).find_map(|operation| {
            let port = |end: Endpoint| Port {
                instance: end.instance,
                slot: end.slot,
                operation,
            };
            report(port(provider), port(consumer))
        })
    }

    /// The shortest period in which a topic is published. `None` if it does not come from `compute`
    /// alone.
    fn period(&self, from: Port) -> Option<Duration> {
        let rates = self.flow.rates(from);
        let periods = rates.iter().map(|rate| match rate {
            Rate::Compute(at) => Some(nanoseconds(self.network.periods[*at])),
            Rate::Handler(..) | Rate::Unknown => None,
        });
        let period = periods.collect::<Option<Vec<u64>>>()?.into_iter().min()?;
        Some(Duration::from_nanos(period))
    }

    /// Reports a topic whose period is longer than a deadline of its ends.
    fn missed(&self, from: Port, to: Port, slot: &Slot, deadline: Duration) -> Option<Diagnostic> {
        let period = self.period(from).filter(|period| *period > deadline)?;
        let place = self.network.deployment.instances[to.instance].name.span;
        let message = format!(
            "each sample of `{}` misses its deadline: it comes every {}, and the deadline is {}",
            self.network.port_name(to),
            text_of(period),
            text_of(deadline)
        );
        let warning = Diagnostic::warning("missed-deadline", place, message);
        let help = format!(
            "lengthen `deadline` to {}, or shorten the period of `{}`",
            text_of(period),
            self.network.deployment.instances[from.instance].path
        );
        Some(warning.label(slot.span, "here").help(help))
    }

    fn topic(&self, from: Port, to: Port, slot: &Slot, fresh: Duration) -> Option<Diagnostic> {
        let name = self.network.port_name(to);
        let place = self.network.deployment.instances[to.instance].name.span;
        let way = Duration::from_nanos(self.transport(None, Some(from.instance), to));
        if way >= fresh {
            let message = format!(
                "samples of `{name}` may be too old when they come: they are up to {} on their way, and fresh for {}",
                text_of(way),
                text_of(fresh)
            );
            let warning = Diagnostic::warning("never-fresh", place, message);
            return Some(
                warning
                    .label(slot.span, "here")
                    .help("lengthen `fresh` in the .cdsl"),
            );
        }
        let period = self.period(from)?;
        if period.saturating_add(way) <= fresh {
            return None;
        }
        let message = format!(
            "the newest sample of `{name}` is too old in every period: it comes every {}, and is fresh for {}",
            text_of(period),
            text_of(fresh)
        );
        let warning = Diagnostic::warning("always-stale", place, message);
        let help = format!(
            "lengthen `fresh` to {}, or shorten the period of `{}`",
            text_of(period.saturating_add(way)),
            self.network.deployment.instances[from.instance].path
        );
        Some(warning.label(slot.span, "here").help(help))
    }

    /// Reports a server whose last value may be too old for a client.
    fn query(
        &self,
        consumer: Endpoint,
        slot: &Slot,
        provider: &Slot,
        fresh: Duration,
    ) -> Option<Diagnostic> {
        let latest = provider
            .whole_qos()
            .latest
            .filter(|latest| *latest > fresh)?;
        let instance = &self.network.deployment.instances[consumer.instance];
        let message = format!(
            "the server answers `{}.{}` with values that are up to {} old, and are fresh for {}",
            instance.path,
            slot.name,
            text_of(latest),
            text_of(fresh)
        );
        let warning = Diagnostic::warning("latest-over-fresh", instance.name.span, message);
        Some(
            warning
                .label(provider.span, "answers with its last value")
                .help("shorten `serve latest`, or lengthen `fresh`"),
        )
    }
}
