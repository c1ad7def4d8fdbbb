//! Values as rows of a table.

use crate::value::Value;
use rc_diagnostics::foreign::escape_to;
use std::collections::{BTreeMap, BTreeSet};

/// The most elements of a sequence that has a column for each element.
const SHORT: usize = 16;
/// The most columns of a table.
const MOST: usize = 4096;

/// The columns of a table in CSV: the numbers and texts of its values, each with its path.
///
/// Each element of a sequence has a column, if no value has more than 16 elements there. Otherwise
/// the sequence is one cell, as JSON; a dictionary always is. An optional structure may be missing
/// in some values.
///
/// ```
/// use rc_values::{Columns, Numbers, Value};
///
/// let value = |numbers: &[i32], name: &str| {
///     let name = ("name".to_owned(), Value::Text(name.to_owned()));
///     [("joints".to_owned(), Value::Numbers(Numbers::I32(numbers.to_vec()))), name]
/// };
/// let mut columns = Columns::new("time");
/// columns.add(&value(&[1], "a"));
/// columns.add(&value(&[2, 3], "b"));
/// assert_eq!(columns.header(), "time,joints[0],joints[1],name\n");
/// assert_eq!(columns.row("5", &value(&[1], "a")), "5,1,,a\n");
/// assert_eq!(columns.missing(&value(&[4, 5, 6], "c")), Some("joints[2]".to_owned()));
///
/// columns.add(&value(&[0; 17], "d"));
/// assert_eq!(columns.header(), "time,joints,name\n");
/// assert_eq!(columns.row("5", &value(&[1], "a")), "5,[1],a\n");
/// ```
pub struct Columns {
    before: String,
    names: Vec<String>,
    /// The sequences that are one cell.
    whole: BTreeSet<String>,
    /// Whether [`Columns::missing`] has found a cell.
    is_reported: bool,
}

type Cells = Vec<(String, String)>;

impl Columns {
    /// No columns after those with the names `before`.
    pub fn new(before: &str) -> Self {
        Self {
            before: before.to_owned(),
            names: Vec::new(),
            whole: BTreeSet::new(),
            is_reported: false,
        }
    }

    /// Adds the columns that these values need, each with its path; the path of a whole message is
    /// empty.
    pub fn add(&mut self, values: &[(String, Value)]) {
        let mut long = BTreeSet::new();
        let found = cells(values, &self.whole, &mut long);
        for whole in long {
            let is_element = |name: &String| {
                let rest = name.strip_prefix(whole.as_str());
                rest.is_some_and(|rest| rest.starts_with('['))
            };
            if let Some(first) = self.names.iter().position(is_element) {
                self.names.insert(first, whole.clone());
                self.names.retain(|name| !is_element(name));
            }
            self.whole.insert(whole);
        }
        let places = self.names.iter().enumerate();
        let places: BTreeMap<String, usize> = places.map(|(at, name)| (name.clone(), at)).collect();
        if found.iter().all(|(name, _)| places.contains_key(name)) {
            return;
        }
        // A new column comes after the one that precedes it in this value.
        let (mut behind, mut added) = (0, 0);
        for (name, _) in found {
            if let Some(at) = places.get(&name) {
                behind = at + added + 1;
            } else if self.names.len() < MOST && !self.has(&name) {
                self.names.insert(behind, name);
                (behind, added) = (behind + 1, added + 1);
            }
        }
        // The structure was missing in all values before.
        let names = std::mem::take(&mut self.names);
        let is_parent = |name: &String, next: Option<&String>| {
            let rest = next.and_then(|next| next.strip_prefix(name.as_str()));
            rest.is_some_and(|rest| rest.starts_with('.'))
        };
        let kept = names.iter().enumerate();
        let kept = kept.filter(|(at, name)| !is_parent(name, names.get(at + 1)));
        self.names = kept.map(|(_, name)| name.clone()).collect();
    }

