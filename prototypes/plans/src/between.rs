//! Plans between prototypes of two libraries: those of the two ends of a connection.

use crate::network::Network;
use crate::plan::Plan;
use crate::refusal::Refusal;
use rc_prototypes::model::{Content, Library};
use std::collections::HashSet;

/// The cheapest plan from a prototype of one library to a prototype of another one, of one value
/// where a prototype is about the elements of a sequence. Functions of the user are not part of it:
/// only printed code can call them.
///
/// # Errors
/// As [`Network::plan`].
pub fn between(from: (&Library, &str), to: (&Library, &str)) -> Result<Plan, Refusal> {
    let library = joined(from.0, to.0);
    let (from, to) = (mark(SENDER, from.1), mark(RECEIVER, to.1));
    Network::new(&library).plan(&from, &to)
}

/// The plan between prototypes whose frames move. The transform from the frame of the first one to
/// that of the second one is known when a message comes: its numbers follow those of the first one,
/// see [`TRANSFORM`](crate::TRANSFORM).
///
/// # Errors
/// As [`between`]; the values are not positions, orientations or poses, or have no axes.
pub fn moving(from: (&Library, &str), to: (&Library, &str)) -> Result<Plan, Refusal> {
    let mut library = joined(from.0, to.0);
    let (from, to) = (mark(SENDER, from.1), mark(RECEIVER, to.1));
    for prototype in &mut library.prototypes {
        if prototype.name == from || prototype.name == to {
            prototype.frames.retain(|(end, _)| end != "with_respect_to");
        }
    }
    Network::new(&library).moving(&from, &to)
}

const SENDER: &str = "sender";
const RECEIVER: &str = "receiver";

/// The declarations of both libraries, with names that differ.
fn joined(from: &Library, to: &Library) -> Library {
    let mut library = marked(from, SENDER, to);
    let other = marked(to, RECEIVER, from);
    let known: HashSet<String> = names(&library).map(str::to_owned).collect();
    let algebraics = other.algebraics.into_iter();
    let algebraics = algebraics.filter(|own| !known.contains(&own.name));
    library.algebraics.extend(algebraics);
    library.domains.extend(other.domains);
    library.axes.extend(other.axes);
    library.aliases.extend(other.aliases);
    library.prototypes.extend(other.prototypes);
    library.views.extend(other.views);
    library
}

fn mark(end: &str, name: &str) -> String {
    format!("{end}:{name}")
}

fn names(library: &Library) -> impl Iterator<Item = &str> {
    library.algebraics.iter().map(|own| own.name.as_str())
}

/// A library with names that say their end: those of prototypes and axes, and those of abstract types
/// and domains that the other library declares otherwise.
fn marked(library: &Library, end: &str, other: &Library) -> Library {
    let mut out = library.clone();
    out.conversions.clear();
    let differing: HashSet<&str> = library
        .algebraics
        .iter()
        .filter(|own| {
            let mut same = other.algebraics.iter().filter(|of| of.name == own.name);
            same.any(|of| of != *own)
        })
        .map(|own| own.name.as_str())
        .collect();
    let algebraic = |name: &mut String| {
        if differing.contains(name.as_str()) {
            *name = mark(end, name);
        }
    };
    let own = |name: &mut String| *name = mark(end, name);
    for axes in &mut out.axes {
        own(&mut axes.name);
    }
    for of in &mut out.algebraics {
        algebraic(&mut of.name);
    }
    for alias in &mut out.aliases {
        algebraic(&mut alias.left);
        algebraic(&mut alias.right);
    }
    for prototype in &mut out.prototypes {
        own(&mut prototype.name);
        // Both ends know where the elements of a sequence are.
        prototype.sequence = None;
        let axes = prototype.axes.iter_mut().chain(&mut prototype.body);
        axes.for_each(own);
        match &mut prototype.content {
            Content::Values { algebraic: of, .. } => algebraic(of),
            Content::Parts(parts) => parts.iter_mut().for_each(|part| own(&mut part.prototype)),
        }
    }
    for view in &mut out.views {
        own(&mut view.of);
        own(&mut view.target);
    }
    out
}
