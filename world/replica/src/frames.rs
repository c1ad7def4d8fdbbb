//! Where frames are, for messages that another frame wants.

use crate::{Error, World};
use property_graph::{Frame, Snapshot, Time};
use rc_diagnostics::foreign::clean;

/// The transform from the frame of a node to that of another one, as the rows of `[R | t]`, in metres.
/// It is that of `time`, interpolated between two changes that are at most [`Keep::gap`](property_graph::Keep::gap)
/// apart. After the newest change, everything stays where it is. A schema without a unit of lengths has metres.
///
/// # Errors
/// Why it is not known.
pub fn transform(world: &World, to: &str, from: &str, time: Time) -> Result<[f64; 12], String> {
    let newest = world.snapshot();
    let transform = if time >= newest.time() {
        newest.between(frame(&newest, to)?, frame(&newest, from)?)
    } else {
        let moment = world.at(time).map_err(|error| match error {
            Error::Graph(property_graph::Error::TooEarly) => {
                "the history of the world begins later".to_owned()
            }
            error => error.to_string(),
        })?;
        let then = moment.version();
        moment.between(frame(then, to)?, frame(then, from)?)
    };
    let matrix = transform.map_err(|error| error.to_string())?.matrix();
    let unit = newest.schema().unit_of_lengths();
    let metres = unit.and_then(|unit| graph_schema::conversion(unit, "m"));
    let mut numbers = [0.0; 12];
    let (rows, _) = numbers.as_chunks_mut::<4>();
    for (row, own) in rows.iter_mut().enumerate() {
        *own = [0, 1, 2, 3].map(|column| matrix[(row, column)]);
        own[3] = metres
            .as_ref()
            .map_or(own[3], |metres| metres.apply(own[3]));
    }
    let is_finite = numbers.iter().all(|number| number.is_finite());
    is_finite
        .then_some(numbers)
        .ok_or_else(|| "its numbers are not finite".to_owned())
}

/// The frame of the one node with a name.
fn frame(version: &Snapshot, name: &str) -> Result<Frame, String> {
    let mut found = version.named(name);
    let node = match (found.next(), found.next()) {
        (Some(node), None) => node,
        (None, _) => {
            return Err(format!(
                "no node of the world has the name `{}`",
                clean(name)
            ));
        }
        (Some(_), Some(_)) => {
            let name = clean(name);
            return Err(format!("several nodes of the world have the name `{name}`"));
        }
    };
    let without = |_| format!("`{}` of the world has no frame", clean(name));
    version.frame(node).map_err(without)
}
