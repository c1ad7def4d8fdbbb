//! The connections of a network.

use crate::conversion::Conversion;
use crate::endpoint::Endpoint;
use rc_cdsl::model::Middleware;
use rc_diagnostics::Diagnostic;
use rc_syntax::Name;
use std::collections::{BTreeMap, BTreeSet};

/// A connection between a consumer and a provider.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Connection {
    /// The endpoint that requires or subscribes.
    pub consumer: Endpoint,
    /// The endpoint that implements or publishes.
    pub provider: Endpoint,
}

/// A diagnostic about a slot or a connection. Drawings of networks show it there.
#[derive(Clone, Debug)]
pub struct ConnectionDiagnostic {
    /// The slot. The consumer of a connection.
    pub endpoint: Endpoint,
    /// The other end of a connection.
    pub peer: Option<Endpoint>,
    /// The diagnostic. [`connect`](super::connect()) returns it, too.
    pub diagnostic: Diagnostic,
}

/// The connections of a network.
#[derive(Clone, Debug, Default)]
pub struct Network {
    /// Pairs of consumer and provider. A subscriber of several publishers has several connections.
    pub connections: Vec<Connection>,
    /// The conversions of consumers of connections with `convert;`. If the other end is a program
    /// outside the network, its index is after the last instance.
    pub conversions: BTreeMap<Connection, Conversion>,
    /// The middleware of each connection.
    pub transports: BTreeMap<Connection, Middleware>,
    /// The middlewares of each end of these connections.
    pub(crate) over: BTreeMap<Endpoint, BTreeSet<Middleware>>,
    /// The external slots, each with the address that its declaration names: consumers, and the slots
    /// of adaptors with which programs outside are connected.
    pub externals: BTreeMap<Endpoint, Option<Name>>,
    /// For each instance, the instances that must be ready before it: those of required slots that
    /// are not optional.
    pub required: Vec<BTreeSet<usize>>,
    /// Diagnostics about slots and connections. [`Network::connections`] omits connections with errors.
    pub diagnostics: Vec<ConnectionDiagnostic>,
}

impl Network {
    /// The conversion of a consumer: all its connections have one plan.
    pub fn conversion(&self, consumer: Endpoint) -> Option<&Conversion> {
        let mut own = self.conversions.iter();
        own.find(|(made, _)| made.consumer == consumer)
            .map(|(_, conversion)| conversion)
    }

    /// The middlewares over which an endpoint has connections, each once: one of a consumer, and
    /// those of all its consumers of a provider. Empty without connections.
    pub fn middlewares(&self, end: Endpoint) -> Vec<Middleware> {
        self.over.get(&end).into_iter().flatten().copied().collect()
    }
}
