//! From the network to the clients: the present channels, and the messages of their subscriptions.

use super::Bridge;
use crate::delivery::deliver;
use crate::offers::{Change, Form, Reading, Source};
use crate::poll::Snapshot;
use crate::protocol;
use crate::world::Teller;
use rc_observe::{FeedId, Observer, Processes};
use rc_record::system_time;
use std::collections::BTreeSet;
use std::time::{Duration, Instant};

/// After how long a source that could not be opened is tried again.
const RETRY: Duration = Duration::from_secs(30);

impl Bridge {
    pub(super) fn update(&mut self, snapshot: &Snapshot) {
        let processes = Processes::of(&snapshot.network);
        if self.processes != processes {
            // A source that could not be opened may be available now.
            self.refused.clear();
        }
        if self.processes.were_replaced_by(&processes) {
            match Observer::new(&snapshot.network) {
                Ok(observer) => {
                    self.feeds.clear();
                    self.opened.clear();
                    (self.time, self.now) = (None, None);
                    self.observer = observer;
                }
                Err(error) => {
                    // The next poll tries again; until then, the old network stays.
                    self.tell(&error.to_string());
                    return;
                }
            }
        }
        self.processes.update(processes);
        let change: Change =
            self.offers
                .update(snapshot, &self.options.frames, self.options.read_only);
        for client in self.clients.values_mut().filter(|client| client.is_open()) {
            change.documents.iter().for_each(|d| client.send(d));
            if client.watches_graph {
                change.graph.iter().for_each(|d| client.send(d));
            }
            let channels = &self.offers.channels;
            client
                .subscriptions
                .retain(|channel| channels.contains_key(&channel));
        }
        self.tell_parameters(&change.parameters, None);
        if self.time.is_none()
            && let Some(time) = snapshot.network.time()
            && let Ok(feed) = self.observer.open(time.topic())
        {
            self.time = Some((feed, time));
        }
        self.follow();
        let feeds: Vec<FeedId> = self.feeds.keys().copied().collect();
        for feed in feeds {
            for report in self.observer.errors(feed) {
                self.tell(&report);
            }
            let lost = self.observer.lost(feed);
            if lost > 0
                && let Some(source) = self.feeds.get(&feed)
            {
                let text = format!("{lost} messages of {source} were lost");
                self.tell(&text);
            }
        }
    }

    /// Opens the subscribed sources, and closes unused ones. A tap whose connection has ended is
    /// opened again.
    pub(super) fn follow(&mut self) {
        let subscribed = self.clients.values();
        let subscribed = subscribed.flat_map(|client| client.subscriptions.channels());
        let wanted = subscribed.filter_map(|channel| self.offers.channels.get(channel));
        let wanted = wanted.flat_map(|channel| channel.sources.iter().cloned());
        let wanted: BTreeSet<Source> = wanted.collect();
        self.opened.retain(|source, feed| {
            let stays = wanted.contains(source) && !self.observer.has_ended(*feed);
            if !stays {
                self.observer.close(*feed);
                self.feeds.remove(feed);
            }
            stays
        });
        self.refused.retain(|_, since| since.elapsed() < RETRY);
        self.follow_world(wanted.contains(&Source::World));
        for source in wanted {
            if self.opened.contains_key(&source) || self.refused.contains_key(&source) {
                continue;
            }
            let opened = match (self.offers.readings.get(&source), &source) {
                (Some(Reading::Topic(topic)), _) => self.observer.open(topic),
                (
                    Some(Reading::Calls { .. }),
                    Source::Calls {
                        component, slot, ..
                    },
                ) => self.observer.tap(component, slot),
                _ => continue,
            };
            match opened {
                Ok(feed) => {
                    self.feeds.insert(feed, source.clone());
                    self.opened.insert(source, feed);
                }
                Err(error) => {
                    self.refused.insert(source, Instant::now());
                    self.tell(&error.to_string());
                }
            }
        }
    }

    /// Begins or ends to follow the world.
    fn follow_world(&mut self, is_wanted: bool) {
        if !is_wanted {
            self.world = None;
            return;
        }
        if self.world.as_ref().is_some_and(Teller::has_ended) {
            self.world = None;
            self.refused.insert(Source::World, Instant::now());
        }
        if self.world.is_some() || self.refused.contains_key(&Source::World) {
            return;
        }
        let wake = self.wake_world.try_clone();
        let wake = wake.map_err(|error| error.to_string());
        let begun = wake.and_then(|wake| Teller::begin(&self.options.network, wake));
        match begun {
            Ok(teller) => self.world = Some(teller),
            Err(error) => {
                self.refused.insert(Source::World, Instant::now());
                self.tell(&error);
            }
        }
    }

    /// Sends what is due of the world.
    pub(super) fn take_world(&mut self) {
        let time = self.now.unwrap_or_else(system_time);
        let due = self.world.as_mut().map(|world| world.due(time));
        let due = due
            .unwrap_or_else(|| Ok(Vec::new()))
            .unwrap_or_else(|problem| {
                self.tell(&problem);
                Vec::new()
            });
        for (part, data) in due {
            let form = Form::World(part);
            let channels = self.offers.channels.iter();
            let mut channels = channels.filter(|(_, channel)| channel.form == form);
            let Some((id, _)) = channels.next() else {
                continue;
            };
            for client in self.clients.values_mut() {
                if let Some(subscription) = client.subscriptions.id(*id) {
                    client.publish(protocol::message(subscription, time, &data));
                }
            }
        }
    }

    pub(super) fn take_messages(&mut self) {
        let Self {
            observer,
            feeds,
            offers,
            clients,
            time,
            now,
            ..
        } = self;
        let mut problems = Vec::new();
        observer.take(&mut |feed, observed| {
            if let Some((of_time, topic)) = time
                && *of_time == feed
            {
                if let Some(time) = topic.read(&observed) {
                    *now = Some(time);
                    let open = clients.values_mut().filter(|client| client.is_open());
                    open.for_each(|client| client.publish(protocol::time(time)));
                }
                return;
            }
            let Some(source) = feeds.get(&feed) else {
                return;
            };
            let Some(reading) = offers.readings.get(source) else {
                return;
            };
            let channels = offers.channels.iter();
            let channels = channels.filter(|(_, channel)| channel.sources.contains(source));
            let clients = clients.values_mut();
            let fits = deliver(reading, &observed, channels, clients, *now);
            if !fits && problems.len() < 8 {
                problems.push(source.clone());
            }
        });
        for source in problems {
            self.tell(&format!(
                "a message of {source} does not fit its description"
            ));
        }
    }
}
