//! The description of a component, as its generated package hands it over: JSON.
//!
//! The runtime keeps descriptions forever, as those of components in Rust. A process has one
//! component, so they are leaked once.

use rc_machine::Chart;
use rc_middleware::Qos;
use rc_middleware::typed::{self, ReplyVariant};
use rc_runtime::{Collect, Linked, Role};
use rc_values::description::Module;
use rc_values::{Catalog, Pattern, Struct};
use rc_vocabulary::qos::Policies;
use serde::Deserialize;
use std::sync::Arc;
use std::time::Duration;

use crate::backends;
use crate::error::HostError;
use crate::replies;

/// The JSON text.
#[derive(Deserialize)]
struct Text {
    name: String,
    model: String,
    middleware: String,
    /// Further middlewares over which a network may connect its slots.
    #[serde(default)]
    further_middlewares: Vec<String>,
    period_ns: u64,
    #[serde(default)]
    parameters: Option<serde_json::Value>,
    #[serde(default)]
    managed: bool,
    #[serde(default)]
    simulates_time: bool,
    #[serde(default)]
    window: bool,
    types: Vec<Module>,
    slots: Vec<SlotText>,
    /// Definitions of the messages and services that are not part of ROS 2 itself.
    #[serde(default)]
    ros_types: Vec<String>,
    #[serde(default)]
    collects: Vec<CollectText>,
    #[serde(default)]
    machine: Option<Machine>,
}

#[derive(Deserialize)]
struct SlotText {
    name: String,
    role: Role,
    #[serde(default)]
    is_array: bool,
    #[serde(default)]
    asynchronous: bool,
    interface: String,
    type_name: String,
    type_hash: String,
    middleware: String,
    #[serde(default)]
    qos: Policies,
    operations: Vec<OperationText>,
    #[serde(default)]
    external_types: Vec<String>,
    #[serde(default)]
    available: Option<Vec<u16>>,
}

#[derive(Deserialize)]
struct OperationText {
    name: String,
    #[serde(default)]
    handler: String,
    #[serde(default)]
    in_place: bool,
}

#[derive(Deserialize)]
struct CollectText {
    name: String,
    handler: String,
    topics: Vec<(usize, usize)>,
    within_ns: u64,
}

/// The state machine of a component.
#[derive(Deserialize)]
pub struct Machine {
    /// The tables.
    pub chart: Chart,
    /// The events that may be fired from outside.
    pub external: Vec<u16>,
    /// The event that follows the start of the machine.
    #[serde(default)]
    pub first_event: Option<u16>,
    /// The event of each period, and the state in which it is fired.
    #[serde(default)]
    pub period_event: Option<u16>,
    /// The state of the event of each period.
    #[serde(default)]
    pub period_state: Option<u16>,
    /// The suffix of `entry_`, `exit_` and `during_`, by the number of the state.
    pub states: Vec<String>,
    /// The functions of guards, by their numbers.
    pub guards: Vec<String>,
    /// The functions of actions, by their numbers.
    pub actions: Vec<String>,
}

/// A component: its description for the runtime, and what another language needs in addition.
pub struct Program {
    /// For the runtime.
    pub description: &'static rc_runtime::Description,
    /// Whether the worker is a window.
    pub window: bool,
    /// The slots, by their numbers.
    pub slots: Vec<Slot>,
    /// Its collections of samples.
    pub collects: &'static [Collect],
    /// The names of the functions that get what was collected, in the same order.
    pub collected: Vec<String>,
    /// The state machine.
    pub machine: Option<&'static Machine>,
}

/// A slot.
pub struct Slot {
    /// Its role.
    pub role: Role,
    /// Whether the worker opens its members.
    pub is_array: bool,
    /// Whether queries can be started, and end later.
    pub asynchronous: bool,
    /// The operations, in the order of the IDSL.
    pub operations: Vec<Operation>,
    /// The states in which requests are served; `None` for all.
    pub available: Option<Vec<u16>>,
}

