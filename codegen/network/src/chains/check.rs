//! Checks the chains of a network: finds their messages, and reports those that do not exist or may
//! be late.

use super::flow::{Flow, nanoseconds};
use super::report::{self, slow_chain, stale_chain};
use super::search::{self, FoundPaths, Search};
use super::{ASSUMED_TRANSPORT, CheckedChain, Link, OutsideLink, Path, Port, TransportFrom};
use crate::bounds::{self, Arrival, Hop, Rate, Way};
use crate::model::Network;
use rc_cdsl::model::Role;
use rc_ddsl::Endpoint;
use rc_ddsl::model::{Chain, ChainPoint, Late};
use rc_diagnostics::{Diagnostic, Diagnostics};
use std::cell::OnceCell;
use std::collections::BTreeSet;
use std::time::Duration;

/// Finds the chains, and reports those that do not exist or may be late.
pub(crate) fn check(network: &Network, found: &mut Diagnostics) -> Vec<CheckedChain> {
    let all_read = network.projects.iter().all(Option::is_some);
    let projects = network.projects.iter().flatten();
    let mut components = projects.map(|project| &project.component);
    let declares = components.any(|component| component.reactions.is_some());
    let chains = &network.deployment.chains;
    if !all_read || (!declares && chains.is_empty()) {
        return Vec::new();
    }
    check_budgets(network, found);
    let check = ChainCheck {
        network,
        flow: Flow::new(network),
    };
    if check.flow.report_cycles(network, found) {
        return Vec::new();
    }
    check_late_events(network, found);
    let common = OnceCell::new();
    let found_chains = chains.iter().enumerate().filter_map(|(declared, chain)| {
        let outside = check.outside(chain, found)?;
        let path = check.find(chain, &outside, found)?;
        Some(check.bound((declared, chain), path, outside, &common))
    });
    let checked: Vec<CheckedChain> = found_chains.collect();
    for chain in &checked {
        check.report_late(chain, found);
    }
    check.report_loads(&checked, found);
    checked
}

/// Reports budgets that are longer than the period that the configuration sets.
fn check_budgets(network: &Network, found: &mut Diagnostics) {
    for (at, instance) in network.deployment.instances.iter().enumerate() {
        let Some(project) = network.projects[at].as_deref() else {
            continue;
        };
        let component = &project.component;
        let period = network.periods[at];
        if period >= component.period {
            continue;
        }
        let budgets = component.reactions.iter().flatten();
        let too_long = budgets.filter(|r| r.budget.is_some_and(|budget| budget > period));
        for reaction in too_long {
            let message = format!(
                "the budget of `{}` in `{}` is longer than its period of {}",
                reaction.cause,
                component.name.text,
                rc_vocabulary::duration::text_of(period)
            );
            let error = Diagnostic::error("budget-over-period", instance.name.span, message);
            found.push(error.help("lengthen the period in its configuration"));
        }
    }
}

/// Reports events that a chain would fire, and that the state machine does not take.
fn check_late_events(network: &Network, found: &mut Diagnostics) {
    for chain in &network.deployment.chains {
        let Late::Fire(at, event) = &chain.late else {
            continue;
        };
        let project = network.projects[*at].as_deref();
        let machine = project.and_then(|project| project.component.state_machine.as_ref());
        let external = machine.map_or(&[][..], |machine| &machine.external);
        if !external.iter().any(|known| known.text == event.text) {
            let path = &network.deployment.instances[*at].path;
            let message = format!(
                "`{path}` has no event `{}` that may be fired from outside",
                event.text
            );
            let error = Diagnostic::error("bad-chain", event.span, message);
            let known = external.iter().map(|known| known.text.as_str());
            found.push(if external.is_empty() {
                error.help("list it after `external` in the .cdsl of the component")
            } else {
                error.suggest(&event.text, known)
            });
        }
    }
}

/// The components of a network, and their loads.
type Analysis = (Vec<bounds::Component>, Vec<bounds::Load>);

/// A network while its chains are checked.
pub(crate) struct ChainCheck<'n> {
    pub(crate) network: &'n Network,
    pub(crate) flow: Flow,
}

