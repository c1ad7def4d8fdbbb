//! The arguments of ROS 2, as the command line gives them.

use rc_vocabulary::Value;
use rc_vocabulary::ros::Remapping;
use serde_json::Value as Json;
use std::path::PathBuf;

/// The arguments of ROS 2, in their order where it counts.
#[derive(Debug, Default, PartialEq)]
pub(crate) struct RosArguments {
    /// Rules for names.
    pub(crate) remap: Vec<For<Remapping>>,
    /// Settings of the node: its name and its namespace.
    pub(crate) settings: Vec<For<(&'static str, Value)>>,
    /// Levels of the log.
    pub(crate) log: Vec<For<&'static str>>,
    pub(crate) parameters: Vec<Source>,
    /// Whether the log is published on `/rosout`.
    pub(crate) rosout: Option<bool>,
    /// Whether the log is printed.
    pub(crate) prints_log: Option<bool>,
}

/// An argument, and the node that it is for, if it names one.
#[derive(Debug, PartialEq)]
pub(crate) struct For<T> {
    pub(crate) node: Option<String>,
    pub(crate) value: T,
}

/// A value for a parameter whose type is not known.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Untyped {
    /// The text, if a string needs no quotes.
    pub(crate) text: Option<String>,
    /// The value of the text.
    pub(crate) value: Json,
}

/// Where values of parameters come from.
#[derive(Debug, PartialEq)]
pub(crate) enum Source {
    /// `-p NAME:=VALUE`
    Argument(For<(String, Untyped)>),
    /// `--params-file FILE`
    File(PathBuf),
}
