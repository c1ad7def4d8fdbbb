//! A replica of a shared world. The component that has it passes messages in and out.

use crate::elements::{Edge, Node};
use crate::steps::{End, Kinds, Step, take_step, value};
use crate::{Snapshot, refused, values};
use graph_query::Queries;
use property_graph::schema::Schema;
use property_graph::{Change, Element, Frame, Time, Value};
use pyo3::exceptions::{PyKeyError, PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyTuple};
use rc_middleware::{Reader, Writer};
use rc_world::{Error, Message, Rights, STATE, STREAM, Setup, Steady, Watch};
use std::collections::BTreeMap;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

/// How many messages are handed out in a turn at most.
const MOST_A_TURN: usize = 64;

/// A replica of the world.
#[pyclass(frozen, module = "robocomp._graph")]
pub(crate) struct World {
    inner: rc_world::World,
    schema: Arc<Schema>,
    queries: Arc<Queries>,
    time: Arc<AtomicU64>,
    state: Mutex<State>,
}

struct State {
    steady: Steady,
    news: rc_world::Reader,
    watch: Watch,
}

/// What has changed of a type: new elements, those with other attributes, and those that are gone.
type OfType<'py> = (
    Vec<Bound<'py, PyAny>>,
    Vec<(Bound<'py, PyAny>, Vec<String>)>,
    Vec<Bound<'py, PyAny>>,
);

/// One change: what, the element, and its attributes that have other values.
type Changed<'py> = (&'static str, Bound<'py, PyAny>, Vec<String>);

/// The versions before and after, what has changed of each type, and all changes.
type News<'py> = (Snapshot, Snapshot, Vec<OfType<'py>>, Vec<Changed<'py>>);

/// What a component tells its supervisor: behind, for how many milliseconds, conflicts, the first of
/// them, the fault, refused messages, why the last one was, who is silent, and
/// how many more are.
type ReplicaReport = (
    u64,
    u64,
    u64,
    Vec<String>,
    Option<String>,
    u64,
    String,
    Vec<String>,
    u64,
);

impl World {
    fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn of(&self, now: Arc<property_graph::Snapshot>) -> Snapshot {
        Snapshot {
            now,
            schema: Arc::clone(&self.schema),
            queries: Arc::clone(&self.queries),
        }
    }

    fn end(&self, value: &Bound<'_, PyAny>, kinds: &Kinds) -> PyResult<End> {
        if let Ok(node) = value.cast::<Node>() {
            return Ok(End::Known(node.get().id_in(&self.inner.snapshot())?.into()));
        }
        if let Ok(edge) = value.cast::<Edge>() {
            return Ok(End::Known(edge.get().id_in(&self.inner.snapshot())?.into()));
        }
        if let Ok(number) = value.extract::<usize>() {
            let message = "the element is not made by this change";
            let is_made = kinds.contains_key(&number);
            let end = is_made.then_some(End::New(number));
            return end.ok_or_else(|| PyValueError::new_err(message));
        }
        let kind = value.get_type().name()?;
        let message = format!("expected a node or an edge of this world, found {kind}");
        Err(PyTypeError::new_err(message))
    }

    /// A node at which an edge ends.
    fn node(&self, value: &Bound<'_, PyAny>, kinds: &Kinds) -> PyResult<End> {
        let end = self.end(value, kinds)?;
        let is_edge = match end {
            End::Known(element) => matches!(element, Element::Edge(_)),
            End::New(at) => kinds.get(&at).is_some_and(|(_, is_edge)| *is_edge),
        };
        if is_edge {
            let message = "an edge leads from a node to a node";
            return Err(PyTypeError::new_err(message));
        }
        Ok(end)
    }

    /// A value for an attribute of an element.
    fn value(
        &self,
        end: End,
        name: &str,
        given: &Bound<'_, PyAny>,
        kinds: &Kinds,
    ) -> PyResult<Value> {
        let now = self.inner.snapshot();
        let kind = match end {
            End::Known(Element::Node(node)) => now.node(node).map(|node| node.type_name()),
            End::Known(Element::Edge(edge)) => now.edge(edge).map(|edge| edge.type_name()),
            End::New(at) => Ok(kinds.get(&at).map_or("", |(kind, _)| kind.as_str())),
        };
        let kind = kind.map_err(|error| refused(&error))?;
        let declared = self.schema.attributes(kind).unwrap_or_default();
        let declared = declared.iter().find(|own| own.name == name);
        value(given, declared.map(|own| &own.kind))
    }

