//! Compatibility of the endpoints of a connection: types, middleware and quality of service.

use crate::conversion::Conversion;
use crate::end::End;
use crate::endpoint::{Endpoint, slot};
use crate::meaning::Meanings;
use crate::model::{Deployment, Setting};
use crate::units;
use rc_cdsl::Component;
use rc_cdsl::model::{Middleware, Role};
use rc_diagnostics::{Diagnostic, Diagnostics, Span};
use rc_idsl::canonical::operation_text;
use rc_vocabulary::qos::{self, Contract, Qos};
use rc_vocabulary::{Key, Value};
use std::collections::HashMap;
use std::rc::Rc;

/// Compares endpoints. Caches the canonical texts of each.
pub(crate) struct CompatibilityChecker<'a> {
    deployment: &'a Deployment,
    components: &'a [Option<&'a Component>],
    texts: HashMap<Endpoint, Rc<[String]>>,
    meanings: Meanings,
}

impl<'a> CompatibilityChecker<'a> {
    pub(crate) fn new(deployment: &'a Deployment, components: &'a [Option<&'a Component>]) -> Self {
        Self {
            deployment,
            components,
            texts: HashMap::new(),
            meanings: Meanings::default(),
        }
    }

    fn name(&self, end: Endpoint) -> String {
        let slot = slot(self.components, end).map_or("?", |s| s.name.as_str());
        format!("{}.{slot}", self.deployment.instances[end.instance].path)
    }

    /// The canonical texts of the operations of an endpoint.
    fn texts(&mut self, end: Endpoint) -> Option<Rc<[String]>> {
        if let Some(known) = self.texts.get(&end) {
            return Some(Rc::clone(known));
        }
        let component = self.components.get(end.instance).copied().flatten()?;
        let interface = component.slots.get(end.slot)?.interface;
        let operations = &component.library.interface(interface).operations;
        let texts: Rc<[String]> = operations
            .iter()
            .map(|o| operation_text(&component.library, interface, o))
            .collect();
        self.texts.insert(end, Rc::clone(&texts));
        Some(texts)
    }

    /// Whether two endpoints of one interface have equal types and units. Reports errors at the place
    /// of `line`. Returns what the connection converts, and `None` after an error.
    pub(crate) fn check(
        &mut self,
        line: units::Line<'_>,
        consumer: Endpoint,
        provider: Endpoint,
        found: &mut Diagnostics,
    ) -> Option<Conversion> {
        let span = line.span;
        let types = self.types(span, consumer, provider, found);
        // Units of equal types only: the members of others have no counterparts.
        let units = types.then(|| self.units(line, consumer, provider, found));
        units.flatten()
    }

    /// Whether a middleware carries a connection: it reaches both ends, which are in one domain and
    /// have compatible quality of service. Reports errors at `span`.
    pub(crate) fn carries(
        &self,
        middleware: Middleware,
        span: Span,
        consumer: Endpoint,
        provider: Endpoint,
        found: &mut Diagnostics,
    ) -> bool {
        let reaches = self.reaches(middleware, span, consumer, provider, found);
        self.qos(middleware, span, consumer, provider, found) && reaches
    }

    fn types(
        &mut self,
        span: Span,
        consumer: Endpoint,
        provider: Endpoint,
        found: &mut Diagnostics,
    ) -> bool {
        let (Some(ours), Some(theirs)) = (self.texts(consumer), self.texts(provider)) else {
            return false;
        };
        if ours == theirs {
            return true;
        }
        let mut differing = ours.iter().filter(|t| !theirs.contains(t));
        let mut further = theirs.iter().filter(|t| !ours.contains(t));
        let operation = differing.next().or_else(|| further.next());
        let operation = operation
            .and_then(|t| t.split('(').next())
            .unwrap_or("the order of operations");
        let declared = |end: Endpoint| {
            let component = self.components[end.instance]?;
            let interface = component.slots[end.slot].interface;
            let path = component.library.interface_path(interface);
            Some((path, component.library.interface(interface).name.span))
        };
        if let (Some((path, one)), Some((_, other))) = (declared(consumer), declared(provider)) {
            let message = format!(
                "`{}` and `{}` have different definitions of `{path}`: {operation} differs",
                self.name(consumer),
                self.name(provider)
            );
            let error = Diagnostic::error("type-mismatch", span, message)
                .label(one, "first definition")
                .label(other, "second definition");
            found.push(error);
        }
        false
    }

    fn units(
        &self,
        line: units::Line<'_>,
        consumer: Endpoint,
        provider: Endpoint,
        found: &mut Diagnostics,
    ) -> Option<Conversion> {
        let names = [consumer, provider].map(|end| self.name(end));
        let end = |end: Endpoint, name| {
            let component = self.components.get(end.instance).copied().flatten()?;
            let slot = component.slots.get(end.slot)?;
            Some(End {
                name,
                library: &component.library,
                prototypes: &component.prototypes,
                interface: slot.interface,
                subscribes: slot.role == Role::SubscribesTo,
            })
        };
        let [ours, theirs] = [end(consumer, &names[0]), end(provider, &names[1])];
        units::compare(line, ours?, theirs?, &self.meanings, found)
    }

    /// The middleware that an endpoint has by its component or the network. `None`: its connections
    /// choose it.
    pub(crate) fn chosen(&self, end: Endpoint) -> Option<Middleware> {
        let instance = &self.deployment.instances[end.instance];
        let own = slot(self.components, end).and_then(|slot| slot.backend);
        own.or_else(|| instance.auto.is_none().then_some(instance.middleware))
    }

    /// The fastest middleware that reaches both endpoints if neither has selected one.
    pub(crate) fn fastest(&self, one: Endpoint, other: Endpoint) -> Middleware {
        let instances = &self.deployment.instances;
        self.deployment
            .fastest(&instances[one.instance], &instances[other.instance])
    }

    /// The names of the hosts of two endpoints if they differ.
    fn hosts_apart(&self, one: Endpoint, other: Endpoint) -> Option<(&str, &str)> {
        let [one, other] = [one, other].map(|end| &self.deployment.instances[end.instance]);
        let name = |instance| {
            let host = self.deployment.remote_host(instance);
            host.map_or("localhost", |host| host.name.text.as_str())
        };
        let apart = self.deployment.are_apart(one, other);
        apart.then(|| (name(one), name(other)))
    }

    fn reaches(
        &self,
        here: Middleware,
        span: Span,
        consumer: Endpoint,
        provider: Endpoint,
        found: &mut Diagnostics,
    ) -> bool {
        if !here.can().joins_machines
            && let Some((one, other)) = self.hosts_apart(consumer, provider)
        {
            let message = format!(
                "`{}` and `{}` are on different hosts, `{one}` and `{other}`, but `{}` is limited to one host",
                self.name(consumer),
                self.name(provider),
                here.word()
            );
            let error = Diagnostic::error("shared-memory-across-hosts", span, message);
            found.push(error.help("use `middleware auto` or `dds`, or run both on one host"));
            return false;
        }
        // iceoryx2 has no domains.
        let domain = here.key("domain");
        domain.is_none_or(|key| self.is_same_domain(span, here, key, [consumer, provider], found))
    }

    /// Whether both endpoints are in the same domain, whose key is `key`.
    fn is_same_domain(
        &self,
        span: Span,
        backend: Middleware,
        key: &'static Key,
        ends: [Endpoint; 2],
        found: &mut Diagnostics,
    ) -> bool {
        let set = ends.map(|end| {
            let instance = &self.deployment.instances[end.instance];
            instance.setting(backend, key.name)
        });
        let value = |set: Option<&'a Setting>| match set {
            Some(set) => Some(&set.value),
            None => key.default.as_ref(),
        };
        let values = set.map(value);
        if values[0] == values[1] {
            return true;
        }
        let word = |set: Option<&Setting>| match set {
            Some(set) => set.value.to_string(),
            None => match &key.default {
                Some(default) => format!("the default ({default})"),
                None => "the value of ROS_DOMAIN_ID".to_owned(),
            },
        };
        let [one, other] = set.map(word);
        let names = ends
            .map(|end| format!("`{}`", self.name(end)))
            .join(" and ");
        let message = format!("{names} are in different domains: {one} and {other}");
        let mut error = Diagnostic::error("domain-mismatch", span, message);
        for set in set.into_iter().flatten() {
            error = error.label(set.span, "set here");
        }
        found.push(error);
        false
    }

