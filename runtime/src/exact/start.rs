//! The first entry of a recording: which component ran, and with what.

use crate::arguments::Files;
use crate::description::Description;
use crate::slots::Listed;
use rc_configuration::Values;
use rc_management::component::ClockKind;
use serde_json::{Value as Json, json};

/// The version of the entries.
const VERSION: u64 = 1;

/// State of a component at its start.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Start {
    pub(crate) component: String,
    /// The hash of the description files.
    pub(crate) model: String,
    pub(crate) name: String,
    pub(crate) network: String,
    pub(crate) clock: ClockKind,
    /// The seed of `ctx.random()`.
    pub(crate) seed: u64,
    /// The parameters, without secrets.
    pub(crate) parameters: Json,
    /// The members of slot arrays that the network lists.
    pub(crate) members: Listed,
    /// The files of the network's world, if its schema has more than that of the component.
    pub(crate) schema: Files,
    /// The working directory.
    pub(crate) directory: String,
    /// The executable, or the launcher of a worker in Python. Empty if none is known.
    pub(crate) program: String,
    /// Whether the program is that of a process of several components.
    pub(crate) is_shared: bool,
}

impl Start {
    /// The start of a component with these values of its parameters.
    pub(crate) fn new(
        description: &Description,
        name: &str,
        network: &str,
        clock: ClockKind,
        seed: u64,
        values: &Values,
        members: &Listed,
    ) -> Self {
        let directory = std::env::current_dir().unwrap_or_default();
        Self {
            component: description.name.to_owned(),
            model: format!("{:016x}", description.model_hash),
            name: name.to_owned(),
            network: network.to_owned(),
            clock,
            seed,
            parameters: values.to_record(),
            members: members.clone(),
            schema: Files::new(),
            directory: directory.display().to_string(),
            program: String::new(),
            is_shared: false,
        }
    }

    pub(super) fn to_json(&self) -> String {
        json!({
            "version": VERSION,
            "component": self.component,
            "model": self.model,
            "name": self.name,
            "network": self.network,
            "clock": serde_json::to_value(self.clock).unwrap_or_default(),
            "seed": self.seed,
            "parameters": self.parameters,
            "members": self.members,
            "schema": self.schema,
            "directory": self.directory,
            "program": self.program,
            "is_shared": self.is_shared,
        })
        .to_string()
    }

    pub(super) fn from_json(text: &str) -> Result<Self, String> {
        let json: Json = serde_json::from_str(text).map_err(|e| e.to_string())?;
        let field = |name: &str| {
            let found = json.get(name).and_then(Json::as_str);
            let found = found.map(str::to_owned);
            found.ok_or_else(|| format!("its beginning does not say `{name}`"))
        };
        match json.get("version").and_then(Json::as_u64) {
            Some(VERSION) => {}
            Some(other) => return Err(format!("it has version {other}, not {VERSION}")),
            None => return Err("its beginning has no version".to_owned()),
        }
        let clock = json.get("clock").cloned().unwrap_or_default();
        Ok(Self {
            component: field("component")?,
            model: field("model")?,
            name: field("name")?,
            network: field("network")?,
            clock: serde_json::from_value(clock).map_err(|e| e.to_string())?,
            seed: json.get("seed").and_then(Json::as_u64).unwrap_or_default(),
            parameters: json.get("parameters").cloned().unwrap_or_default(),
            members: match json.get("members").cloned() {
                Some(members) => serde_json::from_value(members).map_err(|e| e.to_string())?,
                None => Listed::new(),
            },
            schema: match json.get("schema").cloned() {
                Some(schema) => serde_json::from_value(schema).map_err(|e| e.to_string())?,
                None => Files::new(),
            },
            directory: field("directory")?,
            program: field("program")?,
            is_shared: json.get("is_shared").and_then(Json::as_bool) == Some(true),
        })
    }
}
