//! Adaptors: components that `convert via process;` adds. One program is all of them and all proxies,
//! and gets their descriptions as an argument.

use crate::model::Network;
use crate::proxies::routes;
use rc_cdsl::Component;
use rc_codegen::{Project, description};
use rc_ddsl::model::Deployment;
use rc_diagnostics::Diagnostics;
use serde_json::json;
use std::io;
use std::rc::Rc;

/// The longest description, in bytes. Linux limits each argument of a program to 128 KiB.
const LONGEST: usize = 120 * 1024;

/// Adds the adaptors of a network, and their components.
pub(crate) fn add(
    deployment: &mut Deployment,
    projects: &mut Vec<Option<Rc<Project>>>,
    found: &mut Diagnostics,
) {
    let components: Vec<Option<&Component>> = projects
        .iter()
        .map(|project| project.as_ref().map(|project| &project.component))
        .collect();
    for adaptor in rc_ddsl::add_adaptors(deployment, &components, found) {
        let own = projects[adaptor.of].as_deref().cloned();
        projects.push(own.map(|mut own| {
            own.component = adaptor.component;
            own.parameters = None;
            own.kinematics.clear();
            own.state_machine = None;
            Rc::new(own)
        }));
    }
}

impl Network {
    /// The argument of an adaptor or a proxy. `None` for a component of a file.
    pub(crate) fn description(&self, at: usize) -> io::Result<Option<String>> {
        let instance = &self.deployment.instances[at];
        let project = if instance.proxy.is_some() {
            self.proxies.get(&at).map(Rc::as_ref)
        } else {
            let is_adaptor = instance.adaptor.is_some();
            self.projects[at].as_deref().filter(|_| is_adaptor)
        };
        let Some(project) = project else {
            return Ok(None);
        };
        let mut described = description::describe(project, self.programs.needed(at))?;
        let slots = &project.component.slots;
        // Of an adaptor, the slot of its frames may follow.
        let paired = if instance.proxy.is_some() {
            slots.len()
        } else {
            slots.len().min(2)
        };
        let routes = routes(&slots[..paired]).into_iter();
        described["routes"] = routes
            .map(|(from, to)| json!({ "from": from, "to": to }))
            .collect();
        let text = described.to_string();
        if text.len() > LONGEST {
            let (name, length) = (&instance.path, text.len());
            return Err(io::Error::other(format!(
                "the types of `{name}` have a description of {length} bytes, but the maximum for a component that forwards is {LONGEST}; divide the interface or the group"
            )));
        }
        Ok(Some(text))
    }
}
