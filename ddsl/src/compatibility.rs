//! Whether two ends of one interface can talk.

use crate::connect::{Endpoint, slot};
use crate::model::{Deployment, Host, Setting};
use rc_cdsl::Component;
use rc_cdsl::model::{Backend, Qos, Role};
use rc_diagnostics::{Diagnostic, Diagnostics, Span, duration_text};
use rc_idsl::canonical::operation_text;
use rc_settings::Key;
use rc_settings::qos::{self, Policy};
use std::collections::HashMap;
use std::rc::Rc;
use std::time::Duration;

/// Compares ends; each is spelled out once, however many others it is compared with.
pub(crate) struct CompatibilityChecker<'a> {
    deployment: &'a Deployment,
    components: &'a [Option<&'a Component>],
    texts: HashMap<Endpoint, Rc<[String]>>,
}

impl<'a> CompatibilityChecker<'a> {
    pub(crate) fn new(deployment: &'a Deployment, components: &'a [Option<&'a Component>]) -> Self {
        Self {
            deployment,
            components,
            texts: HashMap::new(),
        }
    }

    fn name(&self, end: Endpoint) -> String {
        let slot = slot(self.components, end).map_or("?", |s| s.name.as_str());
        format!("{}.{slot}", self.deployment.instances[end.instance].path)
    }

    /// The canonical texts of the operations of an end.
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

    /// Whether two ends of one interface have the same types, the same middleware and a quality of service that
    /// goes together; what is wrong is reported at `span`.
    pub(crate) fn check(
        &mut self,
        span: Span,
        consumer: Endpoint,
        provider: Endpoint,
        found: &mut Diagnostics,
    ) -> bool {
        let types = self.types(span, consumer, provider, found);
        let middleware = self.middleware(span, consumer, provider, found);
        self.qos(span, consumer, provider, found) && types && middleware
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
                "`{}` and `{}` have different definitions of {path}: {operation} differs",
                self.name(consumer),
                self.name(provider)
            );
            let error = Diagnostic::error("type-mismatch", span, message)
                .label(one, "one definition")
                .label(other, "the other one");
            found.push(error);
        }
        false
    }

    /// The names of the machines of two ends, where these are not the same.
    fn hosts_apart(&self, one: Endpoint, other: Endpoint) -> Option<(&str, &str)> {
        let host = |end: Endpoint| {
            let instance = &self.deployment.instances[end.instance];
            self.deployment.remote_host(instance)
        };
        let (one, other) = (host(one), host(other));
        let same = match (one, other) {
            (Some(one), Some(other)) => one.is_same(other),
            (one, other) => one.is_none() && other.is_none(),
        };
        let name = |host: Option<&'a Host>| host.map_or("localhost", |host| &host.name.text);
        (!same).then(|| (name(one), name(other)))
    }

    fn middleware(
        &self,
        span: Span,
        consumer: Endpoint,
        provider: Endpoint,
        found: &mut Diagnostics,
    ) -> bool {
        let chosen = |end: Endpoint| {
            let own = slot(self.components, end).and_then(|s| s.backend);
            own.unwrap_or(self.deployment.instances[end.instance].middleware)
        };
        let (here, there) = (chosen(consumer), chosen(provider));
        let ends = format!("`{}` and `{}`", self.name(consumer), self.name(provider));
        if here != there {
            let message = format!(
                "{ends} use different middleware: {} and {}",
                here.word(),
                there.word()
            );
            found.push(Diagnostic::error("middleware-mismatch", span, message));
            return false;
        }
        if here == Backend::Iceoryx2
            && let Some((one, other)) = self.hosts_apart(consumer, provider)
        {
            let message = format!(
                "{ends} are on different machines, {one} and {other}, and {} is shared memory of one",
                here.word()
            );
            let error = Diagnostic::error("shared-memory-across-hosts", span, message);
            found.push(error.help("use `middleware dds`, or let both run on one host"));
            return false;
        }
        let is_call = slot(self.components, consumer).is_some_and(|s| s.role == Role::Requires);
        // Shared memory knows no domains, and topics no mapping of services.
        ["domain", "service_mapping"]
            .iter()
            .filter(|name| is_call || **name == "domain")
            .filter_map(|name| rc_settings::key(here.word(), name))
            .all(|key| self.is_set_alike(span, here, key, [consumer, provider], found))
    }

    /// Whether a setting that both ends have to share is the same at both.
    fn is_set_alike(
        &self,
        span: Span,
        backend: Backend,
        key: &Key,
        ends: [Endpoint; 2],
        found: &mut Diagnostics,
    ) -> bool {
        let set = ends.map(|end| {
            let instance = &self.deployment.instances[end.instance];
            instance.setting(backend, key.name)
        });
        let value = |set: Option<&Setting>| {
            let value = set.and_then(|set| set.values.first().cloned());
            value.or(key.default.map(str::to_owned))
        };
        let values = set.map(value);
        if values[0] == values[1] {
            return true;
        }
        let word = |set: Option<&Setting>| match set {
            Some(_) => value(set).unwrap_or_default(),
            None => match key.default {
                Some(default) => format!("the default ({default})"),
                None => "what ROS_DOMAIN_ID says".to_owned(),
            },
        };
        let [one, other] = set.map(word);
        let names = ends
            .map(|end| format!("`{}`", self.name(end)))
            .join(" and ");
        let mut error = if key.name == "domain" {
            let message = format!("{names} are in different domains: {one} and {other}");
            Diagnostic::error("domain-mismatch", span, message)
        } else {
            let message =
                format!("{names} tell requests apart in different ways: {one} and {other}");
            Diagnostic::error("service-mapping-mismatch", span, message)
        };
        for set in set.into_iter().flatten() {
            error = error.label(set.span, "set here");
        }
        found.push(error);
        false
    }

    /// The quality of service of an operation of an end, and where it was set, if not in the `.cdsl`.
    fn set(&self, end: Endpoint, operation: &str) -> Option<(Qos, Option<Span>)> {
        let slot = slot(self.components, end)?;
        let instance = &self.deployment.instances[end.instance];
        let backend = slot.backend.unwrap_or(instance.middleware);
        let mut qos = slot.qos.clone();
        let Some(rules) = instance.setting(backend, "qos") else {
            return Some((qos, None));
        };
        let policies = qos::policies(&rules.values, &slot.name, operation);
        let is_set = !policies.is_empty();
        let time = |nanoseconds: Option<u64>| nanoseconds.map(Duration::from_nanos);
        for policy in policies {
            match policy {
                Policy::Reliable(yes) => qos.reliable = Some(yes),
                Policy::TransientLocal(yes) => qos.transient_local = Some(yes),
                Policy::Depth(depth) => qos.depth = Some(depth),
                Policy::Deadline(limit) => qos.deadline = time(limit),
                Policy::Lifespan(limit) => qos.lifespan = time(limit),
                Policy::Liveliness(limit) => qos.liveliness = time(limit),
            }
        }
        Some((qos, is_set.then_some(rules.span)))
    }

    fn qos(
        &self,
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
        // What holds for all operations is told once.
        let mut told = Vec::new();
        for operation in operations {
            let name = operation.name.text.as_str();
            let (Some((asks, asked)), Some((offers, offered))) =
                (self.set(consumer, name), self.set(provider, name))
            else {
                continue;
            };
            for lack in lacking(&asks, &offers) {
                if told.contains(&lack) {
                    continue;
                }
                let (setting, wanted, given) = &lack;
                let message = format!(
                    "`{}` asks for {setting} {wanted}, `{}` offers {given}",
                    self.name(consumer),
                    self.name(provider)
                );
                let error = Diagnostic::error("qos-mismatch", span, message)
                    .label(asked.unwrap_or(one.span), "asked here")
                    .label(offered.unwrap_or(other.span), "offered here");
                found.push(error);
                told.push(lack);
            }
        }
        told.is_empty()
    }
}

/// What one end asks for, and the other does not offer: the setting, what is asked, what is offered.
fn lacking(asks: &Qos, offers: &Qos) -> Vec<(&'static str, String, String)> {
    let mut lacking = Vec::new();
    let mut lacks = |setting, asked: &str, offered: &str| {
        lacking.push((setting, asked.to_owned(), offered.to_owned()));
    };
    // What is not said is reliable of who publishes, and volatile.
    if asks.reliable == Some(true) && offers.reliable == Some(false) {
        lacks("reliability", "reliable", "best_effort");
    }
    if asks.transient_local == Some(true) && offers.transient_local != Some(true) {
        lacks("durability", "transient_local", "volatile");
    }
    let text = |time: Duration| duration_text(time.as_nanos() as u64);
    for (setting, asked, offered) in [
        ("deadline", asks.deadline, offers.deadline),
        ("liveliness", asks.liveliness, offers.liveliness),
    ] {
        let Some(asked) = asked else { continue };
        if offered.is_none_or(|offered| offered > asked) {
            let offered = offered.map_or("none".to_owned(), text);
            lacks(setting, &text(asked), &offered);
        }
    }
    lacking
}
