//! `rcdeploy list` and `show`: what runs in a network, and of which types it is.

use super::networks::network_of;
use super::output::{Failure, print_note, show as print};
use rc_deploy_client::Format;
use rc_diagnostics::foreign::{clean, clean_to};
use rc_management::component::Status;
use rc_observe::{Component, End, Error, Network, nearest_of};
use rc_values::{Interface, Member, Named, Operation, Struct, Type};
use rc_vocabulary::qos::{Durability, Reliability};
use serde::Serialize;
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::time::{Duration, Instant};

/// Over which time rates are measured.
const WINDOW: Duration = Duration::from_secs(1);

impl From<Error> for Failure {
    fn from(error: Error) -> Self {
        Self(if error.is_input() { 1 } else { 3 }, error.to_string())
    }
}

/// Looks at a network; components that do not describe themselves are named.
pub(super) fn look(network: &str) -> Result<Network, Failure> {
    let network = Network::look(&network_of(network)?)?;
    for reason in &network.silent {
        print_note(reason);
    }
    Ok(network)
}

#[derive(Serialize)]
struct Listing {
    network: String,
    topics: Vec<ListedTopic>,
    services: Vec<ListedService>,
}

#[derive(Serialize)]
struct ListedTopic {
    name: String,
    address: String,
    middleware: String,
    interface: String,
    operation: String,
    #[serde(rename = "type_hash")]
    hash: String,
    publishers: Vec<ListedEnd>,
    subscribers: Vec<ListedEnd>,
}

#[derive(Serialize)]
struct ListedService {
    address: String,
    middleware: String,
    interface: String,
    operations: Vec<String>,
    servers: Vec<ListedEnd>,
    clients: Vec<ListedEnd>,
}

/// An end with the rate of all messages of its slot.
#[derive(Serialize)]
struct ListedEnd {
    component: String,
    slot: String,
    #[serde(skip_serializing_if = "Option::is_none")]
    host: Option<String>,
    middlewares: Vec<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    rate_hz: Option<f64>,
}

/// The messages that each slot has sent and handled.
fn counts(network: &Network) -> BTreeMap<(String, String), u64> {
    let slots = |component: &Component| {
        let Status { name, slots, .. } = component.status.clone();
        slots
            .into_iter()
            .map(move |slot| ((name.clone(), slot.name), slot.sent + slot.handlers.count))
    };
    network.components.iter().flat_map(slots).collect()
}

/// A running network, and the rates of its slots in Hz, by component and slot.
pub(super) fn measured(
    network: &str,
) -> Result<(Network, BTreeMap<(String, String), f64>), Failure> {
    let first = look(network)?;
    let begin = Instant::now();
    std::thread::sleep(WINDOW);
    let second = Network::look(&first.name)?;
    let seconds = begin.elapsed().as_secs_f64();
    let before = counts(&first);
    let rates = counts(&second).into_iter().filter_map(|(key, after)| {
        let sent = after.saturating_sub(*before.get(&key)?);
        Some((key, (sent as f64 / seconds * 10.0).round() / 10.0))
    });
    Ok((second, rates.collect()))
}

/// `rcdeploy list`.
pub(super) fn list(network: &str, format: Format) -> Result<u8, Failure> {
    let (second, rates) = measured(network)?;
    let ends = |ends: Vec<End>| -> Vec<ListedEnd> {
        let listed = ends.into_iter().map(|end| {
            let key = (end.component.clone(), end.slot.clone());
            ListedEnd {
                rate_hz: rates.get(&key).copied(),
                component: end.component,
                slot: end.slot,
                host: end.host,
                middlewares: end.middlewares,
            }
        });
        listed.collect()
    };
    let topics = second.topics().into_iter().map(|topic| ListedTopic {
        name: topic.name(),
        address: topic.address,
        middleware: topic.middleware,
        interface: topic.interface.name.clone(),
        hash: format!("{:016x}", topic.operation.hash),
        operation: topic.operation.name,
        publishers: ends(topic.publishers),
        subscribers: ends(topic.subscribers),
    });
    let services = second.services().into_iter().map(|service| ListedService {
        address: service.address,
        middleware: service.middleware,
        interface: service.interface.name.clone(),
        operations: service
            .interface
            .operations
            .iter()
            .map(|operation| operation.name.clone())
            .collect(),
        servers: ends(service.servers),
        clients: ends(service.clients),
    });
    let listing = Listing {
        network: second.name.clone(),
        topics: topics.collect(),
        services: services.collect(),
    };
    print(format, &listing, table)
}

