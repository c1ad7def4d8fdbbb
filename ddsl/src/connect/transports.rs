//! Chooses the middleware of each connection, and checks that it carries the connection.
//!
//! A consumer has one middleware for all its connections, so no sample reaches it twice. A provider
//! with `auto` has those of all its consumers.

use super::{Connection, Connector};
use crate::endpoint::Endpoint;
use rc_cdsl::model::Middleware;
use rc_diagnostics::{Diagnostic, Diagnostics};
use std::collections::HashMap;

impl Connector<'_> {
    /// Chooses the middleware of each connection. Removes connections that none carries.
    pub(super) fn choose_transports(&mut self) {
        let connections = std::mem::take(&mut self.connections);
        let mut of: HashMap<Endpoint, Vec<Endpoint>> = HashMap::new();
        for Connection { consumer, provider } in &connections {
            of.entry(*consumer).or_default().push(*provider);
        }
        let of: HashMap<Endpoint, Middleware> = of
            .iter()
            .map(|(consumer, providers)| (*consumer, self.of_consumer(*consumer, providers)))
            .collect();
        for connection in connections {
            let Connection { consumer, provider } = connection;
            let middleware = of[&consumer];
            let mut found = Diagnostics::new();
            if self.agrees(middleware, connection, &mut found)
                & self.compatibility.carries(
                    middleware,
                    self.bind_span(connection),
                    consumer,
                    provider,
                    &mut found,
                )
            {
                self.transports.insert(connection, middleware);
                self.connections.push(connection);
            } else {
                self.conversions.remove(&connection);
            }
            for diagnostic in found {
                self.report(consumer, Some(provider), diagnostic);
            }
        }
    }

    /// The middleware of a consumer: its own, that of a provider which has one, or the fastest that
    /// reaches all providers.
    fn of_consumer(&self, consumer: Endpoint, providers: &[Endpoint]) -> Middleware {
        let compatibility = &self.compatibility;
        let chosen = self.chosen(consumer, providers);
        let chosen = chosen.or_else(|| {
            let mut chosen = providers
                .iter()
                .filter_map(|end| self.chosen(*end, &[consumer]));
            chosen.next()
        });
        let slowest = || {
            let each = providers.iter();
            let each = each.map(|end| compatibility.fastest(consumer, *end));
            each.max_by_key(|middleware| {
                let can = middleware.can();
                (can.joins_machines, can.joins_processes)
            })
        };
        chosen.or_else(slowest).unwrap_or(Middleware::DEFAULT)
    }

    /// The middleware that an end has by its component or the network. One of a program outside, or
    /// with such a peer, chooses none by its connections, which are none at run time.
    fn chosen(&self, end: Endpoint, peers: &[Endpoint]) -> Option<Middleware> {
        let is_outside = |end: &Endpoint| end.instance >= self.count;
        let chosen = self.compatibility.chosen(end);
        chosen.or_else(|| {
            let is_alone = is_outside(&end) || peers.iter().any(is_outside);
            is_alone.then(|| self.instance(end).middleware)
        })
    }

    /// Whether the provider of a connection has the middleware of its consumer, or can have it.
    fn agrees(
        &self,
        middleware: Middleware,
        connection: Connection,
        found: &mut Diagnostics,
    ) -> bool {
        let Connection { consumer, provider } = connection;
        let auto = |end| self.instance(end).auto;
        let theirs = match self.chosen(provider, &[consumer]) {
            Some(theirs) => theirs,
            // Both choose by the places of the other one.
            None if middleware.can().joins_machines
                && self.chosen(consumer, &[provider]).is_none() =>
            {
                auto(provider).unwrap_or(middleware)
            }
            None => return true,
        };
        if theirs == middleware {
            return true;
        }
        let message = format!(
            "`{}` and `{}` use different middleware: `{}` and `{}`",
            self.name(consumer),
            self.name(provider),
            middleware.word(),
            theirs.word()
        );
        let span = self.bind_span(connection);
        let error = Diagnostic::error("middleware-mismatch", span, message);
        let chosen = [(consumer, provider), (provider, consumer)];
        let chosen = chosen.map(|(end, peer)| self.chosen(end, &[peer]));
        found.push(match chosen {
            [None, None] => error.help("name the same middleware after `remote` for both"),
            [None, Some(_)] => error.help("a slot has one middleware for all its connections: give all its providers one, or `middleware auto`"),
            [Some(_), _] => {
                let clause = self.clause(consumer, provider);
                error.help(format!(
                    "give both ends one middleware, or let a process stand between them: `{clause} convert via process; }};`"
                ))
            }
        });
        false
    }
}
