//! Names and types of Rust for the slots of a component.

use super::exports::{self, trait_name};
use super::{freshness, names, qos, shapes};
use crate::view;
use rc_vocabulary::{Middleware, Role};
use serde::Serialize;
use std::collections::BTreeSet;

/// One slot.
#[derive(Debug, Serialize)]
pub(crate) struct Slot<'a> {
    name: &'a str,
    constant: String,
    /// The field of the context.
    field: String,
    /// The type of the field; empty where the context has none.
    ty: String,
    /// The trait of its handlers in the generated crate.
    pub(super) type_name: String,
    /// `Implements`, `Requires`, `Publishes`, `SubscribesTo`.
    role: &'static str,
    role_word: &'static str,
    pub(super) receives: bool,
    pub(super) sends: bool,
    pub(super) is_array: bool,
    optional: bool,
    /// The trait of its handlers in the crate `interfaces`.
    handler: String,
    /// The trait that serves it, with its path and its arguments.
    #[serde(skip)]
    pub(super) serving: String,
    /// The type that distinguishes it from an earlier slot with the same trait.
    pub(super) marker: String,
    /// How the generated crate imports the trait of its handlers; empty if it does not receive.
    import: String,
    /// Its entry in the table of the worker.
    #[serde(skip)]
    pub(super) entry: String,
    /// How the context opens it, and counts its peers; empty if it does not.
    open: String,
    peers: String,
    interface: &'a str,
    /// The module of the interface below `interfaces`.
    pub(super) module: String,
    /// The expression that describes it to the runtime.
    description: String,
    types: String,
    external_types: &'a [String],
}

impl Slot<'_> {
    /// The trait that serves it, without its path: `ServeLaser`.
    pub(super) fn serving_trait(&self) -> String {
        serving_trait(self.role, &self.handler)
    }

    /// The parameters of the trait of its handlers where that is implemented.
    pub(super) fn generics(&self) -> String {
        match self.marker.as_str() {
            "" => "<Context>".to_owned(),
            marker => format!("<Context, {marker}>"),
        }
    }
}

/// All slots, in the order of the text.
pub(super) fn all(view: &view::Component) -> Vec<Slot<'_>> {
    let slots = view.slots.iter().enumerate();
    let mut slots: Vec<Slot> = slots.map(|(index, slot)| one(view, index, slot)).collect();
    mark(&mut slots);
    for (slot, of) in slots.iter_mut().zip(&view.slots) {
        slot.entry = entry(view, of, slot);
    }
    slots
}

fn serving_trait(role: &str, handler: &str) -> String {
    let begin = if role == "Implements" {
        "Serve"
    } else {
        "Receive"
    };
    format!("{begin}{handler}")
}

/// Gives a slot a type of its own if an earlier one has the same trait.
fn mark(slots: &mut [Slot]) {
    let mut taken = BTreeSet::new();
    for slot in slots.iter_mut().filter(|slot| slot.receives) {
        let path = format!("{}::{}", slot.module, slot.handler);
        if !taken.insert(path) {
            slot.marker = format!("{}Slot", slot.type_name.trim_end_matches('_'));
        }
        let serving = serving_trait(slot.role, &slot.handler);
        let arguments = match slot.marker.as_str() {
            "" => "<Context>".to_owned(),
            marker => format!("<Context, crate::slots::{marker}>"),
        };
        slot.serving = format!("interfaces::{}::{serving}{arguments}", slot.module);
    }
}

