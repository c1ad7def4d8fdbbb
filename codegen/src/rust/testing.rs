//! Names and types of Rust for the fakes of a component: what `templates/rust/testing.rs.tera`
//! prints.

use super::exports;
use super::names;
use super::worker::WORKER;
use crate::collisions;
use crate::view;
use rc_vocabulary::Role;
use serde::Serialize;
use std::collections::BTreeSet;

/// The fakes of a component.
#[derive(Debug, Serialize)]
pub(crate) struct Testing {
    fakes: Vec<Fake>,
    /// Whether a fake is a server.
    calls: bool,
    /// Whether one is that of a slot array.
    arrays: bool,
    /// Imports of a new component's test from its generated crate.
    imports: Vec<&'static str>,
    /// How this test starts the worker, and its next steps.
    start: String,
    transitions: &'static [&'static str],
}

/// The fake peer of one slot that calls or publishes.
#[derive(Debug, Serialize)]
pub(crate) struct Fake {
    index: usize,
    slot: String,
    /// The field of the context, and its type.
    field: String,
    ty: String,
    /// Its kind, for its documentation.
    what: &'static str,
    interface: String,
    is_array: bool,
    calls: bool,
    /// The type of the fake server.
    server: String,
    /// Type that the fake keeps: a call or a sample.
    kept: String,
    /// The module of the interface below `interfaces`.
    module: String,
}

/// One fake for each slot that sends.
pub(super) fn of(view: &view::Component) -> Testing {
    let mut taken = BTreeSet::new();
    let slots = view.slots.iter().enumerate();
    let fakes: Vec<Fake> = slots
        .filter(|(_, slot)| slot.sends)
        .map(|(index, slot)| fake(view, index, slot, &mut taken))
        .collect();
    // A worker with actions or members is more than what its function `initialize` returns.
    let is_started = (view.machine.is_some() && !view.managed) || view.has_arrays();
    let mut imports = Vec::new();
    if is_started {
        imports.push("WorkerError");
    }
    if view.managed {
        imports.push("lifecycle::Transition");
    }
    imports.push("testing::TestContext");
    if !is_started {
        imports.push("{Worker, WorkerError}");
    }
    Testing {
        calls: fakes.iter().any(|fake| fake.calls),
        arrays: fakes.iter().any(|fake| fake.is_array),
        fakes,
        imports,
        start: if is_started {
            format!(": {WORKER} = test.start()")
        } else {
            format!(" = {WORKER}::initialize(&mut test)")
        },
        transitions: if view.managed {
            &["Configure", "Activate"]
        } else {
            &[]
        },
    }
}

fn fake(
    view: &view::Component,
    index: usize,
    slot: &view::Slot,
    taken: &mut BTreeSet<String>,
) -> Fake {
    let calls = slot.role == Role::Requires;
    let base = names::camel(&slot.name);
    let kept = if calls { "Call" } else { "Sample" };
    let server = collisions::free(format!("{base}Fake"), taken);
    let kept = collisions::free(format!("{base}{kept}"), taken);
    let one = if calls {
        server.clone()
    } else {
        format!("FakeSubscriber<{kept}>")
    };
    let (ty, what) = match (slot.is_array, calls) {
        (false, true) => (one, "server"),
        (false, false) => (one, "subscriber, which keeps the samples,"),
        (true, true) => (format!("FakeArray<{one}>"), "servers of the members"),
        (true, false) => (
            format!("FakeArray<{one}>"),
            "subscribers, which keep the samples, of the members",
        ),
    };
    Fake {
        index,
        slot: slot.name.clone(),
        field: names::snake(&slot.name),
        ty,
        what,
        interface: slot.interface.clone(),
        is_array: slot.is_array,
        calls,
        server,
        kept,
        module: exports::interface_module(view, &slot.module, &slot.interface),
    }
}