    /// Whether a cell has a column. A structure that is missing has a cell of its own, in place of
    /// those of its members.
    fn has(&self, name: &str) -> bool {
        let is_part = |column: &String| {
            let rest = column.strip_prefix(name);
            rest.is_some_and(|rest| rest.is_empty() || rest.starts_with('.'))
        };
        self.names.iter().any(is_part)
    }

    /// The line of the names.
    pub fn header(&self) -> String {
        line(&self.before, self.names.iter().map(String::as_str))
    }

    /// The line of these values. `before` is the text of the columns before.
    pub fn row(&self, before: &str, values: &[(String, Value)]) -> String {
        let found = cells(values, &self.whole, &mut BTreeSet::new());
        let found: BTreeMap<String, String> = found.into_iter().collect();
        let cell = |name| found.get(name).map_or("", String::as_str);
        line(before, self.names.iter().map(cell))
    }

    /// The name of a cell that has no column, once.
    pub fn missing(&mut self, values: &[(String, Value)]) -> Option<String> {
        if self.is_reported {
            return None;
        }
        let found = cells(values, &self.whole, &mut BTreeSet::new());
        let (name, _) = found.into_iter().find(|(name, _)| !self.has(name))?;
        self.is_reported = true;
        Some(name)
    }
}

/// The cells of values, each with its path. `long` gets the paths of sequences that are one cell
/// because they are long.
fn cells(
    values: &[(String, Value)],
    whole: &BTreeSet<String>,
    long: &mut BTreeSet<String>,
) -> Cells {
    let mut found = Vec::new();
    for (path, value) in values {
        flatten(path, value, whole, long, &mut found);
    }
    found
}

fn flatten(
    path: &str,
    value: &Value,
    whole: &BTreeSet<String>,
    long: &mut BTreeSet<String>,
    found: &mut Cells,
) {
    let has_room = found.len() < MOST;
    let mut is_short = |length: usize| {
        let is_short = length <= SHORT && has_room;
        if !is_short {
            long.insert(path.to_owned());
        }
        is_short && !whole.contains(path)
    };
    match value {
        Value::Struct(ty, values) if has_room => {
            for (member, value) in ty.members.iter().zip(values) {
                let dot = if path.is_empty() { "" } else { "." };
                let path = format!("{path}{dot}{}", member.name);
                flatten(&path, value, whole, long, found);
            }
        }
        Value::Numbers(numbers) if is_short(numbers.len()) => {
            let numbers = (0..numbers.len()).filter_map(|at| Some((at, numbers.get(at)?)));
            found.extend(numbers.map(|(at, number)| (format!("{path}[{at}]"), number.plain())));
        }
        Value::Sequence(items) if is_short(items.len()) => {
            for (at, item) in items.iter().enumerate() {
                flatten(&format!("{path}[{at}]"), item, whole, long, found);
            }
        }
        Value::Numbers(_) | Value::Sequence(_) | Value::Map(_) | Value::Struct(..) => {
            let text = serde_json::to_string(value).unwrap_or_default();
            found.push((path.to_owned(), text));
        }
        other => found.push((path.to_owned(), other.plain())),
    }
}

fn line<'c>(before: &str, cells: impl Iterator<Item = &'c str>) -> String {
    let cells = cells.map(|cell| format!(",{}", csv_cell(cell)));
    format!("{before}{}\n", cells.collect::<String>())
}

/// A cell of CSV: in quotes where it needs them (RFC 4180), with control characters shown.
///
/// ```
/// assert_eq!(rc_values::csv_cell("a \"b\", c"), "\"a \"\"b\"\", c\"");
/// assert_eq!(rc_values::csv_cell("a\n\u{1b}[31mred"), "a\\n\\u{1b}[31mred");
/// ```
pub fn csv_cell(text: &str) -> String {
    let text = escape_to(text, usize::MAX);
    if text.contains(['"', ',']) {
        format!("\"{}\"", text.replace('"', "\"\""))
    } else {
        text
    }
}
