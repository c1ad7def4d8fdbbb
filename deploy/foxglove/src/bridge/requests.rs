//! Requests of clients, and their answers.

use super::Bridge;
use crate::client::Client;
use crate::graph::Graph;
use crate::jobs::Done;
use crate::offers::of_component;
use crate::parameters::{like, values};
use crate::protocol::{self, Call, ENCODING, Request};
use crate::subscriptions::SUBSCRIPTIONS;
use rc_diagnostics::foreign::clean;
use rc_record::definition;
use rc_values::decode;
use serde_json::{Map, Value as Json};
use std::collections::{BTreeMap, BTreeSet};
use tungstenite::Message;

impl Bridge {
    pub(super) fn receive(&mut self) {
        let ids: Vec<u64> = self.clients.keys().copied().collect();
        for id in ids {
            if let Some(client) = self.clients.get_mut(&id) {
                client.begin_turn();
            }
            while let Some(message) = self.clients.get_mut(&id).and_then(Client::receive) {
                let handled = match &message {
                    Message::Text(text) => match serde_json::from_str(text) {
                        Ok(request) => self.request(id, request),
                        Err(error) => Err(format!("the request cannot be read: {error}")),
                    },
                    Message::Binary(bytes) => match Call::read(bytes) {
                        Some(call) => {
                            self.call(id, &call);
                            Ok(())
                        }
                        None => Err("the binary message is not a call".to_owned()),
                    },
                    _ => Ok(()),
                };
                if let (Err(reason), Some(client)) = (handled, self.clients.get_mut(&id)) {
                    client.complain(&reason);
                }
            }
        }
    }

    fn request(&mut self, id: u64, request: Request) -> Result<(), String> {
        let Some(client) = self.clients.get_mut(&id) else {
            return Ok(());
        };
        match request {
            Request::Subscribe { subscriptions } => {
                let mut refusals = subscriptions.iter().filter_map(|one| {
                    if self.offers.channels.contains_key(&one.channel_id) {
                        client.subscriptions.add(one.id, one.channel_id).err()
                    } else {
                        Some(format!("there is no channel {}", one.channel_id))
                    }
                });
                // One complaint for a request, however many it brings.
                let first = refusals.next();
                let others = refusals.count();
                self.follow();
                return match first {
                    None => Ok(()),
                    Some(first) if others == 0 => Err(first),
                    Some(first) => Err(format!("{first}; {others} others were refused, too")),
                };
            }
            Request::Unsubscribe { subscription_ids } => {
                for one in subscription_ids {
                    client.subscriptions.remove(one);
                }
                self.follow();
            }
            Request::GetParameters {
                parameter_names,
                id: request,
            } => {
                let document = values(&self.offers, &parameter_names, request.as_deref());
                client.send(&document);
            }
            Request::SetParameters { parameters, id: of } => {
                if self.options.read_only {
                    return Err("parameters cannot be changed: `--read-only`".to_owned());
                }
                return self.set(id, parameters, of);
            }
            Request::SubscribeParameterUpdates { parameter_names } => {
                if parameter_names.is_empty() {
                    client.watched = None;
                } else if let Some(watched) = &mut client.watched {
                    if watched.len() + parameter_names.len() > SUBSCRIPTIONS {
                        return Err(format!("more than {SUBSCRIPTIONS} parameters"));
                    }
                    watched.extend(parameter_names);
                }
            }
            Request::UnsubscribeParameterUpdates { parameter_names } => {
                if parameter_names.is_empty() {
                    client.watched = Some(BTreeSet::new());
                }
                if let Some(watched) = &mut client.watched {
                    for name in &parameter_names {
                        watched.remove(name);
                    }
                }
            }
            Request::SubscribeConnectionGraph => {
                client.watches_graph = true;
                let whole = Graph::default().update_to(&self.offers.graph);
                whole.iter().for_each(|document| client.send(document));
            }
            Request::UnsubscribeConnectionGraph => client.watches_graph = false,
        }
        Ok(())
    }

