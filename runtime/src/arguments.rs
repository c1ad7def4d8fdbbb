//! The arguments of a component, as its command line gives them.

use crate::converting::Conversions;
use crate::description::Description;
use crate::slots::{Listed, Transports};
use crate::time::ClockChoice;
use rc_middleware::linked::{GivenArguments, NodeName};
use rc_middleware::{Address, Settings};
use rc_vocabulary::member;
use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::Arc;

/// Arguments of a component that runs.
#[derive(Clone, Debug)]
pub(crate) struct Arguments {
    pub(crate) network: String,
    pub(crate) name: String,
    pub(crate) config: Option<PathBuf>,
    pub(crate) bindings: BTreeMap<String, Address>,
    /// The middlewares of slots that have others than the description gives them.
    pub(crate) transports: Transports,
    /// Subscribers that are reliable, unless settings say otherwise.
    pub(crate) reliable: Vec<String>,
    pub(crate) log: Option<String>,
    pub(crate) settings: Settings,
    /// Parameters of this run (`--set`), each with its text.
    pub(crate) parameters: Vec<(String, String)>,
    /// Arguments in the style of a middleware, with its name.
    pub(crate) node: Option<(&'static str, Arc<dyn GivenArguments>)>,
    /// The source of time.
    pub(crate) clock: ClockChoice,
    /// The components that follow the time of this one, in the order of their turns.
    pub(crate) followers: Vec<String>,
    /// Whether a managed component that no supervisor has started configures and activates itself.
    pub(crate) active: bool,
    /// The file of an exact recording.
    pub(crate) record: Option<PathBuf>,
    /// The bytes of its disk that stay free; `None`: the usual part.
    pub(crate) keep_free: Option<u64>,
    /// The members of slot arrays, as the network lists them.
    pub(crate) members: Listed,
    /// The conversions of slots.
    pub(crate) conversions: Conversions,
    /// The files of the network's world, if its schema has more than that of the component.
    pub(crate) schema: Files,
}

/// Files of a schema: names and texts, beginning with the one that names the others.
pub(crate) type Files = Vec<(String, String)>;

impl Arguments {
    /// The arguments of a component of which nothing is set.
    pub(crate) fn new(network: &str, name: &str) -> Self {
        Self {
            network: network.to_owned(),
            name: name.to_owned(),
            config: None,
            bindings: BTreeMap::new(),
            transports: Transports::new(),
            reliable: Vec::new(),
            log: None,
            settings: Settings::default(),
            parameters: Vec::new(),
            node: None,
            clock: ClockChoice::default(),
            followers: Vec::new(),
            active: false,
            record: None,
            keep_free: None,
            members: Listed::new(),
            conversions: Conversions::default(),
            schema: Files::new(),
        }
    }

    /// The names from which those of the component's node follow.
    pub(crate) fn node_name(&self) -> NodeName<'_> {
        NodeName {
            network: &self.network,
            name: &self.name,
        }
    }
}

/// Checks that the component has a slot of this name, or may have a member. The error lists the
/// slots.
pub(crate) fn check_slot(description: &Description, slot: &str) -> Result<String, String> {
    let (own, of_array) = match member::split(slot) {
        Some((array, member)) => (array, Some(member)),
        None => (slot, None),
    };
    if let Some(found) = description.slots.iter().find(|s| s.name == own) {
        return match of_array {
            Some(member) if found.is_array => {
                let checked = member::check(member);
                checked.map_err(|reason| format!("`{slot}`: {reason}"))?;
                Ok(slot.to_owned())
            }
            None if !found.is_array => Ok(slot.to_owned()),
            None => Err(format!(
                "`{slot}` is a slot array; name a member: `{slot}.NAME`"
            )),
            Some(_) => Err(format!("`{own}` is not a slot array; write `{own}`")),
        };
    }
    let names: Vec<&str> = description.slots.iter().map(|s| s.name).collect();
    let near = rc_diagnostics::nearest(slot, names.iter().copied());
    let hint = match near {
        Some(near) => format!("did you mean `{near}`?"),
        None => format!("there are: {}", names.join(", ")),
    };
    Err(format!(
        "`{slot}` is not a slot of {}; {hint}",
        description.name
    ))
}
