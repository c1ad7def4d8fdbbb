//! The state of the view: no input, no output, no clock.

use super::rows::{self, Row};
use rc_management::chains::ChainStatus;
use rc_management::component::{Parameters, Role, SlotStatus, Status, Timing};
use rc_management::lifecycle::LifecycleState;
use rc_management::supervisor::{ComponentState, ComponentStatus, Event, NetworkStatus, Verb};
use serde_json::Value;
use std::collections::{BTreeSet, VecDeque};
use std::time::Duration;

/// How many events are kept.
const EVENTS: usize = 1000;
/// How many lines of a log are kept.
pub(crate) const LOG: usize = 2000;
/// A component that has not answered for this long is shown as silent.
const SILENCE: Duration = Duration::from_secs(3);

/// The command that shows the view.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Host {
    /// `rcdeploy up`: leaving the view stops the network.
    Up,
    /// `rcdeploy top`: the network continues without the view.
    Top,
}

/// The state of the view.
#[derive(Debug)]
pub(crate) struct Model {
    pub(crate) host: Host,
    pub(crate) network: String,
    /// Whether colours may be used.
    pub(crate) colours: bool,
    /// Columns and lines of the terminal.
    pub(crate) size: (u16, u16),
    pub(crate) components: Vec<Component>,
    /// The chains, as the supervisor measures them.
    pub(crate) chains: Vec<ChainStatus>,
    pub(crate) events: VecDeque<Event>,
    /// By how many lines the events are scrolled up. 0 follows new events.
    pub(crate) events_scroll: usize,
    /// The name of the component or of the group.
    pub(crate) selected: String,
    pub(crate) folded: BTreeSet<String>,
    pub(crate) page: Page,
    pub(crate) prompt: Option<Prompt>,
    /// The result of the last command.
    pub(crate) notice: Option<StatusLine>,
    pub(crate) log: VecDeque<String>,
    pub(crate) parameters: Option<Result<Parameters, String>>,
    /// The selected line of the page, or by how many lines it is scrolled. A log is scrolled from
    /// its end.
    pub(crate) line: usize,
    /// The network is being stopped.
    pub(crate) stopping: bool,
}

/// The page on the screen.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Page {
    /// Components and events.
    Table,
    /// The log of the selected component.
    Log,
    /// The parameters of the selected component.
    Parameters,
    /// Slots of the component, and their peers.
    Connections,
    /// The keys.
    Help,
}

/// A question to the user.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Prompt {
    /// Yes or no.
    Confirm { question: String, command: Command },
    /// A new value of a parameter.
    Edit {
        path: String,
        text: String,
        is_text: bool,
        secret: bool,
        /// Nothing was typed yet: the text is the present value.
        is_old: bool,
    },
}

/// A command for the session.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Command {
    /// Leaves the view. `interrupt`: as Ctrl-C does without a view.
    Quit { interrupt: bool },
    /// Redraws the screen, after another program has written to the terminal.
    Redraw,
    /// Starts, stops or restarts a component or a group.
    Control { verb: Verb, name: String },
    /// Starts or ends the emergency state of components.
    Emergency { names: Vec<String>, active: bool },
    /// Changes a parameter.
    Set {
        name: String,
        path: String,
        value: Value,
    },
    /// Saves changed parameters.
    Save { name: String },
}

/// A line below everything.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct StatusLine {
    pub(crate) text: String,
    pub(crate) failed: bool,
}

/// One component.
#[derive(Clone, Debug)]
pub(crate) struct Component {
    pub(crate) status: ComponentStatus,
    /// Last status of the component, while it runs.
    pub(crate) report: Option<Status>,
    /// Per second, for each slot of the report.
    pub(crate) rates: Vec<Rate>,
    pub(crate) usage: Usage,
    /// Whether it runs without answering.
    pub(crate) silent: bool,
    heard: Option<Duration>,
    sampled: Option<(Sample, Duration)>,
}

