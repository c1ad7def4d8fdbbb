//! The findings in a picture. Each has a number, shown at its subject and in the legend.

use crate::model::{Finding, Graph};
use std::collections::HashMap;

/// The severity of the worst finding about a subject.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Level {
    Warning,
    Error,
}

/// The findings about one subject: their numbers, from 1, and the worst severity.
#[derive(Clone, Debug)]
pub(crate) struct Mark {
    pub(crate) level: Level,
    pub(crate) numbers: Vec<usize>,
}

/// The errors and warnings of a picture, by subject.
#[derive(Debug, Default)]
pub(crate) struct Marks<'a> {
    /// Each with its number.
    pub(crate) listed: Vec<(Level, &'a Finding)>,
    components: HashMap<&'a str, Mark>,
    groups: HashMap<&'a str, Mark>,
    hosts: HashMap<&'a str, Mark>,
    slots: HashMap<(usize, usize), Mark>,
    connections: HashMap<usize, Mark>,
}

impl Mark {
    /// `[2][5–8]`
    pub(crate) fn text(&self) -> String {
        let rows = self.numbers.chunk_by(|one, next| one + 1 == *next);
        rows.map(|row| match row {
            [one] => format!("[{one}]"),
            [first, .., last] => format!("[{first}–{last}]"),
            [] => String::new(),
        })
        .collect()
    }
}

/// A text, followed by the numbers of its findings.
pub(crate) fn marked(name: &str, mark: Option<&Mark>) -> String {
    mark.map_or_else(|| name.to_owned(), |m| format!("{name} {}", m.text()))
}

fn note<K: std::hash::Hash + Eq>(
    marks: &mut HashMap<K, Mark>,
    key: K,
    level: Level,
    number: usize,
) {
    let mark = marks.entry(key).or_insert(Mark {
        level,
        numbers: Vec::new(),
    });
    mark.level = mark.level.max(level);
    if mark.numbers.last() != Some(&number) {
        mark.numbers.push(number);
    }
}

impl<'a> Marks<'a> {
    pub(crate) fn new(graph: &'a Graph) -> Self {
        let mut marks = Self::default();
        for finding in &graph.findings {
            let level = match finding.severity {
                "error" => Level::Error,
                "warning" => Level::Warning,
                _ => continue,
            };
            marks.listed.push((level, finding));
            let number = marks.listed.len();
            for name in &finding.components {
                note(&mut marks.components, name.as_str(), level, number);
            }
            if let Some(name) = &finding.group {
                note(&mut marks.groups, name.as_str(), level, number);
            }
            if let Some(name) = &finding.host {
                note(&mut marks.hosts, name.as_str(), level, number);
            }
            for slot in &finding.slots {
                note(&mut marks.slots, slot.at, level, number);
            }
            for connection in &finding.connections {
                note(&mut marks.connections, *connection, level, number);
            }
        }
        marks
    }

    pub(crate) fn component(&self, name: &str) -> Option<&Mark> {
        self.components.get(name)
    }

    pub(crate) fn group(&self, name: &str) -> Option<&Mark> {
        self.groups.get(name)
    }

    pub(crate) fn host(&self, name: &str) -> Option<&Mark> {
        self.hosts.get(name)
    }

    pub(crate) fn slot(&self, component: usize, slot: usize) -> Option<&Mark> {
        self.slots.get(&(component, slot))
    }

    pub(crate) fn connection(&self, number: usize) -> Option<&Mark> {
        self.connections.get(&number)
    }

    /// The findings about a component and its slots.
    pub(crate) fn component_with_slots(&self, name: &str, at: usize, slots: usize) -> Option<Mark> {
        let slots = (0..slots).filter_map(|slot| self.slot(at, slot));
        let mut all: Vec<&Mark> = self.component(name).into_iter().chain(slots).collect();
        all.sort_by_key(|mark| std::cmp::Reverse(mark.level));
        let level = all.first()?.level;
        let mut numbers: Vec<usize> = all.iter().flat_map(|m| m.numbers.clone()).collect();
        numbers.sort_unstable();
        numbers.dedup();
        Some(Mark { level, numbers })
    }

    /// A finding as one line: `[2] error[no-provider]: … (a.ddsl:3:15)`.
    pub(crate) fn line(&self, number: usize) -> String {
        let (_, f) = self.listed[number - 1];
        let help = f
            .help
            .as_ref()
            .map_or_else(String::new, |h| format!("; {h}"));
        format!(
            "[{number}] {}[{}]: {}{help} ({}:{}:{})",
            f.severity,
            f.code,
            f.message,
            f.file.display(),
            f.line,
            f.column
        )
    }
}
