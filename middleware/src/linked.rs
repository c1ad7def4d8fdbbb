//! The middlewares that are linked into a component, and what each of them adds to a component's
//! process: arguments in its own style, a clock, variables of the environment.

use crate::cdr::{DecodeError, Reader, Writer};
use crate::{Address, Backend, Environment, OpenError, Settings};
use rc_vocabulary::qos::Policy;
use rc_vocabulary::{Role, Value};
use serde_json::Value as Json;
use std::collections::BTreeMap;
use std::fmt;
use std::sync::Arc;

/// Opens a backend.
pub type Connect = fn(&Environment) -> Result<Box<dyn Backend>, OpenError>;

/// A middleware that is linked into a component. Each backend has a constant `LINKED`.
///
/// ```
/// use rc_middleware::{Linked, OpenError};
///
/// const QUIET: Linked = Linked::new("quiet", |environment| {
///     Err(OpenError::Backend {
///         address: environment.network.clone(),
///         reason: "it carries no messages".to_owned(),
///     })
/// });
/// assert!(QUIET.arguments.is_none() && QUIET.clock.is_none());
/// ```
#[derive(Clone, Copy, Debug)]
pub struct Linked {
    /// The name of the middleware in the languages and on command lines.
    pub name: &'static str,
    /// Opens its backend.
    pub connect: Connect,
    /// Opens its backend for a tool: components do not count its endpoints as peers. None if no
    /// tool can reach a component.
    pub observe: Option<Connect>,
    /// The arguments of its nodes, after an option of their own.
    pub arguments: Option<NodeArguments>,
    /// Its topic of time.
    pub clock: Option<NodeClock>,
    /// Finds the rules of its settings for slots that are none of these, each with the names of its
    /// operations.
    pub unmatched: fn(&Settings, &[(&str, Vec<&str>)]) -> Vec<UnmatchedRule>,
    /// Adds the settings that variables of the environment choose, unless they are set. The
    /// function reads a variable.
    pub variables: fn(&mut BTreeMap<String, String>, &dyn Fn(&str) -> Option<String>),
}

impl Linked {
    /// A middleware that adds nothing else.
    pub const fn new(name: &'static str, connect: Connect) -> Self {
        Self {
            name,
            connect,
            observe: None,
            arguments: None,
            clock: None,
            unmatched: |_, _| Vec::new(),
            variables: |_, _| {},
        }
    }
}

/// A rule of a middleware's settings for a slot that the component does not have.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct UnmatchedRule {
    /// The rule with its key, as a message has it: ``remap `Lasr:=/scan` ``.
    pub rule: String,
    /// Its target: `SLOT` or `SLOT/operation`.
    pub target: String,
    /// The nearest name, or the allowed ones.
    pub help: String,
}

/// The arguments that nodes of a middleware take. The option that begins them is
/// [`rc_vocabulary::Capabilities::node_arguments`].
#[derive(Clone, Copy, Debug)]
pub struct NodeArguments {
    /// The section of the component's help.
    pub help: &'static str,
    /// Parses the arguments after the option. An error says what is allowed.
    pub read: fn(Vec<String>) -> Result<Arc<dyn GivenArguments>, String>,
}

/// Parsed arguments of a node.
pub trait GivenArguments: fmt::Debug + Send + Sync {
    /// Whether the log is printed, if the arguments say so.
    fn prints_log(&self) -> Option<bool>;

    /// Applies the arguments to a node and may set its name. `set` are the settings of the command
    /// line, which precede those of the configuration. An error ends with a line feed.
    fn resolve(
        &self,
        node: &NodeName<'_>,
        set: &Settings,
        configured: &Settings,
    ) -> Result<Overrides, String>;

    /// The names of topics in the middleware, by all settings of the node.
    fn topic_names(&self, node: &NodeName<'_>, settings: &Settings) -> TopicNames;
}

/// Gives the name that a topic has in its middleware: of its address, its slot and its operation.
pub type TopicNames = Box<dyn Fn(&Address, &str, &str) -> String>;

/// The names of a component from which those of its node follow.
#[derive(Clone, Copy, Debug)]
pub struct NodeName<'a> {
    /// The network.
    pub network: &'a str,
    /// The component's name in it.
    pub name: &'a str,
}

/// The effect of the arguments of a node.
#[derive(Debug, Default)]
pub struct Overrides {
    /// Rules, by the keys of settings, which precede those of the settings.
    pub rules: Vec<(&'static str, Value)>,
    /// Settings of the node.
    pub settings: Settings,
    /// Policies of topics, which precede those of the settings.
    pub qos: Vec<TopicOverride>,
    /// Parameters, each once.
    pub parameters: Vec<ParameterOverride>,
    /// The level of the log.
    pub log: Option<&'static str>,
    /// Arguments that are for other nodes, for the log.
    pub ignored: Vec<String>,
}

/// A policy for a topic by its name in the middleware.
#[derive(Debug, PartialEq)]
pub struct TopicOverride {
    /// `/scan`
    pub topic: String,
    /// The end that it is for.
    pub role: Role,
    /// The policy.
    pub policy: Policy,
}

/// A value for a parameter.
#[derive(Debug)]
pub struct ParameterOverride {
    /// Its path.
    pub name: String,
    /// The text, if a string needs no quotes.
    pub text: Option<String>,
    /// The value.
    pub value: Json,
    /// The origin of the value, for messages.
    pub from: String,
    /// Whether the component need not have the parameter, since the source is for many nodes.
    pub is_optional: bool,
}

/// A topic of a middleware by which nodes share a time.
#[derive(Clone, Copy, Debug)]
pub struct NodeClock {
    /// The setting by which a component follows it, a boolean.
    pub setting: &'static str,
    /// The name of its types for peers, `rosgraph_msgs::Clock/clock`.
    pub types: &'static str,
    /// The name of its type in the middleware.
    pub type_name: &'static str,
    /// Gives the topic its name in the middleware. The slot of time is the text.
    pub rename: fn(&mut Settings, &str),
    /// Reads a time, in nanoseconds.
    pub read: fn(&mut Reader<'_>) -> Result<u64, DecodeError>,
    /// Writes a time in nanoseconds.
    pub write: fn(u64, &mut Writer<'_>),
}