fn table(listing: &Listing) -> String {
    let mut out = String::new();
    let end = |middleware: &str, end: &ListedEnd| {
        // All the same: the line of the address has it.
        let over = match end.middlewares.as_slice() {
            [only] if only == middleware => String::new(),
            several => format!("  over {}", clean(&several.join(", "))),
        };
        let host = end.host.as_ref();
        let host = host.map_or(String::new(), |host| format!(" on {}", clean(host)));
        let rate = end
            .rate_hz
            .map_or(String::new(), |rate| format!("  {rate} Hz"));
        format!(
            "{}.{}{host}{rate}{over}",
            clean(&end.component),
            clean(&end.slot)
        )
    };
    let ends = |out: &mut String, over: &str, verb: &str, ends: &[ListedEnd]| {
        for (at, one) in ends.iter().enumerate() {
            let verb = if at == 0 { verb } else { "" };
            let _ = writeln!(out, "    {verb:<14}{}", end(over, one));
        }
    };
    let _ = writeln!(out, "topics");
    for topic in &listing.topics {
        let (address, middleware) = (clean(&topic.address), clean(&topic.middleware));
        let _ = writeln!(out, "  {address}  {middleware}");
        ends(
            &mut out,
            &topic.middleware,
            "published by",
            &topic.publishers,
        );
        ends(
            &mut out,
            &topic.middleware,
            "received by",
            &topic.subscribers,
        );
    }
    let _ = writeln!(out, "services");
    for service in &listing.services {
        let (address, middleware) = (clean(&service.address), clean(&service.middleware));
        let _ = writeln!(out, "  {address}  {middleware}");
        ends(&mut out, &service.middleware, "served by", &service.servers);
        ends(&mut out, &service.middleware, "called by", &service.clients);
        let _ = writeln!(
            out,
            "    {:<14}{}",
            "operations",
            clean_to(&service.operations.join(", "), usize::MAX)
        );
    }
    out
}

/// Subject of `show`.
enum ShowTarget<'n> {
    Named(&'n str, &'n Type),
    Interface(&'n Interface),
    Slot(&'n Component, usize),
    Operation(&'n Operation, String),
}

impl ShowTarget<'_> {
    fn name(&self) -> String {
        match self {
            Self::Named(name, _) => (*name).to_owned(),
            Self::Interface(interface) => interface.name.clone(),
            Self::Slot(component, at) => {
                format!("{}.{}", component.name, component.described.slots[*at].name)
            }
            Self::Operation(_, name) => name.clone(),
        }
    }
}

/// The names that `show` knows.
pub(super) fn names(network: &Network) -> Vec<String> {
    shown(network).iter().map(ShowTarget::name).collect()
}

fn shown(network: &Network) -> Vec<ShowTarget<'_>> {
    let mut all = Vec::new();
    let mut known = std::collections::BTreeSet::new();
    for component in &network.components {
        for (name, ty) in component.catalog.types() {
            if known.insert(name.to_owned()) {
                all.push(ShowTarget::Named(name, ty));
            }
        }
        for interface in component.catalog.interfaces() {
            if known.insert(interface.name.clone()) {
                all.push(ShowTarget::Interface(interface));
            }
        }
        for (at, slot) in component.described.slots.iter().enumerate() {
            all.push(ShowTarget::Slot(component, at));
            let interface = component.catalog.interface(&slot.interface);
            for operation in interface.iter().flat_map(|of| &of.operations) {
                let name = format!("{}.{}.{}", component.name, slot.name, operation.name);
                all.push(ShowTarget::Operation(operation, name));
            }
        }
    }
    all
}