/// Rates of a slot per second.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Rate {
    pub(crate) handled: f64,
    pub(crate) sent: f64,
}

/// The resources of a process, from the system.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Sample {
    /// Time on a processor, since its start.
    pub(crate) busy: Duration,
    /// Bytes in memory.
    pub(crate) memory: u64,
}

/// The load of a process.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Usage {
    /// Processors: 1 is one of them.
    pub(crate) cpu: Option<f64>,
    /// Bytes in memory.
    pub(crate) memory: Option<u64>,
}

/// Figures of one or several components in the table.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Figures {
    /// Seconds since the start of a single component that runs.
    pub(crate) uptime: Option<f64>,
    pub(crate) usage: Usage,
    /// Values and calls per second; none for components that do not answer.
    pub(crate) traffic: Option<Traffic>,
    pub(crate) compute: Option<Timing>,
    /// The slot with the longest times.
    pub(crate) handlers: Option<Timing>,
    pub(crate) restarts: u32,
    pub(crate) lost: u64,
}

/// Per second.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Traffic {
    pub(crate) values_in: f64,
    pub(crate) values_out: f64,
    /// Calls that it makes or answers.
    pub(crate) calls: f64,
}

impl Component {
    /// Whether it works: it is not managed, or active.
    pub(crate) fn is_active(&self) -> bool {
        let lifecycle = self.status.lifecycle;
        lifecycle.is_none_or(|state| state == LifecycleState::Active)
    }

    /// The state of its life cycle in the width of the column of states.
    pub(crate) fn lifecycle_word(&self) -> String {
        let word = self.status.lifecycle.map_or("", LifecycleState::word);
        match word.len() {
            0..=9 => word.to_owned(),
            _ => format!("{}…", &word[..8]),
        }
    }

    fn new(status: ComponentStatus) -> Self {
        Self {
            status,
            report: None,
            rates: Vec::new(),
            usage: Usage::default(),
            silent: false,
            heard: None,
            sampled: None,
        }
    }

    /// Figures in the component's row of the table.
    pub(crate) fn figures(&self) -> Figures {
        let lost = self.status.lost.values().sum();
        let mut figures = Figures {
            uptime: self.status.uptime_s,
            usage: self.usage,
            restarts: self.status.restarts,
            lost,
            ..Figures::default()
        };
        let Some(report) = self.report.as_ref().filter(|_| !self.silent) else {
            return figures;
        };
        figures.compute = Some(report.compute).filter(|work| work.count > 0);
        let used = report.slots.iter().map(|slot| slot.handlers);
        figures.handlers = used
            .filter(|work| work.count > 0)
            .max_by_key(|work| work.p99_us);
        if !self.rates.is_empty() || report.slots.is_empty() {
            let mut traffic = Traffic::default();
            for (slot, rate) in report.slots.iter().zip(&self.rates) {
                match slot.role {
                    Role::SubscribesTo => traffic.values_in += rate.handled,
                    Role::Publishes => traffic.values_out += rate.sent,
                    Role::Implements => traffic.calls += rate.handled,
                    Role::Requires => traffic.calls += rate.sent,
                }
            }
            figures.traffic = Some(traffic);
        }
        figures
    }
}

impl Figures {
    /// Sums over several components, and the longest of their times.
    pub(crate) fn of<'c>(components: impl IntoIterator<Item = &'c Component>) -> Self {
        let longer =
            |a: Option<Timing>, b: Option<Timing>| a.into_iter().chain(b).max_by_key(|w| w.p99_us);
        let each = components.into_iter().map(Component::figures);
        each.reduce(|a, b| Self {
            uptime: None,
            usage: Usage {
                cpu: sum(a.usage.cpu, b.usage.cpu, |a, b| a + b),
                memory: sum(a.usage.memory, b.usage.memory, |a, b| a + b),
            },
            traffic: sum(a.traffic, b.traffic, |a, b| Traffic {
                values_in: a.values_in + b.values_in,
                values_out: a.values_out + b.values_out,
                calls: a.calls + b.calls,
            }),
            compute: longer(a.compute, b.compute),
            handlers: longer(a.handlers, b.handlers),
            restarts: a.restarts + b.restarts,
            lost: a.lost + b.lost,
        })
        .unwrap_or_default()
    }
}