    fn step(&self, at: usize, step: &Bound<'_, PyTuple>, kinds: &mut Kinds) -> PyResult<Step> {
        let what: String = step.get_item(0)?.extract()?;
        let text = |at: usize| step.get_item(at)?.extract::<String>();
        let end = |at: usize, kinds: &Kinds| self.end(&step.get_item(at)?, kinds);
        let node = |at: usize, kinds: &Kinds| self.node(&step.get_item(at)?, kinds);
        Ok(match what.as_str() {
            "node" => {
                kinds.insert(at, (text(1)?, false));
                Step::AddNode(text(1)?)
            }
            "edge" => {
                let (from, to) = (node(2, kinds)?, node(3, kinds)?);
                kinds.insert(at, (text(1)?, true));
                Step::AddEdge(text(1)?, from, to)
            }
            "set" => {
                let (of, name) = (end(1, kinds)?, text(2)?);
                let value = self.value(of, &name, &step.get_item(3)?, kinds)?;
                Step::Set(of, name, value)
            }
            "unset" => Step::Unset(end(1, kinds)?, text(2)?),
            _ => Step::Remove(end(1, kinds)?),
        })
    }
}

#[pymethods]
impl World {
    /// A replica that is empty so far. `files` are those of the component's schema, `network` those of the
    /// network's, if that has more. `rights` are types, or types with attributes, and the least time
    /// between two values of a stream in nanoseconds; `None` for everything.
    #[new]
    #[expect(
        clippy::needless_pass_by_value,
        reason = "a list in Python is not a slice"
    )]
    fn new(
        name: &str,
        writer: u64,
        now_ns: u64,
        files: Vec<(String, String)>,
        network: Vec<(String, String)>,
        rights: Option<Vec<(String, Option<String>, Option<u64>)>>,
    ) -> PyResult<Self> {
        let schema = graph_language::of_component(&files, &network);
        let schema = Arc::new(schema.map_err(PyValueError::new_err)?);
        let rights = rights.map_or_else(Rights::everything, |all| {
            let all = all.into_iter();
            all.fold(
                Rights::nothing(),
                |rights, (kind, attribute, stream)| match (attribute, stream) {
                    (None, _) => rights.with_type(&kind),
                    (Some(attribute), None) => rights.with_attribute(&kind, &attribute),
                    (Some(attribute), Some(each)) => {
                        rights.with_stream(&kind, &attribute, Duration::from_nanos(each))
                    }
                },
            )
        });
        let time = Arc::new(AtomicU64::new(now_ns));
        let clock = Arc::clone(&time);
        let setup = Setup::new(name, Arc::clone(&schema))
            .with_rights(rights)
            // 0 is nobody, and the start of a world has 1.
            .with_writer(writer.max(2))
            .with_clock(move || Time::from_nanos(clock.load(Ordering::Relaxed)));
        let inner = rc_world::World::new(setup);
        let state = State {
            steady: Steady::new(Duration::from_nanos(now_ns)),
            news: inner.reader(),
            watch: Watch::default(),
        };
        Ok(Self {
            queries: Arc::new(Queries::of(&schema)),
            inner,
            schema,
            time,
            state: Mutex::new(state),
        })
    }

    /// Takes a sample of a topic of `World`, or of `WorldStream`.
    fn receive(&self, py: Python<'_>, is_stream: bool, topic: usize, body: &[u8]) -> PyResult<()> {
        let topics: &[rc_world::Topic] = if is_stream { &STREAM } else { &STATE };
        let topic = topics
            .get(topic)
            .ok_or_else(|| PyValueError::new_err("a world has no such topic"))?;
        let message = Message::decode(*topic, &mut Reader::new(body));
        let message = message.map_err(|error| refused(&error))?;
        let now = self.state().steady.time();
        py.detach(|| self.inner.receive(now, message));
        Ok(())
    }

    /// Does what is due at a time of the network's clock.
    fn turn(&self, py: Python<'_>, now_ns: u64) {
        self.time.store(now_ns, Ordering::Relaxed);
        let mut state = self.state();
        state.steady.follow(Duration::from_nanos(now_ns));
        let now = state.steady.time();
        drop(state);
        py.detach(|| self.inner.turn(now));
    }

    /// Messages to publish: whether of `WorldStream`, the number of the topic, and the sample.
    fn take<'py>(&self, py: Python<'py>) -> PyResult<Vec<(bool, usize, Bound<'py, PyBytes>)>> {
        let messages = std::iter::from_fn(|| self.inner.take()).take(MOST_A_TURN);
        let one = |message: Message| {
            let topic = message.topic();
            let stream = STREAM.iter().position(|own| *own == topic);
            let state = STATE.iter().position(|own| *own == topic);
            let mut writer = Writer::default();
            message.encode(&mut writer);
            writer.finish().map_err(|error| refused(&error))?;
            let at = stream.or(state).unwrap_or_default();
            Ok((stream.is_some(), at, PyBytes::new(py, &writer.into_bytes())))
        };
        messages.map(one).collect()
    }

    /// Says goodbye.
    fn leave(&self) {
        self.inner.leave();
    }

    /// The faults of the replica, if it is time to look.
    fn look(&self) -> Option<ReplicaReport> {
        let mut state = self.state();
        let now = state.steady.time();
        let seen = state.watch.look(&self.inner, now)?;
        let health = seen.health;
        Some((
            health.behind,
            u64::try_from(seen.behind_for.as_millis()).unwrap_or(u64::MAX),
            health.conflicts as u64,
            health.first_conflicts,
            health.fault,
            health.refused,
            health.last_refusal,
            seen.silent,
            seen.more_silent as u64,
        ))
    }

    /// The present version.
    fn snapshot(&self) -> Snapshot {
        self.of(self.inner.snapshot())
    }

    /// What has changed of these types since the last call: the versions before and after it, for each
    /// type what has changed, and with `every` all changes in their order. `None` if nothing has.
    fn news<'py>(
        &self,
        py: Python<'py>,
        kinds: Vec<String>,
        every: bool,
    ) -> PyResult<Option<News<'py>>> {
        let news = self.inner.news(&mut self.state().news);
        let Some(news) = news else { return Ok(None) };
        let (before, after) = (&news.before, &news.after);
        let many = |now: &Arc<property_graph::Snapshot>, all: &[Element]| {
            let all = all.iter().map(|element| object(py, now, *element));
            all.collect::<PyResult<Vec<_>>>()
        };
        let all = kinds.into_iter().map(|kind| {
            let of = news.of(&kind);
            let changed = of.changed.iter().map(|(element, names)| {
                let names = names.iter().map(|name| after.text(*name).to_owned());
                Ok((object(py, after, *element)?, names.collect()))
            });
            Ok((
                many(after, &of.added)?,
                changed.collect::<PyResult<Vec<_>>>()?,
                many(before, &of.removed)?,
            ))
        });
        let all = all.collect::<PyResult<Vec<_>>>()?;
        let every = if every {
            changes(py, &news)?
        } else {
            Vec::new()
        };
        let (before, after) = (self.of(Arc::clone(before)), self.of(Arc::clone(after)));
        Ok(Some((before, after, all, every)))
    }

    /// Makes a change of several steps. Returns its token and the elements that are new, by the numbers of
    /// their steps.
    fn change<'py>(
        &self,
        py: Python<'py>,
        now_ns: u64,
        steps: Vec<Bound<'py, PyTuple>>,
    ) -> PyResult<(String, BTreeMap<usize, Bound<'py, PyAny>>)> {
        self.time.store(now_ns, Ordering::Relaxed);
        let mut kinds = Kinds::new();
        let steps = steps.into_iter().enumerate();
        let steps = steps.map(|(at, step)| self.step(at, &step, &mut kinds));
        let steps = steps.collect::<PyResult<Vec<Step>>>()?;
        let mut made: BTreeMap<usize, Element> = BTreeMap::new();
        let changed = py.detach(|| {
            self.inner.change(|edit| {
                for (at, step) in steps.into_iter().enumerate() {
                    if let Some(new) = take_step(edit, step, &made)? {
                        made.insert(at, new);
                    }
                }
                Ok(())
            })
        });
        let token = changed.map_err(|error: Error| refused(&error))?;
        let now = self.inner.snapshot();
        let made = made.into_iter();
        let made = made.map(|(at, element)| Ok((at, object(py, &now, element)?)));
        Ok((token.to_string(), made.collect::<PyResult<_>>()?))
    }

    /// Whether this replica has the change of a token.
    fn has(&self, token: &str) -> PyResult<bool> {
        let token = token.parse().map_err(|error: Error| refused(&error))?;
        Ok(self.inner.has(token))
    }

    /// Whether this replica has what the others had when it joined, or is alone.
    fn has_joined(&self) -> bool {
        self.inner.has_joined()
    }

    /// The next value that another replica gave an attribute at the same time as this one: element,
    /// attribute, the value that is shown, the other one.
    #[allow(clippy::type_complexity, reason = "Python takes it apart")]
    fn overruled<'py>(
        &self,
        py: Python<'py>,
    ) -> PyResult<
        Option<(
            Bound<'py, PyAny>,
            String,
            Bound<'py, PyAny>,
            Bound<'py, PyAny>,
        )>,
    > {
        let now = self.inner.snapshot();
        while let Some(one) = self.inner.overruled() {
            // It may be gone meanwhile.
            let Some(element) = now.find(one.of) else {
                continue;
            };
            let value = |value: &Option<Value>| match value {
                Some(value) => values::of_value(py, value, &now),
                None => Ok(py.None().into_bound(py)),
            };
            let found = (
                object(py, &now, element)?,
                one.attribute.clone(),
                value(&one.shown)?,
                value(&one.other)?,
            );
            return Ok(Some(found));
        }
        Ok(None)
    }

    /// The hidden elements, each with the one that it loses against.
    fn conflicts(&self) -> Vec<String> {
        self.inner.health().first_conflicts
    }

    /// The time of the newest change, in nanoseconds of the network's clock.
    fn newest_ns(&self) -> u64 {
        let nanoseconds = self.inner.snapshot().time().as_nanos();
        nanoseconds.try_into().unwrap_or(u64::MAX)
    }

    /// The first three rows of the matrix from the frame of a node to that of another one, in metres, at
    /// a time. After the newest change, everything stays where it is.
    fn metres(&self, to: &str, from: &str, time_ns: u64) -> PyResult<Vec<f64>> {
        let transform = rc_world::transform(&self.inner, to, from, Time::from_nanos(time_ns));
        transform.map(Vec::from).map_err(PyValueError::new_err)
    }

    /// The matrix from the frame of a node to that of another one, by rows, at a time; `None` if the
    /// history begins later. Without a time, that of the present version.
    fn matrix(
        &self,
        to: &str,
        from: &str,
        time_ns: Option<u64>,
    ) -> PyResult<Option<Vec<Vec<f64>>>> {
        let transform = match time_ns {
            None => {
                let now = self.inner.snapshot();
                now.between(frame(&now, to)?, frame(&now, from)?)
            }
            Some(time) => match self.inner.at(Time::from_nanos(time)) {
                Ok(moment) => {
                    let then = moment.version();
                    moment.between(frame(then, to)?, frame(then, from)?)
                }
                Err(Error::Graph(property_graph::Error::TooEarly)) => return Ok(None),
                Err(error) => return Err(refused(&error)),
            },
        };
        let transform = transform.map_err(|error| refused(&error))?;
        let rows = transform.matrix();
        let row = |row: usize| (0..4).map(|column| rows[(row, column)]).collect();
        Ok(Some((0..4).map(row).collect()))
    }
}