/// `rcdeploy show`.
pub(super) fn show(network: &str, wanted: &str, format: Format) -> Result<u8, Failure> {
    let network = look(network)?;
    let all = shown(&network);
    // `RoboCompLaser::TData` ends with `TData`, `simulator.Laser` with `Laser`.
    let plain = |name: &str| name.replace("::", ".");
    let ends = |name: &str| {
        let (name, wanted) = (plain(name), plain(wanted));
        name == wanted || name.ends_with(&format!(".{wanted}"))
    };
    let exact = |item: &&ShowTarget<'_>| plain(&item.name()) == plain(wanted);
    let mut found: Vec<&ShowTarget<'_>> = all.iter().filter(exact).collect();
    if found.is_empty() {
        found = all.iter().filter(|item| ends(&item.name())).collect();
        // An operation of many slots is that of its interface.
        let wider = |item: &&ShowTarget<'_>| !matches!(item, ShowTarget::Operation(..));
        if found.iter().any(wider) {
            found.retain(wider);
        }
    }
    let item = match found.as_slice() {
        [one] => one,
        [] => {
            let names: Vec<String> = all.iter().map(|item| plain(&item.name())).collect();
            return Err(Error::Unknown {
                network: network.name.clone(),
                what: "type, interface or slot",
                name: clean(wanted),
                help: nearest_of(&plain(wanted), names.iter()),
            }
            .into());
        }
        many => one_of(many).ok_or_else(|| {
            let found = many
                .iter()
                .map(|item| format!("`{}`", item.name()))
                .collect();
            let name = clean(wanted);
            Error::Ambiguous { name, found }
        })?,
    };
    let document = document(item);
    print(format, &document, |_| text(item))
}

/// Picks one of several items of a name: an interface, or the operation that all of them are.
fn one_of<'s, 'n>(many: &[&'s ShowTarget<'n>]) -> Option<&'s ShowTarget<'n>> {
    let interface = many
        .iter()
        .find(|item| matches!(item, ShowTarget::Interface(_)));
    let first = many.first()?;
    let ShowTarget::Operation(operation, _) = first else {
        return interface.copied();
    };
    let is_same = |item: &&ShowTarget<'_>| matches!(item, ShowTarget::Operation(other, _) if other.hash == operation.hash);
    many.iter().all(is_same).then_some(*first)
}

fn members(of: &Struct) -> Vec<Value> {
    let member = |member: &Member| {
        let mut object = json!({"name": member.name, "type": member.ty.to_string()});
        if member.optional {
            object["optional"] = json!(true);
        }
        if let Some(unit) = &member.unit {
            object["unit"] = json!(unit);
        }
        if let Some(range) = member.range {
            let limit = |end: Option<rc_values::Number>| end.and_then(rc_values::limit_json);
            object["range"] = json!([limit(range.min), limit(range.max)]);
        }
        if let Some(default) = &member.default {
            object["default"] = json!(default);
        }
        object
    };
    of.members.iter().map(member).collect()
}

fn document(item: &ShowTarget<'_>) -> Value {
    let operation = |operation: &Operation| {
        json!({
            "name": operation.name,
            "pattern": operation.pattern.word(),
            "hash": format!("{:016x}", operation.hash),
            "request": members(&operation.request),
            "reply": members(&operation.reply),
            "throws": operation.throws.iter().map(|e| e.ty.name.clone()).collect::<Vec<_>>(),
        })
    };
    match item {
        ShowTarget::Named(name, ty) => match ty {
            Type::Named(Named::Struct(of)) => {
                json!({"name": name, "kind": "struct", "members": members(of)})
            }
            Type::Named(Named::Enum(of)) => {
                json!({"name": name, "kind": "enum", "values": of.values})
            }
            other @ (Type::Primitive(_)
            | Type::Text { .. }
            | Type::Sequence { .. }
            | Type::Array { .. }
            | Type::Dictionary { .. }) => {
                json!({"name": name, "kind": "alias", "type": other.to_string()})
            }
        },
        ShowTarget::Interface(interface) => json!({
            "name": interface.name,
            "kind": "interface",
            "operations": interface.operations.iter().map(operation).collect::<Vec<_>>(),
        }),
        ShowTarget::Slot(component, at) => {
            let mut object = json!(component.described.slots[*at]);
            object["kind"] = json!("slot");
            object["component"] = json!(component.name);
            if let Some(status) = component.status.slots.get(*at) {
                object["peers"] = json!(status.peers);
            }
            object
        }
        ShowTarget::Operation(of, name) => {
            let mut object = operation(of);
            object["kind"] = json!("operation");
            object["name"] = json!(name);
            object
        }
    }
}

