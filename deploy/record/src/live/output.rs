//! The shared output of all feeds of a recording: channels, counts and times.

use super::poll::Snapshot;
use super::recording_clock::RecordingClock;
use crate::chains::KIND;
use crate::content::{AttachedFile, NewChannel};
use crate::schema::Schema;
use crate::sink::Sink;
use crate::writer::TABLE;
use crate::{ENCAPSULATION, keys, qos};
use rc_management::chains::ChainStatus;
use rc_management::component::{Parameters, Status};
use rc_management::supervisor::Event;
use rc_mcap::Stamp;
use rc_middleware::Qos;
use rc_middleware::{Writer, now};
use serde_json::{Value as Json, json};
use std::collections::BTreeMap;

/// How many senders of a topic have channels of their own. Later ones share one.
const SENDERS: usize = 64;

/// How far a recording is.
#[derive(Clone, Copy, Debug, Default)]
pub struct Progress {
    /// The number of messages.
    pub messages: u64,
    /// Their bytes.
    pub bytes: u64,
    /// Messages that were lost before they were recorded.
    pub lost: u64,
    /// Messages that no description fits.
    pub unread: u64,
    /// The number of topics and of slots whose calls are recorded.
    pub feeds: usize,
}

/// Which messages share a channel: those of one topic, one type and one sender.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct ChannelKey {
    topic: String,
    hash: u64,
    sender: u128,
}

impl ChannelKey {
    pub(super) fn new(topic: &str, hash: u64, sender: u128) -> Self {
        Self {
            topic: topic.to_owned(),
            hash,
            sender,
        }
    }
}

pub(super) struct Output {
    network: String,
    pub(super) sink: Sink,
    pub(super) progress: Progress,
    /// The time of the network, if it is simulated.
    pub(super) simulated: Option<u64>,
    clock: RecordingClock,
    channels: BTreeMap<ChannelKey, usize>,
    senders: BTreeMap<(String, u64), usize>,
    json: BTreeMap<String, usize>,
    lost: BTreeMap<String, u64>,
    refused: u64,
    chains: BTreeMap<String, ChainStatus>,
    parameters: BTreeMap<String, Parameters>,
    states: BTreeMap<String, Json>,
    files: BTreeMap<String, Vec<u8>>,
}

impl Output {
    pub(super) fn new(network: &str, sink: Sink) -> Self {
        Self {
            network: network.to_owned(),
            sink,
            progress: Progress::default(),
            simulated: None,
            clock: RecordingClock::begin(),
            channels: BTreeMap::new(),
            senders: BTreeMap::new(),
            json: BTreeMap::new(),
            lost: BTreeMap::new(),
            refused: 0,
            chains: BTreeMap::new(),
            parameters: BTreeMap::new(),
            states: BTreeMap::new(),
            files: BTreeMap::new(),
        }
    }

    /// The channel of this key. `new` makes it, with the text of its sender if it has its own.
    pub(super) fn channel(
        &mut self,
        mut key: ChannelKey,
        new: impl FnOnce(Option<String>) -> NewChannel,
    ) -> usize {
        if let Some(at) = self.channels.get(&key) {
            return *at;
        }
        let senders = self.senders.entry((key.topic.clone(), key.hash));
        let senders = senders.or_default();
        if *senders >= SENDERS {
            key.sender = 0;
            if let Some(at) = self.channels.get(&key) {
                return *at;
            }
        }
        *senders += 1;
        let sender = (key.sender != 0).then(|| format!("{:032x}", key.sender));
        let at = self.sink.channel(new(sender));
        self.channels.insert(key, at);
        at
    }

    /// The times of a message. `sent` is that of the monotonic clock of its sender, 0 if unknown.
    pub(super) fn stamp(&mut self, sent: u64, is_here: bool, sequence: u64) -> Stamp {
        let (log_time, system) = self.times();
        let age = now().saturating_sub(sent);
        let sent = if sent == 0 || !is_here {
            system
        } else {
            system.saturating_sub(age)
        };
        Stamp {
            log_time,
            publish_time: self.simulated.unwrap_or(sent),
            sequence: sequence as u32,
        }
    }

    /// The time of the recording and that of the system. Says in the recording when the clock of
    /// the system was set.
    fn times(&mut self) -> (u64, u64) {
        let times = self.clock.now();
        if let Some(step) = times.step {
            let step = json!({
                "stepped_s": step as f64 / 1e9,
                "system_time_s": times.system as f64 / 1e9,
            });
            self.json("clock", "clock", &step);
        }
        (times.recording, times.system)
    }

    pub(super) fn put(&mut self, at: usize, stamp: Stamp, data: Vec<u8>, address: &str) {
        let length = data.len() as u64;
        if self.sink.message(at, stamp, data) {
            self.progress.messages += 1;
            self.progress.bytes += length;
        } else {
            self.note_loss(address, 1);
        }
    }

    /// Counts messages that are lost, and says so in the recording.
    pub(super) fn note_loss(&mut self, address: &str, count: u64) {
        if count == 0 {
            return;
        }
        self.progress.lost += count;
        let total = self.lost.entry(address.to_owned()).or_default();
        *total += count;
        let loss = json!({ "topic": address, "lost": count, "total": *total });
        self.json("loss", "loss", &loss);
    }

