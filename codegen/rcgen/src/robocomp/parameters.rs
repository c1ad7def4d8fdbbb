//! The parameters of several configurations of one component, as a `.pdsl` and as TOML.

use super::settings::{Entry, Settings, Value};
use std::fmt::Write;

/// The type of a parameter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Type {
    word: &'static str,
    is_array: bool,
}

/// A parameter or a group.
enum Node {
    Group(Vec<(String, Node)>),
    Parameter {
        ty: Type,
        default: Value,
        doc: Vec<String>,
    },
}

/// The parameters of a component.
pub(super) struct Parameters {
    nodes: Vec<(String, Node)>,
    /// Further remarks, in sentences.
    pub(super) notes: Vec<String>,
}

impl Parameters {
    /// The parameters of all configurations. The first one gives the defaults.
    pub(super) fn of(all: &[Settings]) -> Self {
        let mut parameters = Self {
            nodes: Vec::new(),
            notes: Vec::new(),
        };
        for settings in all {
            for entry in &settings.parameters {
                parameters.add(entry);
            }
        }
        parameters
    }

    pub(super) fn is_empty(&self) -> bool {
        self.nodes.is_empty()
    }

    fn add(&mut self, entry: &Entry) {
        let mut nodes = &mut self.nodes;
        let (last, groups) = entry.path.split_last().expect("a path has a name");
        for group in groups {
            let name = identifier(group);
            if !nodes.iter().any(|(known, _)| *known == name) {
                nodes.push((name.clone(), Node::Group(Vec::new())));
            }
            let found = nodes.iter_mut().find(|(known, _)| *known == name);
            match found {
                Some((_, Node::Group(inner))) => nodes = inner,
                _ => return self.clash(entry),
            }
        }
        let (name, ty) = (identifier(last), Type::of(&entry.value));
        match nodes.iter_mut().find(|(known, _)| *known == name) {
            None => {
                let (default, doc) = (entry.value.clone(), entry.doc.clone());
                nodes.push((name.clone(), Node::Parameter { ty, default, doc }));
            }
            Some((_, Node::Parameter { ty: known, .. })) => *known = known.join(ty),
            Some((_, Node::Group(_))) => return self.clash(entry),
        }
        let path = entry.path.join(".");
        if name != *last
            && !self
                .notes
                .iter()
                .any(|note| note.contains(&format!("`{path}`")))
        {
            self.notes.push(format!("`{path}` is called `{name}`"));
        }
        if entry.value == Value::Array(Vec::new()) {
            self.notes.push(format!(
                "`{path}` is an empty list in a configuration; its type may be another one"
            ));
        }
    }

    fn clash(&mut self, entry: &Entry) {
        let path = entry.path.join(".");
        self.notes.push(format!(
            "`{path}` is left out: a parameter and a group have one name"
        ));
    }

    /// The `.pdsl`.
    pub(super) fn pdsl(&self, component: &str) -> String {
        let mut out = format!("ComponentParams {component}\n{{\n");
        print(&self.nodes, 1, &mut out);
        out.push_str("};\n");
        out
    }

    /// The configuration in the place of one of RoboComp.
    pub(super) fn toml(&self, settings: &Settings) -> String {
        let mut out = String::from("#:schema ../generated/config.schema.json\n");
        if let Some(period) = settings.period {
            let _ = write!(out, "\n[component]\nperiod = \"{}\"\n", duration(period));
        }
        let mut tables: Vec<(Vec<String>, String)> = Vec::new();
        for entry in &settings.parameters {
            let Some(ty) = self.ty(&entry.path) else {
                continue;
            };
            let (last, groups) = entry.path.split_last().expect("a path has a name");
            let groups: Vec<String> = groups.iter().map(|group| identifier(group)).collect();
            let line = format!("{} = {}\n", identifier(last), ty.text(&entry.value));
            match tables.iter_mut().find(|(known, _)| *known == groups) {
                Some((_, lines)) => lines.push_str(&line),
                None => tables.push((groups, line)),
            }
        }
        tables.sort_by_key(|(groups, _)| !groups.is_empty());
        for (groups, lines) in tables {
            let path: String = groups.iter().map(|group| format!(".{group}")).collect();
            let _ = write!(out, "\n[parameters{path}]\n{lines}");
        }
        out
    }

    fn ty(&self, path: &[String]) -> Option<Type> {
        let (last, groups) = path.split_last()?;
        let mut nodes = &self.nodes;
        let find = |nodes: &'_ Vec<(String, Node)>, name: &str| {
            let name = identifier(name);
            nodes.iter().position(|(known, _)| *known == name)
        };
        for group in groups {
            match &nodes[find(nodes, group)?].1 {
                Node::Group(inner) => nodes = inner,
                Node::Parameter { .. } => return None,
            }
        }
        match &nodes[find(nodes, last)?].1 {
            Node::Parameter { ty, .. } => Some(*ty),
            Node::Group(_) => None,
        }
    }
}

