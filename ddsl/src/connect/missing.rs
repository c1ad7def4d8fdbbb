//! Consumers that see no provider.

use super::Connector;
use crate::endpoint::Endpoint;
use rc_cdsl::model::Role;
use rc_diagnostics::Diagnostic;

impl Connector<'_> {
    /// Reports that `consumer` sees no provider. `hidden` is a provider that no group exports.
    pub(super) fn report_no_provider(
        &mut self,
        consumer: Endpoint,
        interface: &str,
        hidden: Option<Endpoint>,
    ) {
        let (Some(slot), name) = (self.slot(consumer), self.name(consumer)) else {
            return;
        };
        let span = self.instance(consumer).name.span;
        let requires = slot.role == Role::Requires;
        let (needs, offers) = if requires {
            ("requires", "implements")
        } else {
            ("subscribes to", "publishes")
        };
        let message = if slot.optional {
            format!("`{name}` is optional, and no component {offers} `{interface}`")
        } else {
            format!("`{name}` {needs} `{interface}`, but no component {offers} it")
        };
        let diagnostic = match (requires, slot.optional) {
            (true, false) => Diagnostic::error("no-provider", span, message),
            (true, true) => Diagnostic::note("no-provider", span, message),
            (false, false) => Diagnostic::warning("no-publisher", span, message),
            (false, true) => Diagnostic::note("no-publisher", span, message),
        };
        let label = if requires {
            "required here"
        } else {
            "subscribed here"
        };
        let diagnostic = diagnostic.label(slot.span, label);
        let help = hidden.and_then(|end| {
            let slot = self.slot(end)?;
            let group = self.exports.reach(self.deployment, end, &slot.name)?;
            let group = &self.deployment.groups[group];
            // If the name is exported, the export has an error.
            let named = group.exports.iter().any(|e| e.text == slot.name);
            let export = (!named).then(|| group.export_with(&slot.name))?;
            Some(format!(
                "`{}` {} it: {export}",
                self.name(end),
                slot.role.word()
            ))
        });
        let diagnostic = match help {
            Some(help) => diagnostic.help(help),
            None if slot.optional || hidden.is_some() => diagnostic,
            None => diagnostic.help(format!(
                "if a peer outside the network {offers} it, write `external {};`{}",
                self.name_beside(consumer, consumer),
                self.in_group(consumer)
            )),
        };
        self.report(consumer, None, diagnostic);
    }

    /// ` in group …`, the block of a declaration about the slot.
    pub(super) fn in_group(&self, end: Endpoint) -> String {
        let group = self
            .instance(end)
            .group
            .map(|at| &self.deployment.groups[at]);
        group.map_or_else(String::new, |group| format!(" in group `{}`", group.path))
    }
}
