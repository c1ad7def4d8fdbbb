//! The middlewares of slots and components: those that files choose, and those that connections of
//! `middleware auto;` have by the places of their ends.

use crate::model::Network;
use rc_cdsl::model::Middleware;
use rc_codegen::Project;
use rc_ddsl::Endpoint;
use rc_vocabulary::Middlewares;
use std::collections::BTreeMap;

impl Network {
    /// The middlewares of a slot. Of several, tools use the first one. A slot without connections
    /// has that of its component.
    pub fn middlewares(&self, end: Endpoint) -> Vec<Middleware> {
        let instance = &self.deployment.instances[end.instance];
        let own = self.slot(end).and_then(|slot| slot.backend);
        if let Some(own) = own.or(instance.auto.is_none().then_some(instance.middleware)) {
            return vec![own];
        }
        let found = self.connections.middlewares(end);
        if found.is_empty() {
            vec![instance.middleware]
        } else {
            found
        }
    }

    /// The slots of an instance.
    pub(crate) fn ends(&self, instance: usize) -> impl Iterator<Item = Endpoint> + use<> {
        let project = self.projects.get(instance).and_then(Option::as_deref);
        let count = project.map_or(0, |project| project.component.slots.len());
        (0..count).map(move |slot| Endpoint { instance, slot })
    }

    /// The middlewares over which an instance has slots or the time of the network, each once.
    pub fn middlewares_of(&self, at: usize) -> Vec<Middleware> {
        let instance = &self.deployment.instances[at];
        let own = instance.auto.is_none().then_some(instance.middleware);
        let slots = self.ends(at).flat_map(|end| self.middlewares(end));
        let time = self.time.iter().flat_map(|time| {
            let followers = time.followers.iter();
            let followers = followers.filter(move |(of, _)| *of == at || time.source == at);
            followers.map(|(_, middleware)| *middleware)
        });
        let mut all = Vec::new();
        for middleware in own.into_iter().chain(slots).chain(time) {
            if !all.contains(&middleware) {
                all.push(middleware);
            }
        }
        all
    }

    /// For each instance, the middlewares that it needs. Of several, the main one is the default,
    /// if it is among them. A component that is several times in a process is linked there once,
    /// for all that any of them needs.
    pub(crate) fn needed(&self) -> Vec<Middlewares> {
        let own: Vec<Vec<Middleware>> = (0..self.deployment.instances.len())
            .map(|at| self.middlewares_of(at))
            .collect();
        let place = |at: usize| {
            let process = self.deployment.instances[at].process.as_ref()?;
            let project: &Project = self.projects.get(at)?.as_deref()?;
            Some((process.text.as_str(), project.path.as_path()))
        };
        let mut together: BTreeMap<_, Vec<Middleware>> = BTreeMap::new();
        for (at, own) in own.iter().enumerate() {
            if let Some(place) = place(at)
                && self.deployment.instances[at].auto.is_some()
            {
                together.entry(place).or_default().extend(own);
            }
        }
        let instances = self.deployment.instances.iter().enumerate();
        instances
            .map(|(at, instance)| {
                if instance.auto.is_none() {
                    return instance.middleware.into();
                }
                let shared = place(at).and_then(|place| together.get(&place));
                // Slots that choose their middleware bring it themselves.
                let chosen = self.ends(at).filter_map(|end| self.slot(end)?.backend);
                let chosen: Vec<Middleware> = chosen.collect();
                let all = shared.unwrap_or(&own[at]).iter();
                let open: Vec<Middleware> =
                    all.copied().filter(|one| !chosen.contains(one)).collect();
                let main = match open.first() {
                    Some(first) if !open.contains(&instance.middleware) => *first,
                    _ => instance.middleware,
                };
                Middlewares::new(main, open)
            })
            .collect()
    }

    /// The middlewares of the connections of an instance, for people.
    pub(crate) fn middleware_text(&self, at: usize) -> String {
        let instance = &self.deployment.instances[at];
        match self.middlewares_of(at).as_slice() {
            all @ [_, ..] if instance.auto.is_some() => text(all),
            _ => instance.middleware.word().to_owned(),
        }
    }

    /// For an instance whose connections have several middlewares, those of each slot with
    /// connections, for people.
    pub(crate) fn transports(&self, at: usize) -> BTreeMap<String, String> {
        if self.deployment.instances[at].auto.is_none() || self.middlewares_of(at).len() < 2 {
            return BTreeMap::new();
        }
        let ends = self.ends(at).filter_map(|end| {
            let found = self.connections.middlewares(end);
            let slot = self.slot(end).filter(|_| !found.is_empty())?;
            Some((slot.name.clone(), text(&found)))
        });
        ends.collect()
    }

    /// The options that choose the middlewares of slots which have others than the program of the
    /// component gives them.
    pub(crate) fn transport_options(&self, at: usize) -> Vec<String> {
        let instance = &self.deployment.instances[at];
        if instance.auto.is_none() {
            return Vec::new();
        }
        let ends = self.ends(at);
        let options = ends.filter_map(|end| {
            let slot = self.slot(end).filter(|slot| slot.backend.is_none())?;
            let words = self.middlewares(end);
            if words == [self.programs.needed(at).main()] {
                return None;
            }
            let words: Vec<&str> = words.iter().map(|one| one.word()).collect();
            Some(format!("{}={}", slot.name, words.join(",")))
        });
        options.collect()
    }
}

/// `iceoryx2, local`
fn text(middlewares: &[Middleware]) -> String {
    let words: Vec<&str> = middlewares.iter().map(|one| one.word()).collect();
    words.join(", ")
}