/// All changes in their order: what, the element, and the attributes of one that has others.
fn changes<'py>(py: Python<'py>, news: &rc_world::News) -> PyResult<Vec<Changed<'py>>> {
    let (before, after) = (&news.before, &news.after);
    let mut all: Vec<Changed<'py>> = Vec::new();
    let mut places: BTreeMap<Element, usize> = BTreeMap::new();
    for change in &news.changes {
        let (what, of, element) = match change {
            Change::NodeRemoved(node, _) => ("removed", before, (*node).into()),
            Change::EdgeRemoved(edge, _) => ("removed", before, (*edge).into()),
            Change::NodeAdded(node) => ("added", after, (*node).into()),
            Change::EdgeAdded(edge) => ("added", after, (*edge).into()),
            Change::Attribute(element, name) => {
                let at = *places.entry(*element).or_insert(all.len());
                if at == all.len() {
                    all.push(("changed", object(py, after, *element)?, Vec::new()));
                }
                all[at].2.push(after.text(*name).to_owned());
                continue;
            }
        };
        all.push((what, object(py, of, element)?, Vec::new()));
    }
    Ok(all)
}

/// The frame of the only node with a name in a version.
fn frame(now: &property_graph::Snapshot, name: &str) -> PyResult<Frame> {
    let mut found = now.named(name);
    let node = match (found.next(), found.next()) {
        (Some(node), None) => node,
        (None, _) => {
            let message = format!("no node has the name {name:?}");
            return Err(PyKeyError::new_err(message));
        }
        _ => {
            let message = format!("several nodes have the name {name:?}");
            return Err(PyKeyError::new_err(message));
        }
    };
    now.frame(node).map_err(|error| refused(&error))
}

fn object<'py>(
    py: Python<'py>,
    now: &Arc<property_graph::Snapshot>,
    element: Element,
) -> PyResult<Bound<'py, PyAny>> {
    let now = Arc::clone(now);
    Ok(match element {
        Element::Node(id) => Bound::new(py, Node { now, id })?.into_any(),
        Element::Edge(id) => Bound::new(py, Edge { now, id })?.into_any(),
    })
}