fn member_lines(of: &Struct, out: &mut String) {
    for member in &of.members {
        let optional = if member.optional { "?" } else { "" };
        let mut notes = Vec::new();
        notes.extend(
            member
                .unit
                .as_ref()
                .map(|unit| format!("in {}", clean(unit))),
        );
        notes.extend(member.range.map(|range| range.to_string()));
        let default = member.default.as_ref();
        notes.extend(default.map(|default| {
            let text = default
                .as_str()
                .map_or_else(|| default.to_string(), str::to_owned);
            format!("default {}", clean(&text))
        }));
        let notes = if notes.is_empty() {
            String::new()
        } else {
            format!("  ({})", notes.join(", "))
        };
        let (name, ty) = (clean(&member.name), &member.ty);
        let _ = writeln!(out, "    {name}{optional}: {ty}{notes}");
    }
}

fn operation_lines(operation: &Operation, out: &mut String) {
    let _ = writeln!(
        out,
        "  {} {}",
        operation.pattern.word(),
        clean(&operation.name)
    );
    member_lines(&operation.request, out);
    if !operation.reply.members.is_empty() {
        let _ = writeln!(out, "  replies");
        member_lines(&operation.reply, out);
    }
    for exception in &operation.throws {
        let _ = writeln!(out, "  throws {}", clean(&exception.ty.name));
    }
}

fn text(item: &ShowTarget<'_>) -> String {
    let mut out = String::new();
    match item {
        ShowTarget::Named(name, Type::Named(Named::Struct(of))) => {
            let _ = writeln!(out, "struct {}", clean(name));
            member_lines(of, &mut out);
        }
        ShowTarget::Named(name, Type::Named(Named::Enum(of))) => {
            let _ = writeln!(out, "enum {}", clean(name));
            for (name, number) in &of.values {
                let _ = writeln!(out, "    {} = {number}", clean(name));
            }
        }
        ShowTarget::Named(name, other) => {
            let _ = writeln!(out, "{} is {other}", clean(name));
        }
        ShowTarget::Interface(interface) => {
            let _ = writeln!(out, "interface {}", clean(&interface.name));
            for operation in &interface.operations {
                operation_lines(operation, &mut out);
            }
        }
        ShowTarget::Slot(component, at) => {
            let slot = &component.described.slots[*at];
            let _ = writeln!(
                out,
                "slot {}.{} {} {}",
                component.name,
                slot.name,
                slot.role.word(),
                slot.interface
            );
            let address = slot.address.as_deref().unwrap_or("not open yet");
            let _ = writeln!(out, "    middleware: {}", slot.middleware);
            let _ = writeln!(out, "    address: {address}");
            let _ = writeln!(out, "    types: {}", slot.hash);
            if let Some(status) = component.status.slots.get(*at) {
                let _ = writeln!(out, "    peers: {}", status.peers);
            }
            for operation in &slot.operations {
                let qos = &operation.qos;
                let reliable = match qos.reliability {
                    Reliability::Reliable => "reliable",
                    Reliability::BestEffort => "best effort",
                };
                let kept = match qos.durability {
                    Durability::TransientLocal => ", transient local",
                    Durability::Volatile => "",
                };
                let (name, depth) = (clean(&operation.name), qos.depth);
                let external = operation.external_type.as_ref();
                let external = external.map_or(String::new(), |ty| format!(", {ty}"));
                let _ = writeln!(out, "    {name}: {reliable}{kept}, depth {depth}{external}");
            }
        }
        ShowTarget::Operation(operation, name) => {
            let _ = writeln!(out, "operation {}", clean(name));
            operation_lines(operation, &mut out);
        }
    }
    out
}