impl ChainCheck<'_> {
    fn find(
        &self,
        chain: &Chain,
        outside: &[OutsideLink],
        found: &mut Diagnostics,
    ) -> Option<Path> {
        let from = self.port(&chain.from, found);
        let to = self.port(&chain.to, found);
        let through = chain.through.iter();
        let through: Option<Vec<(usize, Option<Port>)>> = through
            .map(|point| match point.operation {
                Some(_) => Some((point.instance, Some(self.port(point, found)?))),
                None => Some((point.instance, None)),
            })
            .collect();
        let (from, to, through) = (from?, to?, through?);
        if from == to {
            let message = format!("chain `{}` ends where it begins", chain.name.text);
            let error = Diagnostic::error("empty-chain", chain.to.span, message);
            let error = error.label(chain.from.span, "its beginning");
            found.push(error.help("name another operation after `from` or `to`"));
            return None;
        }
        let outside: Vec<(Port, Port)> = outside.iter().map(|of| (of.from, of.to)).collect();
        let search = Search {
            outside: &outside,
            flow: &self.flow,
            from,
            to,
            through: &through,
        };
        match search.run() {
            FoundPaths::One(path) => Some(path),
            FoundPaths::None(reached) => {
                found.push(self.broken_chain(chain, &reached));
                None
            }
            FoundPaths::Several(paths) => {
                found.push(self.ambiguous_chain(chain, &paths));
                None
            }
            FoundPaths::TooMany => {
                let message = format!("chain `{}` has too many ways to look at", chain.name.text);
                let error = Diagnostic::error("ambiguous-chain", chain.name.span, message);
                found.push(error.help(
                    "name more components in `through`, or say in the `reactions` of components what follows what",
                ));
                None
            }
        }
    }

    /// The operation that a point of a chain names.
    pub(super) fn port(&self, point: &ChainPoint, found: &mut Diagnostics) -> Option<Port> {
        let (slot_name, name) = point.operation.as_ref()?;
        let component = &self.network.projects[point.instance].as_deref()?.component;
        let path = &self.network.deployment.instances[point.instance].path;
        let slots = &component.slots;
        let Some(slot) = slots.iter().position(|slot| slot.name == slot_name.text) else {
            let message = format!("`{path}` has no slot `{}`", slot_name.text);
            let known = slots.iter().map(|slot| slot.name.as_str());
            let error = Diagnostic::error("unknown-slot", slot_name.span, message)
                .label(component.name.span, "its component")
                .suggest(&slot_name.text, known);
            found.push(error);
            return None;
        };
        let interface = component.library.interface(slots[slot].interface);
        let mut operations = interface.operations.iter();
        let operation = operations.position(|operation| operation.name.text == name.text);
        if operation.is_none() {
            let message = format!(
                "`{path}.{}` has no operation `{}`",
                slot_name.text, name.text
            );
            let known = interface.operations.iter().map(|o| o.name.text.as_str());
            let error = Diagnostic::error("unknown-operation", name.span, message)
                .label(interface.name.span, "its interface")
                .suggest(&name.text, known);
            found.push(error);
        }
        Some(Port {
            instance: point.instance,
            slot,
            operation: operation?,
        })
    }

    fn broken_chain(&self, chain: &Chain, reached: &search::Reached) -> Diagnostic {
        let instance = |at: usize| &self.network.deployment.instances[at].path;
        let message = if reached.is_complete {
            format!(
                "chain `{}`: no way passes what `through` names, in this order",
                chain.name.text
            )
        } else {
            format!(
                "chain `{}`: nothing leads from `{}` to `{}`",
                chain.name.text,
                self.network.port_name(reached.from),
                self.network.port_name(reached.to)
            )
        };
        let error = Diagnostic::error("broken-chain", chain.name.span, message);
        if reached.is_complete {
            let spans = chain.through.iter().map(|point| point.span);
            let span = spans.reduce(rc_diagnostics::Span::to);
            let error = match span {
                Some(span) => error.label(span, "these are not on one way"),
                None => error,
            };
            return error.help("name components of one way, or leave `through` out");
        }
        // A message without a receiver: most likely a peer that is optional and absent.
        let loose = reached.loose.first().map(|port| {
            let slot = &self.flow.components[port.instance].slots[port.slot];
            let optional = if slot.optional { "optional slot " } else { "" };
            format!(
                "{optional}`{}` is connected to nothing",
                self.network.port_name(*port)
            )
        });
        let arrives = reached
            .instances
            .iter()
            .map(|at| format!("`{}`", instance(*at)));
        let arrives: Vec<String> = arrives.take(search::LISTED).collect();
        let help = match (loose, arrives.is_empty()) {
            (Some(loose), _) => loose,
            (None, true) => format!("nobody receives `{}`", self.network.port_name(reached.from)),
            (None, false) => format!(
                "its messages get to {}; look at the `reactions` there",
                arrives.join(", ")
            ),
        };
        error.help(help)
    }

    fn ambiguous_chain(&self, chain: &Chain, paths: &[Path]) -> Diagnostic {
        let names = |path: &Path, whole: bool| {
            let links = path.links.iter();
            let links = links.map(|link| {
                if whole {
                    self.network.port_name(link.to)
                } else {
                    self.network.deployment.instances[link.to.instance]
                        .path
                        .clone()
                }
            });
            let mut names: Vec<String> = links.collect();
            if path.sent.is_none() {
                names.pop();
            }
            names.join(", ")
        };
        let short: Vec<String> = paths.iter().map(|path| names(path, false)).collect();
        let differ = short.iter().collect::<BTreeSet<_>>().len() == short.len();
        let all = if differ {
            short
        } else {
            paths.iter().map(|path| names(path, true)).collect()
        };
        // The component at the end is on every way: it alone names the one without others.
        let end = paths.first().and_then(|path| path.links.last());
        let end = end.map_or("", |link| {
            &self.network.deployment.instances[link.to.instance].path
        });
        let message = format!("chain `{}` has several ways", chain.name.text);
        let error = Diagnostic::error("ambiguous-chain", chain.name.span, message);
        let all = all.into_iter().take(search::LISTED);
        let all = all.map(|way| match way.as_str() {
            "" => format!("`through {end};`"),
            way => format!("`through {way};`"),
        });
        error.help(format!(
            "write one of {}",
            all.collect::<Vec<_>>().join(", ")
        ))
    }

    /// The longest time of a message between two components. A chain may declare that of its own
    /// messages.
    pub(crate) fn transport(&self, chain: Option<&Chain>, from: Option<usize>, to: Port) -> u64 {
        nanoseconds(self.known_transport(chain, from, to).0)
    }

    /// The longest time of a message between two components, and where it is from.
    fn known_transport(
        &self,
        chain: Option<&Chain>,
        from: Option<usize>,
        to: Port,
    ) -> (Duration, TransportFrom) {
        if let Some(declared) = chain.and_then(|chain| chain.transport) {
            return (declared, TransportFrom::Declared);
        }
        let [hosts, network, memory] = ASSUMED_TRANSPORT;
        let instances = &self.network.deployment.instances;
        let own = &instances[to.instance];
        let slot = self.network.projects[to.instance]
            .as_deref()
            .map(|project| &project.component.slots[to.slot]);
        let middleware = slot.and_then(|slot| slot.backend).unwrap_or(own.middleware);
        let apart =
            from.is_some_and(|from| self.network.deployment.are_apart(&instances[from], own));
        let is_here = !apart && self.network.deployment.remote_host(own).is_none();
        let mut measured = self.network.transports.iter().filter(|_| is_here);
        if let Some((_, time)) = measured.find(|(of, _)| *of == middleware) {
            return (*time, TransportFrom::Measured);
        }
        let assumed = if apart {
            hosts
        } else if middleware.can().joins_machines {
            network
        } else {
            memory
        };
        (assumed, TransportFrom::Assumed)
    }

    /// The longest time of the message of a link. A chain that begins where a message is received may
    /// begin with that of any sender.
    fn of_link(&self, chain: &Chain, outside: &[OutsideLink], link: &Link) -> u64 {
        if let Some(outside) = outside.iter().find(|of| of.is(link)) {
            return outside.within;
        }
        if let Some(from) = link.from {
            return self.transport(Some(chain), Some(from.instance), link.to);
        }
        let senders = self.flow.senders(link.to).iter();
        let all = senders.map(|sender| Some(sender.instance)).chain([None]);
        let all = all.map(|from| self.transport(Some(chain), from, link.to));
        all.max().unwrap_or_default()
    }

    /// The longest time of a message, after its own way, until those come with which it is collected:
    /// they may be sent later, and be longer on their way.
    fn collected(&self, chain: &Chain, outside: &[OutsideLink], link: &Link) -> u64 {
        let own = self.of_link(chain, outside, link);
        let waits = self.flow.collected(link.to).map(|(ports, within)| {
            let others = ports.iter().filter(|port| **port != link.to);
            let ways = others.flat_map(|port| {
                let senders = self.flow.senders(*port).iter();
                senders.map(|sender| self.transport(None, Some(sender.instance), *port))
            });
            let longest = ways.max().unwrap_or(0);
            within.saturating_add(longest.saturating_sub(own))
        });
        waits.max().unwrap_or(0)
    }

    /// The components as the analysis knows them. A declared transport holds for a chain alone.
    fn analysed(
        &self,
        chain: &Chain,
        path: &Path,
        outside: &[OutsideLink],
    ) -> Vec<bounds::Component> {
        let all = self.flow.components.iter().enumerate();
        let all = all.map(|(at, component)| {
            let handlers = component.handlers.iter().map(|port| {
                let senders = self.flow.senders(*port).iter();
                let mut arrivals: Vec<Arrival> = senders
                    .flat_map(|sender| {
                        let is_on = path.links.iter().any(|link| {
                            link.to == *port && link.from.is_none_or(|from| from == *sender)
                        });
                        let declared = is_on.then_some(chain);
                        let transport = self.transport(declared, Some(sender.instance), *port);
                        self.flow
                            .rates(*sender)
                            .into_iter()
                            .map(move |rate| Arrival { rate, transport })
                    })
                    .collect();
                // Programs outside send as often as they receive.
                let outside: Vec<&OutsideLink> =
                    outside.iter().filter(|of| of.to == *port).collect();
                for of in &outside {
                    let rates = self.flow.rates(of.from).into_iter();
                    let transport = of.within;
                    arrivals.extend(rates.map(|rate| Arrival { rate, transport }));
                }
                if self.flow.is_external(*port) && outside.is_empty() {
                    arrivals.push(Arrival {
                        rate: Rate::Unknown,
                        transport: 0,
                    });
                }
                bounds::Handler {
                    budget: self.flow.budget(*port).0,
                    depth: component.slots[port.slot].depth,
                    arrivals,
                }
            });
            bounds::Component {
                period: nanoseconds(self.network.periods[at]),
                compute: self.flow.compute_budget(at).0,
                handlers: handlers.collect(),
            }
        });
        all.collect()
    }

    fn bound(
        &self,
        (declared, chain): (usize, &Chain),
        path: Path,
        outside: Vec<OutsideLink>,
        common: &OnceCell<Analysis>,
    ) -> CheckedChain {
        let analyse = || {
            let components = self.analysed(chain, &path, &outside);
            let loads = bounds::loads(&components);
            (components, loads)
        };
        // Chains that declare no times of messages have one analysis.
        let own;
        let (components, loads) = if chain.transport.is_none() && outside.is_empty() {
            common.get_or_init(analyse)
        } else {
            own = analyse();
            &own
        };
        let hops = |oldest: bool| -> Vec<Hop> {
            let links = path.links.iter().zip(1..);
            links
                .map(|(link, next)| {
                    // The output of a later period is older than that of the handler.
                    let is_last = next == path.links.len() && path.sent.is_none();
                    let way = if oldest && !is_last && self.flow.has_compute_way(link.to) {
                        Way::Compute
                    } else {
                        link.way
                    };
                    Hop {
                        component: link.to.instance,
                        handler: self.flow.handler(link.to),
                        way,
                        transport: self.of_link(chain, &outside, link),
                        collected: self.collected(chain, &outside, link),
                    }
                })
                .collect()
        };
        let first = path.links.first();
        let gap = first.and_then(|link| {
            let senders = match link.from {
                Some(from) => vec![from],
                None if self.flow.is_external(link.to) => Vec::new(),
                None => self.flow.senders(link.to).to_vec(),
            };
            let rates = senders
                .into_iter()
                .flat_map(|sender| self.flow.rates(sender));
            let gaps = rates.filter_map(|rate| bounds::gap(rate, components, loads));
            gaps.min()
        });
        let transports = path.links.iter().map(|link| {
            if outside.iter().any(|of| of.is(link)) {
                return TransportFrom::Declared;
            }
            let from = link.from.map(|from| from.instance);
            self.known_transport(Some(chain), from, link.to).1
        });
        let transports = transports.collect();
        let costs = bounds::costs(&hops(false), components, loads);
        let oldest = bounds::age(&hops(true), gap, components, loads);
        let mut assumed: Vec<usize> = Vec::new();
        for link in &path.links {
            let at = link.to.instance;
            // All work of a component may precede a message.
            let mut handlers = self.flow.components[at].handlers.iter();
            let is_assumed = self.flow.compute_budget(at).1
                || handlers.any(|port| self.flow.is_reached(*port) && self.flow.budget(*port).1);
            if is_assumed && !assumed.contains(&at) {
                assumed.push(at);
            }
        }
        let instances = path.links.iter().map(|link| link.to.instance);
        let overloaded = instances.filter(|at| loads[*at].is_overloaded);
        let short = path.links.iter().filter_map(|link| {
            let port = link.to;
            let end = Endpoint {
                instance: port.instance,
                slot: port.slot,
            };
            // Requests are never replaced by newer ones.
            self.network
                .slot(end)
                .filter(|slot| slot.role == Role::SubscribesTo)?;
            let waiting = loads[port.instance].waiting(self.flow.handler(port))?;
            let depth = self.flow.components[port.instance].slots[port.slot].depth;
            (waiting > u64::from(depth)).then_some((port, waiting))
        });
        CheckedChain {
            overloaded: overloaded.collect(),
            short: short.collect(),
            declared,
            costs,
            oldest: oldest.map(Duration::from_nanos),
            assumed,
            path,
            outside,
            transports,
        }
    }

    /// Reports a chain that may be late, with the causes.
    fn report_late(&self, checked: &CheckedChain, found: &mut Diagnostics) {
        let chain = &self.network.deployment.chains[checked.declared];
        if let (Some(limit), Some(costs)) = (chain.within, &checked.costs) {
            let transport = costs.iter().map(|cost| cost.transport).sum();
            let transport = Duration::from_nanos(transport);
            if transport > limit && chain.transport.is_some() {
                let message = format!(
                    "chain `{}` cannot be in time: its messages may need {} on their way, and `within` is {}",
                    chain.name.text,
                    report::time(transport),
                    report::time(limit)
                );
                let error = Diagnostic::error("impossible-chain", chain.name.span, message);
                found.push(error.help("lengthen `within`, or shorten `transport`"));
                return;
            }
        }
        if chain.within.is_none() && chain.age.is_none() {
            return;
        }
        if checked.costs.is_none() {
            found.push(self.unbounded_chain(checked));
            return;
        }
        found.extend(slow_chain(self.network, checked));
        found.extend(stale_chain(self.network, checked));
    }

    /// Reports components on chains that cannot keep up, each once.
    fn report_loads(&self, checked: &[CheckedChain], found: &mut Diagnostics) {
        let overloaded = checked.iter().flat_map(|chain| &chain.overloaded);
        for at in overloaded.collect::<BTreeSet<_>>() {
            let instance = &self.network.deployment.instances[*at];
            let message = format!("`{}` may get more work than it has time", instance.path);
            let warning = Diagnostic::warning("overloaded-component", instance.name.span, message);
            found.push(
                warning.help("shorten its budgets, send to it less often, or lengthen its period"),
            );
        }
        let short = checked.iter().flat_map(|chain| &chain.short);
        for (port, waiting) in short.collect::<BTreeSet<_>>() {
            let depth = self.flow.components[port.instance].slots[port.slot].depth;
            let message = format!(
                "{waiting} messages may wait for `{}`, which keeps {depth}: the others are lost",
                self.network.port_name(*port)
            );
            let span = self.network.deployment.instances[port.instance].name.span;
            let warning = Diagnostic::warning("short-queue", span, message);
            found.push(warning.help(format!("write `depth {waiting};` at its slot")));
        }
    }

    fn unbounded_chain(&self, checked: &CheckedChain) -> Diagnostic {
        let chain = &self.network.deployment.chains[checked.declared];
        let names = checked.path.links.iter().map(|link| {
            format!(
                "`{}`",
                self.network.deployment.instances[link.to.instance].path
            )
        });
        let message = format!(
            "chain `{}` has no worst case: a component on it computes without end",
            chain.name.text
        );
        Diagnostic::warning("slow-chain", chain.name.span, message).help(format!(
            "one of {} needs its whole period for `compute`: shorten its budget, or lengthen its period",
            names.collect::<Vec<_>>().join(", ")
        ))
    }
}