fn print(nodes: &[(String, Node)], depth: usize, out: &mut String) {
    let indent = "    ".repeat(depth);
    for (name, node) in nodes {
        match node {
            Node::Group(inner) => {
                let _ = write!(out, "{indent}group {name}\n{indent}{{\n");
                print(inner, depth + 1, out);
                let _ = writeln!(out, "{indent}}};");
            }
            Node::Parameter { ty, default, doc } => {
                for line in doc {
                    let _ = writeln!(out, "{indent}/// {line}");
                }
                let array = if ty.is_array { "[]" } else { "" };
                let _ = writeln!(
                    out,
                    "{indent}{name} {}{array} {};",
                    ty.word,
                    ty.text(default)
                );
            }
        }
    }
}

impl Type {
    fn of(value: &Value) -> Self {
        let word = match value {
            Value::Bool(_) => "bool",
            Value::Int(value) if i32::try_from(*value).is_ok() => "int",
            Value::Int(_) => "long",
            Value::Float(_) => "double",
            Value::Text(_) => "string",
            Value::Array(values) => {
                let types = values.iter().map(Self::of);
                types.reduce(Self::join).map_or("string", |ty| ty.word)
            }
        };
        let is_array = matches!(value, Value::Array(_));
        Self { word, is_array }
    }

    /// The type that has the values of both.
    fn join(self, other: Self) -> Self {
        let word = match (self.word, other.word) {
            (one, two) if one == two => one,
            ("int", "long") | ("long", "int") => "long",
            ("int" | "long", "double") | ("double", "int" | "long") => "double",
            _ => "string",
        };
        let is_array = self.is_array || other.is_array;
        Self { word, is_array }
    }

    /// A value of this type in a `.pdsl` and in TOML.
    fn text(self, value: &Value) -> String {
        let one = |value: &Value| match (value, self.word) {
            (Value::Text(text), _) => quoted(text),
            (Value::Int(value), "double") => format!("{value}.0"),
            (Value::Int(value), "int" | "long") => value.to_string(),
            (Value::Float(value), "double") => format!("{value:?}"),
            (Value::Bool(value), "bool") => value.to_string(),
            (Value::Bool(value), _) => quoted(&value.to_string()),
            (Value::Int(value), _) => quoted(&value.to_string()),
            (Value::Float(value), _) => quoted(&value.to_string()),
            (Value::Array(_), _) => quoted(""),
        };
        match value {
            Value::Array(values) => {
                let values: Vec<String> = values.iter().map(one).collect();
                format!("[{}]", values.join(", "))
            }
            value if self.is_array => format!("[{}]", one(value)),
            value => one(value),
        }
    }
}

/// A string of both languages.
fn quoted(text: &str) -> String {
    let mut out = String::from("\"");
    for c in text.chars() {
        match c {
            '"' | '\\' => out.extend(['\\', c]),
            '\n' => out.push_str("\\n"),
            '\t' => out.push_str("\\t"),
            c if c.is_control() => {}
            c => out.push(c),
        }
    }
    out.push('"');
    out
}

/// A period in milliseconds as a text.
pub(super) fn duration(milliseconds: f64) -> String {
    format!("{milliseconds}ms")
}

/// A name of the description languages.
pub(super) fn identifier(text: &str) -> String {
    let is_word = |c: char| c.is_ascii_alphanumeric() || c == '_';
    let name: String = text
        .chars()
        .map(|c| if is_word(c) { c } else { '_' })
        .collect();
    if name.starts_with(|c: char| c.is_ascii_alphabetic()) {
        name
    } else {
        format!("p_{}", name.trim_start_matches('_'))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;

    #[test]
    fn the_first_configuration_has_the_defaults_and_all_have_the_types() {
        let parse = |text: &str| Settings::parse(Path::new("config"), text);
        let main = parse(
            "speed = 1\n# Ports.\nports = [1, 2]\n2d = true\nbig = 5000000000\nempty = []\n\
             [View]\nname = \"a\\\\b\"\nscale = 1e-5\n",
        );
        let other = parse("speed = 0.5\nports = 3\nspeed.max = 2\nbig = false\nextra = \"x\"\n");
        let all = [main, other];
        let parameters = Parameters::of(&all);
        expect_test::expect![[r#"
            ComponentParams eye
            {
                speed double 1.0;
                /// Ports.
                ports int[] [1, 2];
                p_2d bool true;
                big string "5000000000";
                empty string[] [];
                group View
                {
                    name string "a\\b";
                    scale double 1e-5;
                };
                extra string "x";
            };
        "#]]
        .assert_eq(&parameters.pdsl("eye"));
        expect_test::expect![[r#"
            #:schema ../generated/config.schema.json

            [parameters]
            speed = 0.5
            ports = [3]
            big = "false"
            extra = "x"
        "#]]
        .assert_eq(&parameters.toml(&all[1]));
        assert_eq!(
            parameters.notes,
            [
                "`2d` is called `p_2d`",
                "`empty` is an empty list in a configuration; its type may be another one",
                "`speed.max` is left out: a parameter and a group have one name",
            ]
        );
    }
}
