//! Adaptors: components that are added for `convert via process;` and for programs outside. One program is all of
//! them and all proxies, and gets their descriptions as an argument.

use crate::configuration::Configured;
use crate::model::Network;
use crate::proxies::routes;
use rc_cdsl::Component;
use rc_codegen::{Project, description};
use rc_ddsl::Origin;
use rc_ddsl::model::{Deployment, NODE, Setting};
use rc_diagnostics::Diagnostics;
use serde_json::json;
use std::io;
use std::rc::Rc;

/// The longest description, in bytes. Linux limits each argument of a program to 128 KiB.
const LONGEST: usize = 120 * 1024;

/// An adaptor that has settings of another instance.
pub(crate) struct Follower {
    at: usize,
    beside: usize,
    slots: Vec<(String, String)>,
}

/// Adds the adaptors of a network, and their components. `peers` are the programs outside.
pub(crate) fn add(
    deployment: &mut Deployment,
    projects: &mut Vec<Option<Rc<Project>>>,
    peers: &[Option<Rc<Project>>],
    found: &mut Diagnostics,
) -> Vec<Follower> {
    let components: Vec<Option<&Component>> = projects
        .iter()
        .chain(peers)
        .map(|project| project.as_ref().map(|project| &project.component))
        .collect();
    let mut followers = Vec::new();
    for adaptor in rc_ddsl::add_adaptors(deployment, &components, found) {
        followers.push(Follower {
            at: projects.len(),
            beside: adaptor.beside,
            slots: adaptor.slots,
        });
        let own = match adaptor.of {
            Origin::Instance(at) => &projects[at],
            Origin::External(at) => &peers[at],
        };
        let own = own.as_deref().cloned();
        projects.push(own.map(|mut own| {
            own.component = adaptor.component;
            own.parameters = None;
            own.kinematics.clear();
            own.state_machine = None;
            Rc::new(own)
        }));
    }
    followers
}

/// Passes the settings of middlewares and the addresses of slots from the configurations of their
/// consumers to adaptors, which have no configuration.
pub(crate) fn follow(
    followers: &[Follower],
    deployment: &mut Deployment,
    configured: &mut [Configured],
    passed_settings: &mut [Vec<Setting>],
) {
    for follower in followers {
        let settings = deployment.instances[follower.beside].settings.iter();
        // It is a node of its own.
        let settings = settings.filter(|set| set.key != NODE).cloned();
        let settings: Vec<Setting> = settings.collect();
        passed_settings[follower.at].clone_from(&settings);
        deployment.instances[follower.at].settings = settings;
        let theirs = &configured[follower.beside].bindings;
        let own = follower
            .slots
            .iter()
            .filter_map(|(own, theirs_name)| Some((own.clone(), theirs.get(theirs_name)?.clone())));
        configured[follower.at].bindings = own.collect();
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
        // For an adaptor, the slot of its frames may follow.
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