    /// The quality of service of an operation of an endpoint, and the location of the setting if
    /// the `.ddsl` sets it.
    fn set(
        &self,
        end: Endpoint,
        backend: Middleware,
        operation: &str,
    ) -> Option<(Qos, Option<Span>)> {
        let slot = slot(self.components, end)?;
        let instance = &self.deployment.instances[end.instance];
        let mut qos = slot.whole_qos();
        let set = instance.setting(backend, "qos");
        let Some((Value::Qos(rules), span)) = set.map(|set| (&set.value, set.span)) else {
            return Some((qos, None));
        };
        let policies = qos::policies(rules, &slot.name, operation);
        let is_set = !policies.is_empty();
        policies.into_iter().for_each(|policy| qos.set(policy));
        Some((qos, is_set.then_some(span)))
    }

    fn qos(
        &self,
        middleware: Middleware,
        span: Span,
        consumer: Endpoint,
        provider: Endpoint,
        found: &mut Diagnostics,
    ) -> bool {
        let (Some(one), Some(other)) = (
            slot(self.components, consumer),
            slot(self.components, provider),
        ) else {
            return false;
        };
        let component = self.components[consumer.instance];
        let operations = component.map_or(&[][..], |component| {
            &component.library.interface(one.interface).operations
        });
        // Report a mismatch of all operations once.
        let mut reported = Vec::new();
        for operation in operations {
            let name = operation.name.text.as_str();
            let (Some((requested, asked)), Some((offered_qos, offered))) = (
                self.set(consumer, middleware, name),
                self.set(provider, middleware, name),
            ) else {
                continue;
            };
            for unmet in Contract::from(&offered_qos).differences(&Contract::from(&requested)) {
                if reported.contains(&unmet) {
                    continue;
                }
                let message = format!(
                    "`{}` requests {} {}, but `{}` offers {}",
                    self.name(consumer),
                    unmet.policy,
                    unmet.requested,
                    self.name(provider),
                    unmet.offered
                );
                let error = Diagnostic::error("qos-mismatch", span, message)
                    .label(asked.unwrap_or(one.span), "requested here")
                    .label(offered.unwrap_or(other.span), "offered here");
                found.push(error);
                reported.push(unmet);
            }
        }
        reported.is_empty()
    }
}
