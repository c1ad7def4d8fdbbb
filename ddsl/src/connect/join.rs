//! Connects two endpoints of one interface, and compares what the connections of a slot convert.

use super::{Connection, Connector};
use crate::endpoint::Endpoint;
use crate::units::Line;
use rc_cdsl::model::Role;
use rc_diagnostics::{Diagnostic, Diagnostics, Span};
use rc_syntax::Name;
use std::collections::HashMap;

impl Connector<'_> {
    /// Connects two endpoints of one interface if they are compatible. Reports errors if not.
    /// `convert` is the location of `convert;`, with the slots that know where frames are.
    pub(crate) fn join(
        &mut self,
        span: Span,
        (convert, frames): (Option<Span>, &[Name]),
        consumer: Endpoint,
        provider: Endpoint,
    ) {
        if let Some(frames) = frames.first()
            && let Some(slot) = self.slot(consumer)
            && slot.role != Role::SubscribesTo
        {
            let message = format!(
                "`{}` calls, and only samples change their frame",
                self.name(consumer)
            );
            let error = Diagnostic::error("wrong-frames", frames.span, message)
                .label(slot.span, "declared here")
                .help("ask the tree in the component");
            self.report(consumer, Some(provider), error);
            return;
        }
        let mut found = Diagnostics::new();
        let text = self.clause(consumer, provider);
        let line = Line {
            span,
            text: &text,
            convert,
            frames: frames.first().map(|slot| slot.span),
            bridges: self.bridges(consumer),
        };
        let agreed = self
            .compatibility
            .check(line, consumer, provider, &mut found);
        for diagnostic in found {
            self.report(consumer, Some(provider), diagnostic);
        }
        if let Some(mut conversion) = agreed {
            let connection = Connection { consumer, provider };
            if !frames.is_empty() && conversion.needs_frames() {
                let names: Vec<&str> = frames.iter().map(|slot| slot.text.as_str()).collect();
                conversion.tree = Some(names.join(","));
                self.trees.push((connection, frames.to_vec()));
            }
            if !conversion.plan.is_empty() {
                self.conversions.insert(connection, conversion);
            }
            self.connections.push(connection);
        }
    }

    /// Whether this is a slot of an adaptor between two middlewares.
    fn bridges(&self, end: Endpoint) -> bool {
        let component = self.components[end.instance];
        let is_adaptor = self.instance(end).adaptor.is_some();
        match component.map(|component| component.slots.as_slice()) {
            Some([one, other, ..]) if is_adaptor => one.backend != other.backend,
            _ => false,
        }
    }

    /// `bind a.Laser -> b.Laser {`, as written in the block of the consumer. For a program outside,
    /// `external a.Laser { cdsl "lidar.cdsl";`.
    pub(super) fn clause(&self, consumer: Endpoint, provider: Endpoint) -> String {
        let outside = |end: &Endpoint| end.instance >= self.count;
        let (own, peer) = if outside(&consumer) {
            (provider, consumer)
        } else {
            (consumer, provider)
        };
        let own = self.name_beside(own, own);
        match &self.instance(peer).cdsl {
            Some(file) if outside(&peer) => format!("external {own} {{ cdsl \"{}\";", file.text),
            _ => format!("bind {own} -> {} {{", self.name_beside(consumer, provider)),
        }
    }

    /// Refuses subscribers whose publishers need different conversions: a slot has one plan for all
    /// samples.
    pub(super) fn check_conversions(&mut self) {
        let mut first: HashMap<Endpoint, Connection> = HashMap::new();
        for at in 0..self.connections.len() {
            let connection = self.connections[at];
            let one = *first.entry(connection.consumer).or_insert(connection);
            let plan = |connection| self.conversions.get(connection).map(|c| (&c.plan, &c.tree));
            if plan(&one) == plan(&connection) {
                continue;
            }
            let message = format!(
                "`{}` receives other units from `{}` than from `{}`: a slot converts all its samples in the same way",
                self.name(connection.consumer),
                self.name(connection.provider),
                self.name(one.provider)
            );
            let span = self.bind_span(connection);
            let error = Diagnostic::error("different-conversions", span, message)
                .label(self.bind_span(one), "the other publisher")
                .help("subscribe with two slots, or let both publishers have the same units");
            self.report(connection.consumer, Some(connection.provider), error);
        }
    }

    /// The location of the bind of a connection, or of its consumer.
    pub(super) fn bind_span(&self, connection: Connection) -> Span {
        let mut made = self.bound_by.iter();
        let made = made.find(|(own, _)| *own == connection);
        made.map_or_else(
            || self.instance(connection.consumer).name.span,
            |(_, span)| *span,
        )
    }
}