    fn set(
        &mut self,
        client: u64,
        parameters: Vec<protocol::Parameter>,
        id: Option<String>,
    ) -> Result<(), String> {
        let mut changes: BTreeMap<String, Map<String, Json>> = BTreeMap::new();
        let mut names = Vec::new();
        for one in parameters {
            let Some(known) = self.offers.parameters.get(&one.name) else {
                return Err(format!("there is no parameter `{}`", one.name));
            };
            let Some(value) = one.value else {
                return Err(format!("the parameter `{}` cannot be removed", one.name));
            };
            let of = changes.entry(known.component.clone()).or_default();
            of.insert(known.path.clone(), like(&known.value, value));
            names.push(one.name);
        }
        let network = &self.options.network;
        self.jobs.set(client, network, changes, names, id)
    }

    fn call(&mut self, id: u64, call: &Call<'_>) {
        let begun = self.begin_call(id, call);
        if let (Err(reason), Some(client)) = (begun, self.clients.get_mut(&id)) {
            client.send(&protocol::failure(
                call.service,
                call.number,
                &clean(&reason),
            ));
        }
    }

    fn begin_call(&mut self, id: u64, call: &Call<'_>) -> Result<(), String> {
        let service = self.offers.services.get(&call.service);
        let service = service.ok_or_else(|| format!("there is no service {}", call.service))?;
        if call.encoding != ENCODING.as_bytes() {
            return Err(format!("expected a request in the encoding `{ENCODING}`"));
        }
        let operation = service.operation.clone();
        let body = definition::body(call.body)?;
        let request = &operation.operation.request;
        let parameters = decode(request, rc_middleware::Encoding::Cdr, body)
            .map_err(|error| format!("the request cannot be decoded: {error}"))?;
        let network = &self.options.network;
        let call = (call.service, call.number);
        self.jobs.call(id, network, operation, parameters, call)
    }

    pub(super) fn finished(&mut self, id: u64, done: Done) {
        match done {
            Done::Called {
                service,
                call,
                reply,
            } => {
                let Some(client) = self.clients.get_mut(&id) else {
                    return;
                };
                match reply {
                    Ok(body) => client.send_binary(protocol::reply(service, call, &body)),
                    Err(reason) => {
                        client.send(&protocol::failure(service, call, &clean(&reason)));
                    }
                }
            }
            Done::Set {
                names,
                id: of,
                failures,
                listed,
            } => {
                for (component, listed) in &listed {
                    let mut all = std::mem::take(&mut self.offers.parameters);
                    // The values before are still those that others know.
                    let is_other = |name: &String, new: &Json| {
                        all.get(name).is_none_or(|old| old.value != *new)
                    };
                    let new: Vec<_> = of_component(component, listed).collect();
                    let others = new.iter().filter(|(name, one)| is_other(name, &one.value));
                    let others = others.map(|(name, _)| name.clone()).collect();
                    all.extend(new);
                    self.offers.parameters = all;
                    self.tell_parameters(&others, Some(id));
                }
                if let Some(client) = self.clients.get_mut(&id) {
                    failures.iter().for_each(|reason| client.complain(reason));
                    client.send(&values(&self.offers, &names, of.as_deref()));
                }
            }
        }
    }

    /// Sends the values of these parameters to those that watch them, except to one client.
    pub(super) fn tell_parameters(&mut self, names: &BTreeSet<String>, but: Option<u64>) {
        let others = self.clients.iter_mut();
        let others = others.filter(|(id, client)| client.is_open() && but != Some(**id));
        for (_, client) in others {
            let wanted = names.iter();
            let wanted = wanted.filter(|name| {
                let watched = client.watched.as_ref();
                watched.is_none_or(|watched| watched.contains(*name))
            });
            let wanted: Vec<String> = wanted.cloned().collect();
            if !wanted.is_empty() {
                client.send(&values(&self.offers, &wanted, None));
            }
        }
    }
}