fn sum<T>(a: Option<T>, b: Option<T>, add: impl FnOnce(T, T) -> T) -> Option<T> {
    match (a, b) {
        (Some(a), Some(b)) => Some(add(a, b)),
        (a, b) => a.or(b),
    }
}

impl Model {
    pub(crate) fn new(host: Host, network: &str, colours: bool) -> Self {
        Self {
            host,
            network: network.to_owned(),
            colours,
            size: (80, 24),
            components: Vec::new(),
            chains: Vec::new(),
            events: VecDeque::new(),
            events_scroll: 0,
            selected: String::new(),
            folded: BTreeSet::new(),
            page: Page::Table,
            prompt: None,
            notice: None,
            log: VecDeque::new(),
            parameters: None,
            line: 0,
            stopping: false,
        }
    }

    /// Takes the status of the network.
    pub(crate) fn status(&mut self, status: NetworkStatus) {
        let mut known = std::mem::take(&mut self.components);
        for status in status.components {
            let at = known.iter().position(|c| c.status.name == status.name);
            let component = match at.map(|at| known.swap_remove(at)) {
                Some(old) if old.status.pid == status.pid => Component { status, ..old },
                _ => Component::new(status),
            };
            self.components.push(component);
        }
        // The supervisor does not know these.
        let known = known.into_iter().filter(|c| c.status.by_hand);
        self.components.extend(known);
        self.select_something();
    }

    /// Takes the status of a component that was started by hand.
    pub(crate) fn by_hand(&mut self, status: ComponentStatus) {
        match self.find_mut(&status.name) {
            Some(known) if known.status.pid == status.pid => known.status = status,
            Some(known) => *known = Component::new(status),
            None => self.components.push(Component::new(status)),
        }
        self.select_something();
    }

    /// Removes a component that was started by hand and has ended.
    pub(crate) fn remove(&mut self, name: &str) {
        self.components.retain(|c| c.status.name != name);
        self.select_something();
    }

    fn select_something(&mut self) {
        if self.row().is_none() {
            let first = self.rows().first().map(|row| row.path.to_owned());
            self.selected = first.unwrap_or_default();
        }
    }

    /// Takes the status of a component.
    pub(crate) fn report(&mut self, name: &str, report: Status, now: Duration) {
        let Some(component) = self.find_mut(name) else {
            return;
        };
        if let (Some(old), Some(heard)) = (&component.report, component.heard) {
            let seconds = now.saturating_sub(heard).as_secs_f64().max(1e-3);
            let per_second = |new: u64, old: u64| new.saturating_sub(old) as f64 / seconds;
            let slots = report.slots.iter().zip(&old.slots);
            component.rates = slots
                .map(|(new, old)| Rate {
                    handled: per_second(new.handlers.count, old.handlers.count),
                    sent: per_second(new.sent, old.sent),
                })
                .collect();
        }
        component.heard = Some(now);
        component.silent = false;
        component.report = Some(report);
    }

    /// Takes the resources of a component's process, if it has one.
    pub(crate) fn sample(&mut self, name: &str, sample: Option<Sample>, now: Duration) {
        let Some(component) = self.find_mut(name) else {
            return;
        };
        let Some(sample) = sample else {
            component.usage = Usage::default();
            component.sampled = None;
            return;
        };
        component.usage.memory = Some(sample.memory);
        if let Some((old, at)) = component.sampled {
            let passed = now.saturating_sub(at).as_secs_f64().max(1e-3);
            let busy = sample.busy.saturating_sub(old.busy).as_secs_f64();
            component.usage.cpu = Some(busy / passed);
        }
        component.sampled = Some((sample, now));
    }

