//! Scenarios of the technology compatibility kit of openCypher, as its feature files have them.

use std::path::Path;

/// The expectations of a scenario.
#[derive(Clone, Debug)]
pub(crate) enum Expected {
    Rows {
        columns: Vec<String>,
        rows: Vec<Vec<String>>,
        is_ordered: bool,
        /// Whether elements of lists may be in any order.
        lists_vary: bool,
    },
    /// The name of the fault, such as `UndefinedVariable`.
    Error(String),
    None,
}

#[derive(Clone, Debug)]
pub(crate) struct Scenario {
    /// Its number in the feature, and that of the example: `3`, `3.2`.
    pub(crate) number: String,
    /// The step with the graph that it starts with: `the binary-tree-1 graph`.
    pub(crate) named_graph: Option<String>,
    pub(crate) setup: Vec<String>,
    pub(crate) parameters: Vec<(String, String)>,
    pub(crate) query: String,
    pub(crate) expected: Expected,
    /// A step that no runner of a read-only subset can do.
    pub(crate) beyond: Option<String>,
}

/// A step with the text and the table below it.
#[derive(Clone, Debug, Default)]
struct Step {
    words: String,
    text: String,
    table: Vec<Vec<String>>,
}

fn cells(line: &str) -> Vec<String> {
    let mut cells = vec![String::new()];
    let mut signs = line.trim().chars();
    while let Some(sign) = signs.next() {
        let cell = cells.last_mut().expect("a cell");
        match sign {
            '|' => cells.push(String::new()),
            '\\' => match signs.next() {
                Some('|') => cell.push('|'),
                Some('\\') => cell.push_str("\\\\"),
                Some(other) => cell.extend(['\\', other]),
                None => {}
            },
            other => cell.push(other),
        }
    }
    let inner = cells.get(1..cells.len() - 1).unwrap_or_default();
    inner.iter().map(|cell| cell.trim().to_owned()).collect()
}

impl Step {
    fn with(&self, names: &[String], values: &[String]) -> Self {
        let fill = |text: &str| {
            let pairs = names.iter().zip(values);
            pairs.fold(text.to_owned(), |text, (name, value)| {
                text.replace(&format!("<{name}>"), value)
            })
        };
        let row = |row: &Vec<String>| row.iter().map(|cell| fill(cell)).collect();
        Self {
            words: fill(&self.words),
            text: fill(&self.text),
            table: self.table.iter().map(row).collect(),
        }
    }
}

fn scenario(number: String, steps: &[Step]) -> Scenario {
    let mut made = Scenario {
        number,
        named_graph: None,
        setup: Vec::new(),
        parameters: Vec::new(),
        query: String::new(),
        expected: Expected::None,
        beyond: None,
    };
    for step in steps {
        let words = step.words.as_str();
        if words == "an empty graph" || words == "any graph" || words == "no side effects" {
        } else if words.starts_with("the ") && words.ends_with("graph") {
            made.named_graph = Some(words.to_owned());
        } else if words == "having executed:" {
            made.setup.push(step.text.clone());
        } else if words == "parameters are:" {
            let pairs = step.table.iter().filter(|row| row.len() == 2);
            made.parameters = pairs.map(|row| (row[0].clone(), row[1].clone())).collect();
        } else if words == "executing query:" {
            made.query.clone_from(&step.text);
        } else if words.starts_with("the result should be") {
            let mut rows = step.table.iter().cloned();
            made.expected = Expected::Rows {
                columns: rows.next().unwrap_or_default(),
                rows: rows.collect(),
                is_ordered: words.contains("in order"),
                lists_vary: words.contains("ignoring element order"),
            };
        } else if let Some((_, fault)) = words.split_once(" should be raised at ") {
            let fault = fault.split_once(": ").map_or(fault, |(_, fault)| fault);
            made.expected = Expected::Error(fault.to_owned());
        } else {
            made.beyond = Some(words.to_owned());
        }
    }
    made
}

/// The scenarios of a feature file.
pub(crate) fn read(path: &Path) -> Vec<Scenario> {
    let text = std::fs::read_to_string(path).expect("a feature file");
    let mut all = Vec::new();
    let mut number = String::new();
    let mut steps: Vec<Step> = Vec::new();
    let mut background: Vec<Step> = Vec::new();
    let mut examples: Option<Vec<Vec<String>>> = None;
    let mut quoted: Option<String> = None;
    let mut end = |number: &str, steps: &[Step], examples: Option<Vec<Vec<String>>>| {
        if number.is_empty() {
            return;
        }
        let Some(examples) = examples else {
            all.push(scenario(number.to_owned(), steps));
            return;
        };
        let Some((names, rows)) = examples.split_first() else {
            return;
        };
        for (at, row) in rows.iter().enumerate() {
            let steps: Vec<Step> = steps.iter().map(|step| step.with(names, row)).collect();
            all.push(scenario(format!("{number}.{}", at + 1), &steps));
        }
    };
    for line in text.lines() {
        let trimmed = line.trim();
        if let Some(text) = &mut quoted {
            if trimmed == "\"\"\"" {
                if let Some(step) = steps.last_mut() {
                    step.text = quoted.take().unwrap_or_default();
                }
            } else {
                text.push_str(line);
                text.push('\n');
            }
            continue;
        }
        if trimmed == "\"\"\"" {
            quoted = Some(String::new());
        } else if trimmed.starts_with("Background:") {
            steps.clear();
        } else if trimmed.starts_with("Scenario") {
            if number.is_empty() {
                background = std::mem::take(&mut steps);
            }
            end(&number, &steps, examples.take());
            let name = trimmed
                .split_once('[')
                .and_then(|(_, rest)| rest.split_once(']'));
            number = name.map_or_else(|| "?".to_owned(), |(number, _)| number.to_owned());
            steps.clone_from(&background);
        } else if trimmed.starts_with("Examples:") {
            examples.get_or_insert_default();
        } else if trimmed.starts_with('|') {
            match (&mut examples, steps.last_mut()) {
                (Some(rows), _) => rows.push(cells(trimmed)),
                (None, Some(step)) => step.table.push(cells(trimmed)),
                (None, None) => {}
            }
        } else if let Some((word, rest)) = trimmed.split_once(' ')
            && ["Given", "And", "When", "Then", "But"].contains(&word)
        {
            steps.push(Step {
                words: rest.trim().to_owned(),
                ..Step::default()
            });
        }
    }
    end(&number, &steps, examples);
    all
}