    /// Says that a call was refused: its reply has no type.
    pub(super) fn refused(&mut self, address: &str, reason: &str) {
        self.refused += 1;
        let refusal = json!({ "address": address, "reason": reason });
        self.json("refused", "refused", &refusal);
    }

    pub(super) fn event(&mut self, event: &Event) {
        let document = serde_json::to_value(event).unwrap_or_default();
        self.json("events", "events", &document);
    }

    /// Adds a document as JSON in a `std_msgs/msg/String`, which every tool of ROS 2 reads.
    fn json(&mut self, topic: &str, kind: &str, document: &Json) {
        let name = format!("/{}/{topic}", self.network);
        let at = if let Some(at) = self.json.get(&name) {
            *at
        } else {
            let at = self.sink.channel(document_channel(&name, kind));
            self.json.insert(name, at);
            at
        };
        let (log_time, system) = self.times();
        let stamp = Stamp {
            log_time,
            publish_time: self.simulated.unwrap_or(system),
            sequence: 0,
        };
        let mut writer = Writer::over(ENCAPSULATION.to_vec());
        // JSON has no NUL.
        rc_middleware::cdr::text(&document.to_string(), &mut writer);
        // A full queue loses it as it loses messages; the count of these says so.
        self.sink.message(at, stamp, writer.into_bytes());
    }

    /// Records what has changed since the last look: parameters, states, chains, and the files that
    /// say what runs.
    pub(super) fn note(&mut self, found: &Snapshot) {
        for chain in &found.chains {
            if self.chains.get(&chain.name) != Some(chain) {
                let document = serde_json::to_value(chain).unwrap_or_default();
                self.json(&format!("chains/{}", chain.name), KIND, &document);
                self.chains.insert(chain.name.clone(), chain.clone());
            }
        }
        if let Some((name, text)) = &found.ddsl {
            self.attach(name, "text/plain", text.clone().into_bytes());
        }
        for (component, listed) in &found.parameters {
            if self.parameters.get(component) != Some(listed) {
                let document = serde_json::to_value(listed).unwrap_or_default();
                self.json(&format!("{component}/parameters"), "parameters", &document);
                let file = found.configurations.get(component);
                self.attach_configuration(component, file, &document);
                self.parameters.insert(component.clone(), listed.clone());
            }
        }
        for component in &found.network.components {
            let text = serde_json::to_vec(&component.described).unwrap_or_default();
            let name = format!("{}.described.json", component.name);
            self.attach(&name, "application/json", text);
            let state = state(&component.status);
            if self.states.get(&component.name) != Some(&state) {
                self.json(&format!("{}/state", component.name), "state", &state);
                self.states.insert(component.name.clone(), state);
            }
        }
    }

    /// The configuration file of a component on this machine, unless it holds secrets: then the
    /// parameters as they are shown.
    fn attach_configuration(&mut self, component: &str, file: Option<&String>, shown: &Json) {
        if let Some(text) = file {
            let text = text.clone().into_bytes();
            self.attach(&format!("{component}.toml"), "application/toml", text);
        } else {
            let name = format!("{component}.parameters.json");
            self.attach(&name, "application/json", shown.to_string().into_bytes());
        }
    }

    fn attach(&mut self, name: &str, media_type: &'static str, data: Vec<u8>) {
        if self.files.get(name) == Some(&data) {
            return;
        }
        let file = AttachedFile {
            name: name.to_owned(),
            media_type,
            data: data.clone(),
        };
        // Without room it is tried again at the next look.
        if self.sink.attach(file) {
            self.files.insert(name.to_owned(), data);
        }
    }

    /// Adds the counts at the end.
    pub(super) fn conclude(&mut self) {
        let lost = self.lost.iter();
        let lost = lost.map(|(address, count)| (format!("lost {address}"), count.to_string()));
        let mut table: BTreeMap<String, String> = lost.collect();
        table.insert("network".to_owned(), self.network.clone());
        for (name, count) in [
            ("messages", self.progress.messages),
            ("lost", self.progress.lost),
            ("unread", self.progress.unread),
            ("refused", self.refused),
        ] {
            table.insert(name.to_owned(), count.to_string());
        }
        self.sink.table(TABLE, table);
    }
}

/// A channel of documents.
fn document_channel(topic: &str, kind: &str) -> NewChannel {
    let metadata = [
        (keys::KIND.to_owned(), kind.to_owned()),
        (keys::QOS.to_owned(), qos::profile(&Qos::PUBLISHER)),
    ];
    NewChannel {
        topic: topic.to_owned(),
        encoding: "cdr",
        schema: Some(Schema {
            name: "std_msgs/msg/String".to_owned(),
            encoding: "ros2msg".to_owned(),
            text: b"string data\n".to_vec(),
        }),
        metadata: metadata.into(),
    }
}

/// Activity of a component as JSON: state, life cycle and state machine.
fn state(status: &Status) -> Json {
    let mut state = json!({ "pid": status.pid, "state": status.state });
    if let Some(lifecycle) = &status.lifecycle {
        state["lifecycle"] = json!(lifecycle);
    }
    if let Some(machine) = &status.machine {
        state["states"] = json!(machine.states);
        state["transitions"] = json!(machine.transitions);
    }
    state
}