    /// Takes the time.
    pub(crate) fn tick(&mut self, now: Duration) {
        for component in &mut self.components {
            let heard = *component.heard.get_or_insert(now);
            let silent = now.saturating_sub(heard) > SILENCE;
            component.silent = silent && component.status.pid.is_some() && component.status.ready;
        }
    }

    /// Takes an event.
    pub(crate) fn event(&mut self, event: Event) {
        if self.events_scroll > 0 {
            self.events_scroll += event.message.lines().count().max(1);
        }
        self.events.push_back(event);
        if self.events.len() > EVENTS {
            self.events.pop_front();
        }
    }

    /// Takes new lines of the shown log.
    pub(crate) fn log_lines(&mut self, lines: Vec<String>) {
        if self.line > 0 {
            self.line += lines.len();
        }
        self.log.extend(lines);
        let over = self.log.len().saturating_sub(LOG);
        self.log.drain(..over);
        self.line = self.line.min(self.log.len());
    }

    /// Takes the shown parameters.
    pub(crate) fn parameters(&mut self, name: &str, answer: Result<Parameters, String>) {
        if self.page == Page::Parameters && self.selected == name {
            let count = answer.as_ref().map_or(0, |p| p.parameters.len());
            self.line = self.line.min(count.saturating_sub(1));
            self.parameters = Some(answer);
        }
    }

    pub(crate) fn say(&mut self, text: impl Into<String>, failed: bool) {
        let text = text.into();
        self.notice = Some(StatusLine { text, failed });
    }

    /// The rows of the table.
    pub(crate) fn rows(&self) -> Vec<Row<'_>> {
        rows::rows(
            self.components.iter().map(|c| c.status.name.as_str()),
            &self.folded,
        )
    }

    /// The selected row.
    pub(crate) fn row(&self) -> Option<usize> {
        self.rows().iter().position(|row| row.path == self.selected)
    }

    /// The selected component; none where a group is selected.
    pub(crate) fn component(&self) -> Option<&Component> {
        self.components
            .iter()
            .find(|c| c.status.name == self.selected)
    }

    /// The selected component, or those of the selected group.
    pub(crate) fn chosen(&self) -> Vec<&Component> {
        let rows = self.rows();
        let row = rows.iter().find(|row| row.path == self.selected);
        let members = row.map(|row| row.members.as_slice()).unwrap_or_default();
        members.iter().map(|&at| &self.components[at]).collect()
    }

    fn find_mut(&mut self, name: &str) -> Option<&mut Component> {
        self.components.iter_mut().find(|c| c.status.name == name)
    }

    /// The peers of a slot as `COMPONENT.SLOT`, as far as the components answer.
    pub(crate) fn others(&self, slot: &SlotStatus) -> Vec<String> {
        let Some(address) = &slot.address else {
            return Vec::new();
        };
        let mut others = Vec::new();
        for component in &self.components {
            for other in component.report.iter().flat_map(|r| &r.slots) {
                if other.role == slot.role.opposite() && other.address.as_ref() == Some(address) {
                    others.push(format!("{}.{}", component.status.name, other.name));
                }
            }
        }
        others
    }

    /// How many components are in each state, the most usual one first.
    pub(crate) fn counts(&self) -> Vec<(ComponentState, usize)> {
        let order = [
            ComponentState::Running,
            ComponentState::Starting,
            ComponentState::Waiting,
            ComponentState::Stopping,
            ComponentState::Done,
            ComponentState::Stopped,
            ComponentState::Emergency,
            ComponentState::Hung,
            ComponentState::Failed,
        ];
        let count = |state| {
            let of = self.components.iter().filter(|c| c.status.state == state);
            (state, of.count())
        };
        let counts = order.into_iter().map(count);
        counts.filter(|(_, count)| *count > 0).collect()
    }
}
