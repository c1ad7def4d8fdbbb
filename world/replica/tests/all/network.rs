//! A network of replicas in virtual time: messages are lost, repeated, late, and cut off.

use fastrand::Rng;
use property_graph::schema::{Attribute, Entity, Kind, Port, Relation};
use property_graph::{Schema, Time};
use rc_world::{Message, Rights, Setup, Topic, World};
use std::cmp::Reverse;
use std::collections::BTreeMap;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

/// A flat with doors and rooms. A door is in one room at most; names are keys.
pub(crate) fn flat() -> Arc<Schema> {
    let attribute = |name: &str, kind: Kind| Attribute {
        name: name.to_owned(),
        kind,
        unit: None,
        range: None,
        optional: true,
        key: false,
        history: None,
        doc: Vec::new(),
    };
    let name = Attribute {
        optional: false,
        key: true,
        ..attribute("name", Kind::Text)
    };
    let entity = |kind: &str, attributes: Vec<Attribute>| Entity {
        name: kind.to_owned(),
        attributes,
        ..Entity::default()
    };
    let port = |name: &str, entity: &str, max: Option<u32>| Port {
        name: name.to_owned(),
        entity: entity.to_owned(),
        min: 0,
        max,
    };
    let numbers = vec![
        name.clone(),
        attribute("width", Kind::Float),
        attribute("height", Kind::Float),
        attribute("pose", Kind::Floats(Some(3))),
    ];
    Arc::new(Schema {
        name: "flat".to_owned(),
        entities: vec![entity("door", numbers), entity("room", vec![name])],
        relations: vec![Relation {
            name: "in".to_owned(),
            ports: vec![port("what", "door", Some(1)), port("where", "room", None)],
            ..Relation::default()
        }],
        ..Schema::default()
    })
}

/// Faults of messages.
#[derive(Clone, Copy)]
pub(crate) struct Weather {
    /// In a hundred.
    pub(crate) lost: u32,
    /// In a hundred.
    pub(crate) repeated: u32,
    /// At most, in milliseconds.
    pub(crate) late: u64,
}

pub(crate) const CALM: Weather = Weather {
    lost: 0,
    repeated: 0,
    late: 1,
};

/// Replicas that send each other messages.
pub(crate) struct Network {
    pub(crate) worlds: Vec<Option<World>>,
    /// Replicas of different groups do not hear each other.
    pub(crate) groups: Vec<u8>,
    pub(crate) weather: Weather,
    pub(crate) now: Duration,
    pub(crate) random: Rng,
    /// How long a turn of all replicas takes, in milliseconds.
    pub(crate) turn: u64,
    /// How many bytes an answer has at most.
    most_answer: usize,
    /// By the time of arrival and a number.
    waiting: std::collections::BinaryHeap<Reverse<(Duration, u64, usize)>>,
    messages: BTreeMap<u64, Message>,
    number: u64,
    clock: Arc<AtomicU64>,
    writers: u64,
    /// How many messages of each topic were sent.
    pub(crate) sent: BTreeMap<Topic, usize>,
    /// All changes, also those that nobody got, as they were made.
    pub(crate) changes: Vec<Message>,
    /// Gets all messages when they are sent, and the time.
    pub(crate) listener: Option<Box<dyn FnMut(Duration, Message)>>,
}

impl Network {
    pub(crate) fn new(count: usize, weather: Weather, seed: u64) -> Self {
        Self::with_most_answer(count, weather, seed, usize::MAX)
    }

    pub(crate) fn with_most_answer(
        count: usize,
        weather: Weather,
        seed: u64,
        most_answer: usize,
    ) -> Self {
        let mut network = Self {
            worlds: Vec::new(),
            groups: vec![0; count],
            weather,
            now: Duration::ZERO,
            random: Rng::with_seed(seed),
            turn: 1,
            most_answer,
            waiting: std::collections::BinaryHeap::new(),
            messages: BTreeMap::new(),
            number: 0,
            clock: Arc::default(),
            writers: 100,
            sent: BTreeMap::new(),
            changes: Vec::new(),
            listener: None,
        };
        for at in 0..count {
            let world = network.world(at, Rights::everything());
            network.worlds.push(Some(world));
        }
        network
    }