/// The entry of a slot in the table of the worker.
fn entry(view: &view::Component, of: &view::Slot, slot: &Slot) -> String {
    if let Some(world) = view.world.as_ref().filter(|_| of.of_world)
        && of.role == Role::SubscribesTo
    {
        let field = names::snake(&world.name);
        let function = match of.interface.as_str() {
            "WorldStream" => "receive_stream",
            _ => "receive_state",
        };
        return format!(
            "SlotEntry::receives(|_, ctx, topic, reader| ctx.{field}.{function}(topic, reader))"
        );
    }
    if !slot.receives {
        return "SlotEntry::sends()".to_owned();
    }
    let (constructor, function) = match (of.role, of.is_array) {
        (Role::Implements, false) => ("serves", "serve"),
        (Role::Implements, true) => ("serves_members", "serve"),
        (_, false) => ("receives", "receive"),
        (_, true) => ("receives_members", "receive"),
    };
    let mut entry = format!(
        "SlotEntry::{constructor}(<W as {}>::{function})",
        slot.serving
    );
    if !of.available.is_empty() {
        let states = view.machine.iter().flat_map(|machine| &machine.states);
        let states = states.filter(|state| of.available.contains(&state.name));
        let states: Vec<String> = states.map(|state| state.number.to_string()).collect();
        entry.push_str(&format!(".in_states(&[{}])", states.join(", ")));
    }
    entry
}

fn one<'a>(view: &'a view::Component, index: usize, slot: &'a view::Slot) -> Slot<'a> {
    let module = exports::interface_module(view, &slot.module, &slot.interface);
    let interface = view.interface(slot);
    let in_place = interface.is_some_and(|i| slot.in_place && shapes::is_in_place(i, slot.role));
    let handler = interface.map(|i| shapes::trait_name(i, in_place, slot.is_array));
    let handler = handler.unwrap_or_default();
    let type_name = trait_name(view, &slot.name);
    let end = end(view, slot, &module);
    let (mut open, mut peers) = context(slot, index, &end);
    let kept = freshness::ty(view, slot);
    if !kept.is_empty() {
        let of = if slot.keeps_newest() {
            "FreshSlot"
        } else {
            "LatestSlot"
        };
        open = format!("crate::freshness::{kept}(rc_runtime::{of}::new(&core, {index}))");
    }
    if let Some(world) = view.world.as_ref().filter(|_| slot.of_world)
        && slot.role == Role::Publishes
    {
        let field = names::snake(&world.name);
        peers = format!("peers[{index}] = self.{field}.subscribers()");
    }
    let shout = names::shout(&slot.name);
    let types = format!("TYPES_{shout}");
    let description = if slot.of_world {
        description_of_world(view, index, &module, &types)
    } else {
        description(slot, &module, &types)
    };
    Slot {
        name: &slot.name,
        constant: format!("SLOT_{shout}"),
        field: names::snake(&slot.name),
        ty: match (slot.is_array, slot.sends) {
            (true, true) => format!("SlotArray<{end}>"),
            (true, false) => "SlotArray<()>".to_owned(),
            (false, true) => end,
            (false, false) => match freshness::ty(view, slot).as_str() {
                "" => String::new(),
                ty => format!("crate::freshness::{ty}"),
            },
        },
        role: variant(slot.role),
        role_word: slot.role.word(),
        receives: slot.receives,
        sends: slot.sends,
        is_array: slot.is_array,
        optional: slot.optional,
        import: if !slot.receives {
            String::new()
        } else if handler == type_name {
            format!("{module}::{handler}")
        } else {
            format!("{module}::{handler} as {type_name}")
        },
        type_name,
        handler,
        serving: String::new(),
        marker: String::new(),
        entry: String::new(),
        open,
        peers,
        interface: &slot.interface,
        module,
        description,
        types,
        external_types: &slot.external_types,
    }
}

fn variant(role: Role) -> &'static str {
    match role {
        Role::Implements => "Implements",
        Role::Requires => "Requires",
        Role::Publishes => "Publishes",
        Role::SubscribesTo => "SubscribesTo",
    }
}