/// An operation of a slot.
pub struct Operation {
    /// The name of the IDSL.
    pub name: String,
    /// `Module::Interface.operation`: the key of its type for replies of several parts.
    pub answer: String,
    /// For calls.
    pub wire: typed::Operation,
    /// The parameters of a request or of a sample.
    pub request: Arc<Struct>,
    /// Structure of a reply: the `out` parameters, then the result.
    pub reply: Arc<Struct>,
    /// Whether the last member of the reply is the result; the others are `out` parameters.
    pub has_result: bool,
    /// The exceptions.
    pub throws: Vec<rc_values::Exception>,
    /// The name of the worker's function.
    pub handler: String,
    /// Whether the handler of a sample gets a view.
    pub in_place: bool,
}

impl Program {
    /// Reads a description, JSON.
    ///
    /// # Errors
    /// The part that is wrong.
    pub fn read(json: &str) -> Result<Self, String> {
        let text: Text = serde_json::from_str(json)
            .map_err(|error| format!("the description of the component: {error}"))?;
        let catalog = Catalog::new(&text.types).map_err(|error| error.to_string())?;
        let slots = text.slots.iter().map(|slot| read_slot(&catalog, slot));
        let slots: Vec<Slot> = slots.collect::<Result<_, _>>()?;
        backends::add_ros_types(text.ros_types);
        let described: Vec<rc_runtime::Slot> = std::iter::zip(&text.slots, &slots)
            .map(|(text, slot)| describe_slot(text, slot))
            .collect::<Result<_, _>>()?;
        let words = std::iter::once(&text.middleware)
            .chain(&text.further_middlewares)
            .chain(text.slots.iter().map(|slot| &slot.middleware));
        let mut linked: Vec<Linked> = Vec::new();
        for word in words {
            let backend = backends::find(word)?;
            if linked.iter().all(|other| other.name != backend.name) {
                linked.push(backend);
            }
        }
        let types: Vec<&'static str> = text.types.iter().map(|m| leak_text(m.text())).collect();
        let parameters = text.parameters.map(|schema| leak_text(schema.to_string()));
        let description = rc_runtime::Description {
            name: leak_text(text.name),
            model_hash: hash(&text.model)?,
            middleware: backends::find(&text.middleware)?.name,
            period: Duration::from_nanos(text.period_ns),
            parameters,
            folder: "",
            slots: described.leak(),
            types: types.leak(),
            backends: linked.leak(),
            simulates_time: text.simulates_time,
            managed: text.managed,
            converter: Some(&rc_runtime::CONVERTER),
            note: &[],
        };
        let collects = text.collects.iter().map(|of| read_collect(&slots, of));
        let collects: Vec<Collect> = collects.collect::<Result<_, _>>()?;
        Ok(Self {
            description: Box::leak(Box::new(description)),
            collected: text.collects.into_iter().map(|of| of.handler).collect(),
            collects: collects.leak(),
            window: text.window,
            slots,
            machine: text.machine.map(|machine| &*Box::leak(Box::new(machine))),
        })
    }

    /// The component in this folder, whose `etc/config.toml` is the default configuration.
    #[must_use]
    pub fn in_folder(self, folder: String) -> Self {
        let description = rc_runtime::Description {
            folder: leak_text(folder),
            ..*self.description
        };
        Self {
            description: Box::leak(Box::new(description)),
            ..self
        }
    }

    /// A slot array by its number.
    ///
    /// # Errors
    /// There is no such array.
    pub fn array(&self, slot: usize) -> Result<&Slot, HostError> {
        let array = self.slots.get(slot).filter(|slot| slot.is_array);
        array.ok_or_else(|| HostError::no_such("array", slot))
    }

    /// An operation by the index of its slot and its own. The generated layer has no others.
    pub fn operation(&self, slot: usize, operation: usize) -> Option<&Operation> {
        self.slots.get(slot)?.operations.get(operation)
    }
}