    /// A new replica for a place, with another writer each time.
    pub(crate) fn world(&mut self, at: usize, rights: Rights) -> World {
        self.writers += 1;
        let clock = Arc::clone(&self.clock);
        let setup = Setup::new(&format!("agent{at}"), flat())
            .with_writer(self.writers)
            .with_rights(rights)
            .with_most_answer(self.most_answer)
            .with_clock(move || Time::from_millis(clock.load(Ordering::Relaxed)));
        World::new(setup)
    }

    pub(crate) fn at(&self, at: usize) -> &World {
        self.worlds[at].as_ref().expect("a living replica")
    }

    /// Kills a replica without a word. Returns it.
    pub(crate) fn kill(&mut self, at: usize) -> Option<World> {
        self.worlds[at].take()
    }

    pub(crate) fn living(&self) -> Vec<usize> {
        let all = self.worlds.iter().enumerate();
        all.filter_map(|(at, world)| world.as_ref().map(|_| at))
            .collect()
    }

    fn send(&mut self, from: usize, message: &Message) {
        *self.sent.entry(message.topic()).or_default() += 1;
        if message.topic() == Topic::Change {
            self.changes.push(message.clone());
        }
        if let Some(listener) = &mut self.listener {
            listener(self.now, through_bytes(message));
        }
        for to in self.living() {
            if to == from || self.groups[to] != self.groups[from] {
                continue;
            }
            let copies = 1 + u32::from(self.random.u32(..100) < self.weather.repeated);
            for _ in 0..copies {
                if self.random.u32(..100) < self.weather.lost {
                    continue;
                }
                let late = Duration::from_millis(1 + self.random.u64(..self.weather.late));
                self.number += 1;
                self.messages.insert(self.number, through_bytes(message));
                let due = (self.now + late, self.number, to);
                self.waiting.push(Reverse(due));
            }
        }
    }

    /// Lets time pass.
    pub(crate) fn run(&mut self, duration: Duration) {
        let end = self.now + duration;
        while self.now < end {
            self.now += Duration::from_millis(self.turn);
            let millis = self.now.as_millis() as u64;
            self.clock.store(millis, Ordering::Relaxed);
            while let Some(Reverse((due, number, to))) = self.waiting.peek().copied() {
                if due > self.now {
                    break;
                }
                self.waiting.pop();
                let message = self.messages.remove(&number).expect("a message");
                if let Some(world) = &self.worlds[to] {
                    world.receive(self.now, message);
                }
            }
            for at in self.living() {
                self.at(at).turn(self.now);
                while let Some(message) = self.worlds[at].as_ref().and_then(World::take) {
                    self.send(at, &message);
                }
            }
        }
    }

    /// Lets time pass until all living replicas are equal. Returns how long that took.
    pub(crate) fn converge(&mut self, limit: Duration) -> Duration {
        let start = self.now;
        while self.now < start + limit {
            self.run(Duration::from_millis(50));
            if self.is_equal() {
                return self.now.saturating_sub(start);
            }
        }
        let living = self.living();
        let states = living.iter().map(|at| self.at(*at).status(self.now));
        panic!(
            "not equal after {limit:?}: {:#?}",
            states.collect::<Vec<_>>()
        );
    }

    pub(crate) fn is_equal(&self) -> bool {
        let living = self.living();
        let mut states = living.iter().map(|at| {
            let status = self.at(*at).status(self.now);
            (status.digest, status.streams, status.elements)
        });
        let first = states.next();
        states.all(|state| Some(state) == first)
    }
}

/// The message as another process gets it.
pub(crate) fn through_bytes(message: &Message) -> Message {
    let mut writer = rc_middleware::Writer::default();
    message.encode(&mut writer);
    let bytes = writer.into_bytes();
    let mut reader = rc_middleware::Reader::new(&bytes);
    let read = Message::decode(message.topic(), &mut reader).expect("a message");
    assert_eq!(&read, message);
    read
}

/// Adds a node with a name.
pub(crate) fn add(world: &World, kind: &str, name: &str) -> rc_world::Token {
    let made = world.change(|edit| {
        let node = edit.add_node(kind)?;
        edit.set(node, "name", name)?;
        Ok(())
    });
    made.expect("a sound change")
}