/// The expression that describes a slot: `types` is the constant with the names of its types.
fn description(slot: &view::Slot, module: &str, types: &str) -> String {
    let default = match slot.role {
        Role::Implements | Role::Requires => "CALL",
        Role::Publishes => "PUBLISHER",
        Role::SubscribesTo => "SUBSCRIBER",
    };
    let policies = slot.qos.0.iter().map(qos::field);
    let policies: Vec<String> = policies
        .map(|field| format!("        {field},\n"))
        .collect();
    let qos = match policies.concat().as_str() {
        "" => format!("Qos::{default}"),
        policies => format!("Qos {{\n{policies}        ..Qos::{default}\n    }}"),
    };
    let fields = [
        ("name", format!("{:?}", slot.name)),
        ("role", format!("Role::{}", variant(slot.role))),
        ("interface", format!("{:?}", slot.interface)),
        (
            "type_name",
            format!("\"{}::{}\"", slot.module, slot.interface),
        ),
        ("type_hash", format!("0x{}", slot.type_hash)),
        ("backend", backend(slot.middleware)),
        ("qos", qos),
        ("is_array", slot.is_array.to_string()),
        ("operations", format!("interfaces::{module}::OPERATIONS")),
        ("external_types", format!("backend::{types}")),
    ];
    let fields = fields.map(|(name, value)| format!("    {name}: {value},\n"));
    format!("Slot {{\n{}}}", fields.concat())
}

/// The expression that describes a slot of a world, which the library knows.
fn description_of_world(view: &view::Component, index: usize, module: &str, types: &str) -> String {
    let slot = &view.slots[index];
    let number = view.slots[..index]
        .iter()
        .filter(|slot| slot.of_world)
        .count();
    format!(
        "rc_world_typed::slot({number}, {:?}, 0x{}, {}, interfaces::{module}::OPERATIONS, backend::{types})",
        slot.name,
        slot.type_hash,
        backend(slot.middleware),
    )
}

/// The expression for the middleware of a slot.
fn backend(middleware: Option<Middleware>) -> String {
    middleware.map(Middleware::word).map_or_else(
        || "backend::MIDDLEWARE".to_owned(),
        |word| format!("{word:?}"),
    )
}

/// The type of the client or the publisher of a slot.
fn end(view: &view::Component, slot: &view::Slot, module: &str) -> String {
    if slot.asynchronous {
        let client = exports::async_name(view, &slot.name, "AsyncClient");
        return format!("crate::asynchronous::{client}");
    }
    let kind = if slot.role == Role::Publishes {
        "Publisher"
    } else {
        "Client"
    };
    format!(
        "interfaces::{module}::{}{kind}",
        names::camel(&slot.interface)
    )
}

/// How the context opens a slot, and how it counts the peers of one that sends.
fn context(slot: &view::Slot, index: usize, end: &str) -> (String, String) {
    let field = names::snake(&slot.name);
    let calls = slot.role == Role::Requires;
    let open = match (slot.is_array, slot.sends) {
        (true, true) if calls => {
            format!("ports.array({index}, |ports, slot| Ok({end}::new(ports.client(slot)?)))")
        }
        (true, true) => {
            format!("ports.array({index}, |ports, slot| {end}::new(ports.publishers(slot)))")
        }
        (true, false) => format!("ports.array({index}, |_, _| Ok(()))"),
        (false, true) if calls => format!("{end}::new(ports.client({index})?)"),
        (false, true) => format!("{end}::new(ports.publishers({index}))?"),
        (false, false) => String::new(),
    };
    let count = if calls { "is_connected" } else { "subscribers" };
    let peers = match (slot.is_array, slot.sends) {
        (_, false) => String::new(),
        (true, true) if calls => {
            format!("self.{field}.count_peers(peers, |client| usize::from(client.is_connected()))")
        }
        (true, true) => format!("self.{field}.count_peers(peers, {end}::{count})"),
        (false, true) if calls => format!("peers[{index}] = usize::from(self.{field}.{count}())"),
        (false, true) => format!("peers[{index}] = self.{field}.{count}()"),
    };
    (open, peers)
}
