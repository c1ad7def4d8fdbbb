//! Finds the ways of a chain through a network.

use super::flow::{Direction, Flow};
use super::{Link, Path, Port};
use crate::bounds::Way;
use std::collections::BTreeSet;

/// How many paths, or components, a message lists.
pub(super) const LISTED: usize = 6;
/// The most ways that are looked for: `through` may choose among more than are listed.
const FOUND: usize = 200;
/// The most steps of a search. A network with more ways has several.
const STEPS: usize = 20_000;

/// State of a search.
pub(super) struct Search<'a> {
    pub(super) flow: &'a Flow,
    pub(super) from: Port,
    pub(super) to: Port,
    /// Messages that programs outside of the network send, each after the one that they receive.
    pub(super) outside: &'a [(Port, Port)],
    /// The components that a way passes in this order, maybe with the message there.
    pub(super) through: &'a [(usize, Option<Port>)],
}

/// The ways that there are.
pub(super) enum FoundPaths {
    None(Reached),
    One(Path),
    Several(Vec<Path>),
    /// More than are looked at.
    TooMany,
}

/// How far messages get.
#[derive(Debug)]
pub(super) struct Reached {
    pub(super) from: Port,
    pub(super) to: Port,
    /// Whether they get to the end, by ways that `through` excludes.
    pub(super) is_complete: bool,
    /// The components that receive them.
    pub(super) instances: Vec<usize>,
    /// Topics that are published without a subscriber.
    pub(super) loose: Vec<Port>,
}

/// A way that is being followed.
struct State {
    links: Vec<Link>,
    steps: usize,
    found: Vec<Path>,
}

impl Search<'_> {
    pub(super) fn run(&self) -> FoundPaths {
        let useful = self.leading_to_end();
        let mut state = State {
            links: Vec::new(),
            steps: 0,
            found: Vec::new(),
        };
        for (from, to) in self.first() {
            self.follow(from, to, &useful, &mut state);
        }
        let mut found = state.found;
        // `through` names all components of a way, or some of them.
        let is_exact = |path: &Path| {
            let ends = usize::from(path.sent.is_none());
            let mut between = path.links.iter().rev().skip(ends);
            between.all(|link| self.through.iter().any(|(at, _)| *at == link.to.instance))
        };
        if !self.through.is_empty() && found.iter().filter(|path| is_exact(path)).count() == 1 {
            found.retain(is_exact);
        }
        match found.len() {
            0 | 1 if state.steps >= STEPS => FoundPaths::TooMany,
            0 => FoundPaths::None(self.reached()),
            1 => FoundPaths::One(found.remove(0)),
            _ => FoundPaths::Several(found),
        }
    }

    /// The first messages: sender and receiver.
    fn first(&self) -> Vec<(Option<Port>, Port)> {
        match self.flow.direction(self.from) {
            Direction::In => vec![(None, self.from)],
            Direction::Out => {
                let receivers = self.receivers(self.from);
                receivers.map(|to| (Some(self.from), to)).collect()
            }
        }
    }

    /// The receivers of a message, and those of what programs outside send for it.
    fn receivers(&self, from: Port) -> impl Iterator<Item = Port> {
        let outside = self.outside.iter().filter(move |(sent, _)| *sent == from);
        let own = self.flow.receivers(from).iter().copied();
        own.chain(outside.map(|(_, to)| *to))
    }

    /// The receiving ports from which messages lead to the end.
    fn leading_to_end(&self) -> BTreeSet<Port> {
        let mut useful = BTreeSet::new();
        let mut left: Vec<Port> = match self.flow.direction(self.to) {
            Direction::In => vec![self.to],
            Direction::Out => self.causes(self.to),
        };
        while let Some(port) = left.pop() {
            if useful.insert(port) {
                let outside = self.outside.iter().filter(|(_, to)| *to == port);
                let senders = self.flow.senders(port).iter();
                let senders = senders.chain(outside.map(|(from, _)| from));
                left.extend(senders.flat_map(|sender| self.causes(*sender)));
            }
        }
        useful
    }

    /// The receiving ports of a component after which it sends a message.
    fn causes(&self, sent: Port) -> Vec<Port> {
        let handlers = self.flow.components[sent.instance].handlers.iter();
        let causes = handlers.filter(|port| {
            let effects = self.flow.effects(**port);
            effects.iter().any(|(effect, _)| *effect == sent)
        });
        causes.copied().collect()
    }

    fn follow(&self, from: Option<Port>, to: Port, useful: &BTreeSet<Port>, state: &mut State) {
        let is_enough = state.found.len() >= FOUND || state.steps >= STEPS;
        if is_enough || !useful.contains(&to) {
            return;
        }
        state.steps += 1;
        let link = |way: Way| Link { from, to, way };
        if to == self.to {
            state.links.push(link(Way::Handler));
            self.arrive(None, state);
            state.links.pop();
            return;
        }
        let passed = state.links.iter().any(|l| l.to.instance == to.instance);
        // A path that comes back to the sender of its first message is another chain, unless it
        // ends there.
        let is_back = self.flow.direction(self.from) == Direction::Out
            && to.instance == self.from.instance
            && self.to.instance != self.from.instance;
        if passed || is_back {
            return;
        }
        for (sent, way) in self.flow.effects(to) {
            state.links.push(link(way));
            if sent == self.to {
                self.arrive(Some(sent), state);
            } else {
                for next in self.receivers(sent) {
                    self.follow(Some(sent), next, useful, state);
                }
            }
            state.links.pop();
        }
    }

    /// Notes a path that has reached its end, if it passes what it must.
    fn arrive(&self, sent: Option<Port>, state: &mut State) {
        let mut wanted = self.through.iter().peekable();
        for link in &state.links {
            // Several points may name one component: its messages, in and out.
            while let Some((instance, port)) = wanted.peek() {
                let is_here = *instance == link.to.instance;
                let fits = port.is_none_or(|port| {
                    port == link.to || Self::is_sent_by(port, link, sent, &state.links)
                });
                if !is_here || !fits {
                    break;
                }
                wanted.next();
            }
        }
        if wanted.peek().is_none() {
            state.found.push(Path {
                links: state.links.clone(),
                sent,
            });
        }
    }

    /// Whether the receiver of a link sends this message on.
    fn is_sent_by(port: Port, link: &Link, sent: Option<Port>, links: &[Link]) -> bool {
        port.instance == link.to.instance
            && (sent == Some(port) || links.iter().any(|next| next.from == Some(port)))
    }

    /// How far messages get from the beginning.
    fn reached(&self) -> Reached {
        let (mut seen, mut sent) = (BTreeSet::new(), BTreeSet::new());
        let mut loose = Vec::new();
        let mut left: Vec<Port> = self.first().into_iter().map(|(_, to)| to).collect();
        while let Some(port) = left.pop() {
            if !seen.insert(port) {
                continue;
            }
            for (effect, _) in self.flow.effects(port) {
                if !sent.insert(effect) {
                    continue;
                }
                let known = left.len();
                left.extend(self.receivers(effect));
                if left.len() == known {
                    loose.push(effect);
                }
            }
        }
        if self.flow.direction(self.from) == Direction::Out
            && self.receivers(self.from).next().is_none()
        {
            loose.push(self.from);
        }
        let instances: BTreeSet<usize> = seen.iter().map(|port| port.instance).collect();
        Reached {
            from: self.from,
            to: self.to,
            is_complete: seen.contains(&self.to) || sent.contains(&self.to),
            instances: instances.into_iter().collect(),
            loose,
        }
    }
}