fn read_collect(slots: &[Slot], of: &CollectText) -> Result<Collect, String> {
    for (slot, operation) in &of.topics {
        let topic = slots.get(*slot).filter(|of| of.role == Role::SubscribesTo);
        if topic.is_none_or(|slot| *operation >= slot.operations.len()) {
            let name = &of.name;
            return Err(format!(
                "the description of collection `{name}`: there is no topic ({slot}, {operation})"
            ));
        }
    }
    Ok(Collect {
        name: leak_text(of.name.clone()),
        topics: of.topics.clone().leak(),
        within: Duration::from_nanos(of.within_ns),
    })
}

fn read_slot(catalog: &Catalog, slot: &SlotText) -> Result<Slot, String> {
    let wrong = |what: &str| format!("the description of slot `{}`: {what}", slot.name);
    let interface = catalog
        .interface(&slot.type_name)
        .ok_or_else(|| wrong(&format!("there is no interface `{}`", slot.type_name)))?;
    if interface.operations.len() != slot.operations.len() {
        return Err(wrong("it does not have the operations of its interface"));
    }
    let pairs = std::iter::zip(&interface.operations, &slot.operations);
    let operations = pairs.map(|(known, text)| {
        if known.name != text.name {
            let (ours, theirs) = (&text.name, &known.name);
            return Err(wrong(&format!("`{ours}` stands where `{theirs}` belongs")));
        }
        let wire = typed::Operation {
            name: leak_text(known.name.clone()),
            id: known.id,
            type_hash: known.hash,
            two_way: known.pattern == Pattern::Query,
            replies: variants(known),
        };
        Ok(Operation {
            name: known.name.clone(),
            answer: format!("{}.{}", slot.type_name, known.name),
            wire,
            request: Arc::clone(&known.request),
            reply: Arc::clone(&known.reply),
            has_result: known.has_result,
            throws: known.throws.clone(),
            handler: text.handler.clone(),
            in_place: text.in_place,
        })
    });
    Ok(Slot {
        role: slot.role,
        is_array: slot.is_array,
        asynchronous: slot.asynchronous,
        operations: operations.collect::<Result<_, _>>()?,
        available: slot.available.clone(),
    })
}

/// The variants of a reply, as the generated code of Rust has them.
fn variants(operation: &rc_values::Operation) -> &'static [ReplyVariant] {
    if operation.throws.is_empty() {
        return &[];
    }
    let throws = operation.throws.iter();
    let throws = throws.map(|thrown| ReplyVariant::with(thrown.id, replies::codec(&thrown.ty)));
    let mut variants: Vec<ReplyVariant> = throws.collect();
    if !operation.reply.members.is_empty() {
        variants.push(ReplyVariant::with(0, replies::codec(&operation.reply)));
    }
    variants.leak()
}

fn describe_slot(text: &SlotText, slot: &Slot) -> Result<rc_runtime::Slot, String> {
    let operations: Vec<typed::Operation> = slot.operations.iter().map(|o| o.wire).collect();
    let external: Vec<&'static str> = text.external_types.iter().cloned().map(leak_text).collect();
    Ok(rc_runtime::Slot {
        is_array: text.is_array,
        name: leak_text(text.name.clone()),
        role: text.role,
        interface: leak_text(text.interface.clone()),
        type_name: leak_text(text.type_name.clone()),
        type_hash: hash(&text.type_hash)?,
        backend: backends::find(&text.middleware)?.name,
        qos: text.qos.over(Qos::of(text.role)),
        operations: operations.leak(),
        external_types: external.leak(),
    })
}

fn hash(text: &str) -> Result<u64, String> {
    u64::from_str_radix(text, 16).map_err(|_| format!("`{text}` is not a hash of 16 digits"))
}

fn leak_text(text: String) -> &'static str {
    text.leak()
}
