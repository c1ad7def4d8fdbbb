//! The description of a forwarding component, as JSON: the component, and its routes.

use rc_host::Program;
use rc_runtime::Role;
use serde::Deserialize;

/// A component that forwards.
pub struct Description {
    /// The component.
    pub program: Program,
    /// The destination of each receiving slot, by its number. `None` for a slot that sends.
    pub(crate) routes: Vec<Option<usize>>,
}

/// A route from a receiving slot to a sending one.
#[derive(Clone, Debug, PartialEq, Eq, Deserialize)]
pub struct Route {
    /// The slot that implements or subscribes.
    pub from: String,
    /// The slot that requires or publishes.
    pub to: String,
}

#[derive(Deserialize)]
struct Routes {
    routes: Vec<Route>,
}

impl Description {
    /// Reads a description: the JSON of [`Program::read`] with a member `routes`.
    ///
    /// # Errors
    /// The part that is wrong.
    pub fn read(json: &str) -> Result<Self, String> {
        let program = Program::read(json)?;
        let routes: Routes =
            serde_json::from_str(json).map_err(|error| format!("the routes: {error}"))?;
        Self::new(program, &routes.routes)
    }

    /// A component with these routes.
    ///
    /// # Errors
    /// A route names no slot, two slots that do not fit, or a slot that already has a route; or a
    /// required slot has no route.
    pub fn new(program: Program, routes: &[Route]) -> Result<Self, String> {
        let slots = program.description.slots;
        let find = |name: &str| {
            let at = slots.iter().position(|slot| slot.name == name);
            at.ok_or_else(|| format!("a route names `{name}`, which is not a slot"))
        };
        let mut next = vec![None; slots.len()];
        let mut reached = vec![false; slots.len()];
        for Route { from, to } in routes {
            let (at, end) = (find(from)?, find(to)?);
            let (one, other) = (&slots[at], &slots[end]);
            let opposite = match one.role {
                Role::Implements => Some(Role::Requires),
                Role::SubscribesTo => Some(Role::Publishes),
                Role::Requires | Role::Publishes => None,
            };
            if opposite != Some(other.role) || one.is_array != other.is_array {
                return Err(format!(
                    "a route leads from `{from}` to `{to}`: they do not fit"
                ));
            }
            if one.type_name != other.type_name || one.type_hash != other.type_hash {
                return Err(format!(
                    "a route leads from `{from}` to `{to}`: their interfaces differ"
                ));
            }
            if next[at].replace(end).is_some() || std::mem::replace(&mut reached[end], true) {
                return Err(format!("`{from}` or `{to}` has two routes"));
            }
        }
        // A conversion may learn where frames are from a consumer, so that one needs no route.
        let mut open = slots.iter().zip(&next).zip(&reached);
        let is_left = |((slot, next), reached): &((&rc_runtime::Slot, &Option<usize>), &bool)| {
            next.is_none()
                && !**reached
                && !matches!(slot.role, Role::Requires | Role::SubscribesTo)
        };
        if let Some(((slot, _), _)) = open.find(is_left) {
            return Err(format!("`{}` has no route", slot.name));
        }
        Ok(Self {
            program,
            routes: next,
        })
    }
}
