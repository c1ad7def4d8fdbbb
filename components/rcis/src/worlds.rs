//! Snapshots and clones of the world.

use crate::refusal::Refusal;
use innermodel_simulation::{World, WorldSnapshot};
use rc_diagnostics::{foreign, nearest};
use rcis_generated::types::rc_simulation::Reason;
use std::collections::BTreeMap;

/// The longest name of a snapshot or a clone.
const LONGEST: usize = 64;

/// Snapshots and clones by their names.
#[derive(Debug, Default)]
pub(crate) struct Worlds {
    pub(crate) snapshots: BTreeMap<String, WorldSnapshot>,
    pub(crate) clones: BTreeMap<String, World>,
}

/// A place for a new thing.
pub(crate) fn check_new<T>(
    of: &BTreeMap<String, T>,
    name: &str,
    what: &str,
    most: usize,
) -> Result<(), Refusal> {
    let cleaned = foreign::clean(name);
    if name.is_empty() || name.len() > LONGEST {
        let text = format!("the name of a {what} has 1 to {LONGEST} bytes");
        Err(Refusal::Other(Reason::WrongValue, text))
    } else if of.contains_key(name) {
        let text = format!("a {what} has the name `{cleaned}` already");
        Err(Refusal::Other(Reason::DuplicateName, text))
    } else if of.len() >= most {
        let text = format!("there are {most} of them already; remove a {what} first");
        Err(Refusal::Other(Reason::TooMany, text))
    } else {
        Ok(())
    }
}

/// The refusal of a name that nothing has.
pub(crate) fn unknown<T>(of: &BTreeMap<String, T>, name: &str, what: &str) -> Refusal {
    let near = nearest(name, of.keys().map(String::as_str));
    let hint = near.map_or_else(String::new, |near| format!(", did you mean `{near}`?"));
    let text = format!("no {what} has the name `{}`{hint}", foreign::clean(name));
    Refusal::Other(Reason::UnknownName, text)
}
