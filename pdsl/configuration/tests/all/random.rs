//! Random parameters, some of them imported. A configuration with their defaults is accepted. Each
//! single fault in it is rejected with the right code, path and line, and by the schema if JSON
//! Schema can express it. An update corrects unknown and missing parameters and nothing else. An
//! accepted change at run time is saved as a valid configuration and changes one line.

mod changes;
mod schema;

use arbtest::arbitrary::{Result, Unstructured};
use arbtest::arbtest;
use rc_configuration::model::Parameters;
use rc_diagnostics::{SourceMap, render};
use rc_syntax::MemoryLoader;
use rc_test_support::python;
use schema::{Case, json_of};
use std::collections::HashMap;
use std::time::Duration;

const PERIOD: Duration = Duration::from_millis(100);

/// A parameter, group or list, with the values to try.
struct Node {
    name: String,
    kind: Kind,
}

enum Kind {
    /// A valid value in TOML and the invalid ones. Each invalid value has the code of its error and
    /// the suffix of its path.
    Scalar {
        value: String,
        required: bool,
        wrong: Vec<Wrong>,
    },
    /// The first parameter of a pair whose rule requires it to be the smaller one. `High` follows
    /// it.
    Low,
    High,
    /// A parameter with a different value in each element of the list.
    Id,
    Group(Vec<Node>),
    List(Vec<Node>),
}

/// Values that a schema cannot reject: a float that is too large for 32 bits, a duration beyond its
/// range, and a date, a type that JSON does not have.
const BEYOND: [&str; 3] = ["1e39", "'2s'", "1979-05-27"];

struct Wrong {
    value: String,
    code: &'static str,
    path: &'static str,
}

fn wrong(code: &'static str, value: &str, path: &'static str) -> Wrong {
    Wrong {
        value: value.to_owned(),
        code,
        path,
    }
}

/// A type: keyword, valid value, range and a value outside it, choices and a value that is none of
/// them, a value of another type, a value beyond the type's limits.
type Sample = (
    &'static str,
    &'static str,
    Option<(&'static str, &'static str)>,
    Option<(&'static str, &'static str)>,
    &'static str,
    Option<&'static str>,
);

const SAMPLES: [Sample; 8] = [
    ("bool", "true", None, None, "1", None),
    (
        "int",
        "7",
        Some(("-9:9", "10")),
        Some(("{7, 8}", "9")),
        "'x'",
        Some("3000000000"),
    ),
    (
        "long",
        "-7",
        Some(("-9:9", "10")),
        Some(("{-7}", "7")),
        "1.5",
        None,
    ),
    (
        "float",
        "0.5",
        Some(("0:1", "nan")),
        Some(("{0.5, 1}", "0.7")),
        "true",
        Some("1e39"),
    ),
    ("double", "1e3", Some(("0.5:", "0.4")), None, "'1'", None),
    (
        "string",
        "\"slow\"",
        None,
        Some(("{fast, slow}", "'slwo'")),
        "7",
        None,
    ),
    (
        "duration",
        "\"50ms\"",
        Some(("1ms:1s", "'2s'")),
        None,
        "'soon'",
        Some("-1"),
    ),
    ("path", "\"/dev/x\"", None, None, "1979-05-27", None),
];

const FLAGS: [&str; 5] = ["", "T", "F", "restart", "T secret"];

/// Random declarations as text and as nodes.
fn block(u: &mut Unstructured<'_>, depth: usize, out: &mut String) -> Result<Vec<Node>> {
    let mut nodes = Vec::new();
    for at in 0..u.int_in_range(1..=4)? {
        let name = format!("{}{at}", u.choose(&["p", "min", "list", "T", "aB"])?);
        match u.int_in_range(0..=9)? {
            0..=4 => nodes.push(scalar(u, name, out)?),
            5 | 6 => pair(u, &name, out, &mut nodes)?,
            7 | 8 if depth > 0 => {
                out.push_str(&format!("group {name} {{\n"));
                let inner = block(u, depth - 1, out)?;
                out.push_str("};\n");
                let kind = Kind::Group(inner);
                nodes.push(Node { name, kind });
            }
            _ if depth > 0 => {
                let length = *u.choose(&["", "0:3", "1:4", "2:2"])?;
                out.push_str(&format!("list {name} {length} {{\nid int 0:;\n"));
                let mut inner = block(u, depth - 1, out)?;
                out.push_str(&format!(
                    "}};\nrequire unique({name}.id) \"twice\";\nrequire len({name}) < 9 \"many\";\n"
                ));
                inner.push(Node {
                    name: "id".to_owned(),
                    kind: Kind::Id,
                });
                let kind = Kind::List(inner);
                nodes.push(Node { name, kind });
            }
            _ => {}
        }
    }
    Ok(nodes)
}

fn scalar(u: &mut Unstructured<'_>, name: String, out: &mut String) -> Result<Node> {
    let (ty, one, range, choices, other, huge) = *u.choose(&SAMPLES)?;
    let is_array = u.ratio(1, 4)?;
    let element = if is_array { "[0]" } else { "" };
    let array = |values: &str| {
        if is_array {
            format!("[{values}]")
        } else {
            values.to_owned()
        }
    };
    let required = u.ratio(1, 3)?;
    let mut wrongs = vec![wrong("wrong-type", &array(other), element)];
    let mut limit = "";
    // Without a default, the text after the type must not begin like a default.
    match (u.int_in_range(0..=2)?, range, choices) {
        (0, Some((range, outside)), _) => {
            limit = range;
            wrongs.push(wrong("out-of-range", &array(outside), element));
        }
        (1, _, Some((choices, beside))) => {
            limit = choices;
            wrongs.push(wrong("invalid-choice", &array(beside), element));
        }
        _ => {}
    }
    wrongs.extend(huge.map(|huge| wrong("out-of-range", &array(huge), element)));
    if is_array {
        wrongs.push(wrong("wrong-type", one, ""));
        wrongs.push(wrong("wrong-length", "[]", ""));
    }
    let value = array(one);
    let default = if required { "" } else { &value };
    let length = if is_array { "[1:2]" } else { "" };
    let flags = u.choose(&FLAGS)?;
    out.push_str(&format!("{name} {ty}{length} {default} {limit} {flags};\n"));
    let kind = Kind::Scalar {
        value,
        required,
        wrong: wrongs,
    };
    Ok(Node { name, kind })
}

/// Two parameters and the rule that the first is smaller.
fn pair(
    u: &mut Unstructured<'_>,
    name: &str,
    out: &mut String,
    nodes: &mut Vec<Node>,
) -> Result<()> {
    let (low, high) = (format!("{name}_low"), format!("{name}_high"));
    let ty = u.choose(&["int", "long", "double"])?;
    let condition = match u.int_in_range(0..=3)? {
        0 => format!("{low} < {high}"),
        1 => format!("not ({low} >= {high})"),
        2 => format!("{low} - {high} + 1 <= 0 and {high} > -900"),
        _ => format!("- {low} * 2 > {high} * -2 or {low} + 1 == {high} / 7 * 3"),
    };
    let flags = u.choose(&FLAGS)?;
    out.push_str(&format!(
        "{low} {ty} 10 {flags};\n{high} {ty} 20 {flags};\nrequire {condition} \"low below high\";\n"
    ));
    nodes.push(Node {
        name: low,
        kind: Kind::Low,
    });
    nodes.push(Node {
        name: high,
        kind: Kind::High,
    });
    Ok(())
}

/// A line of a configuration that sets a value.
struct Line<'n> {
    at: usize,
    /// The line of its table's header.
    table: usize,
    /// The path of that table with a trailing dot. Empty for the top level.
    within: String,
    node: &'n Node,
}

/// The template with all required values, and the lines that set values.
fn fill<'n>(template: &str, nodes: &'n [Node]) -> (Vec<String>, Vec<Line<'n>>) {
    let (mut text, mut lines) = (Vec::new(), Vec::new());
    let mut counts: HashMap<String, usize> = HashMap::new();
    let (mut table, mut within, mut here) = (0, String::new(), nodes);
    for (at, line) in template.lines().enumerate() {
        let mut line = line.to_owned();
        if line.starts_with('[') {
            let header = line.trim_matches(['[', ']']);
            let names: Vec<&str> = header.split('.').skip(1).collect();
            (table, within, here) = (at, String::new(), nodes);
            for (depth, name) in names.iter().enumerate() {
                let node = here.iter().find(|n| n.name == **name).expect("a table");
                within.push_str(name);
                match &node.kind {
                    Kind::Group(inner) => here = inner,
                    Kind::List(inner) => {
                        here = inner;
                        let count = counts.entry(within.clone()).or_default();
                        *count += usize::from(depth + 1 == names.len());
                        within.push_str(&format!("[{}]", *count - 1));
                    }
                    _ => panic!("{name} is not a table"),
                }
                within.push('.');
            }
        } else if let Some((name, _)) = line.split_once(" = ") {
            // An optional list is commented out as a whole: its lines begin with `# #`, not with
            // `#`.
            let name = name.strip_prefix("# ").unwrap_or(name).to_owned();
            let must = line.ends_with("# must be set");
            let node = here.iter().find(|n| n.name == name);
            if let Some(node) = node.filter(|_| must || !line.starts_with('#')) {
                match &node.kind {
                    Kind::Scalar {
                        value, required, ..
                    } => {
                        assert_eq!(*required, must);
                        line = format!("{name} = {value}");
                    }
                    Kind::Id => line = format!("id = {at}"),
                    _ => {}
                }
                let within = within.clone();
                lines.push(Line {
                    at,
                    table,
                    within,
                    node,
                });
            }
        }
        text.push(line);
    }
    (text, lines)
}

struct Property {
    model: Parameters,
    pdsl: String,
    /// The number of faults tried.
    faults: usize,
    /// The documents, each with whether the schema must accept it.
    case: Case,
}

impl Property {
    /// Checks that exactly one error is found: `code`, about `path`, on line `at` (from 0).
    fn refuses(&mut self, toml: &[String], code: &str, path: &str, at: usize) {
        let (found, shown) = check(&self.model, &toml.join("\n"));
        let about = format!("`{path}`");
        let expected = matches!(
            found.as_slice(),
            [(found, line, message)] if found == code && *line == at + 1 && message.contains(&about)
        );
        assert!(
            expected,
            "{code} about {about} on line {}\n{shown}\n{}\n{}",
            at + 1,
            toml.join("\n"),
            self.pdsl
        );
        self.faults += 1;
        let whole = toml.join("\n");
        let text = whole.lines().nth(at).unwrap_or_default();
        if !BEYOND.iter().any(|value| text.contains(value)) {
            // A schema cannot express rules. It must accept a configuration that breaks one.
            let allows = code == "rule-broken";
            let instance = json_of(&whole);
            self.case.instances.push((instance, allows));
        }
    }

    /// Checks that an update reports only this change, and that its result is valid and needs no
    /// update.
    fn updates(&self, toml: &[String], expected: &str) {
        let once = |text: &str| {
            let mut sources = SourceMap::new();
            let source = sources.add("config.toml", text);
            let update =
                rc_configuration::update(&sources, source, Some(&self.model)).expect("TOML");
            let changes = update.changes.iter().map(ToString::to_string);
            (changes.collect::<Vec<_>>(), update.text)
        };
        let before = toml.join("\n");
        let (changes, text) = once(&before);
        let said = match &changes[..] {
            [] => expected.is_empty(),
            [change] => !expected.is_empty() && change.starts_with(expected),
            _ => false,
        };
        assert!(said, "{expected}: {changes:?}\n{before}\n{}", self.pdsl);
        assert_eq!(check(&self.model, &text).1, "", "{text}\n{}", self.pdsl);
        assert_eq!(once(&text), (Vec::new(), text.clone()), "{}", self.pdsl);
        let kept = before.lines().all(|line| text.contains(line));
        assert!(kept, "{before}\n\n{text}");
    }

    /// Tries every fault of one line.
    fn faults_of(&mut self, text: &[String], line: &Line<'_>, next: Option<&Line<'_>>) {
        let Line {
            at,
            table,
            within,
            node,
        } = line;
        let path = format!("{within}{}", node.name);
        let with = |at: usize, line: String| {
            let mut text = text.to_vec();
            text[at] = line;
            text
        };
        let without = with(*at, String::new());
        let unknown = with(*at, format!("{}\nunheard = 1", text[*at]));
        self.refuses(
            &unknown,
            "unknown-parameter",
            &format!("{within}unheard"),
            at + 1,
        );
        self.updates(&unknown, &format!("comment out `{within}unheard`"));
        match &node.kind {
            Kind::Scalar {
                required, wrong, ..
            } => {
                if *required {
                    self.refuses(&without, "missing-parameter", &path, *table);
                } else {
                    self.updates(&without, &format!("add `{path}` = "));
                }
                for wrong in wrong {
                    let toml = with(*at, format!("{} = {}", node.name, wrong.value));
                    self.refuses(&toml, wrong.code, &format!("{path}{}", wrong.path), *at);
                }
            }
            Kind::Low => {
                let toml = with(*at, format!("{} = 20", node.name));
                self.refuses(&toml, "rule-broken", &path, *at);
                // The error refers to the first parameter of the rule, although the second was
                // changed.
                let high = next.expect("the second parameter of the pair");
                let toml = with(high.at, format!("{} = -1000", high.node.name));
                self.refuses(&toml, "rule-broken", &path, *at);
            }
            Kind::Id => {
                self.refuses(&without, "missing-parameter", &path, *table);
                self.refuses(&with(*at, "id = -1".to_owned()), "out-of-range", &path, *at);
            }
            Kind::High | Kind::Group(_) | Kind::List(_) => {}
        }
    }
}

/// The code, line and message of each diagnostic, and the rendered diagnostics.
fn check(model: &Parameters, toml: &str) -> (Vec<(String, usize, String)>, String) {
    let mut sources = SourceMap::new();
    let source = sources.add("config.toml", toml);
    let (_, found) = rc_configuration::check(&sources, source, Some(model));
    let all = found.iter().map(|d| {
        let line = sources.position(d.span.source, d.span.start).line;
        (d.code.to_owned(), line, d.message.clone())
    });
    (
        all.collect(),
        render(&sources, &found, rc_diagnostics::Format::Short),
    )
}

/// A random model with its text and its nodes.
fn made(u: &mut Unstructured<'_>) -> Result<(Parameters, String, Vec<Node>)> {
    let mut loader = MemoryLoader::default();
    let (mut pdsl, mut nodes) = (String::new(), Vec::new());
    if u.ratio(1, 4)? {
        let mut base = String::from("ComponentParams Base {\ngroup base {\n");
        let kind = Kind::Group(block(u, 1, &mut base)?);
        base.push_str("};\n};\n");
        nodes.push(Node {
            name: "base".to_owned(),
            kind,
        });
        pdsl.push_str("import \"base.pdsl\";\n");
        loader = MemoryLoader::new([("base.pdsl", base.as_str())]);
    }
    pdsl.push_str("ComponentParams C {\n");
    nodes.extend(block(u, 3, &mut pdsl)?);
    pdsl.push_str("};\n");
    let mut sources = SourceMap::new();
    let source = sources.add("c.pdsl", pdsl.as_str());
    let (model, found) = rc_pdsl::load(&mut sources, &loader, source);
    assert!(
        found.is_empty(),
        "{}\n{pdsl}",
        render(&sources, &found, rc_diagnostics::Format::Short)
    );
    Ok((model.expect("parameters"), pdsl, nodes))
}

fn property(u: &mut Unstructured<'_>) -> Result<Property> {
    let (model, pdsl, nodes) = made(u)?;
    // A component reads its model from JSON.
    let again = Parameters::from_json(&model.to_json()).expect("its own JSON");
    assert_eq!(again, model);
    let (text, lines) = fill(
        &rc_configuration::template("C", PERIOD, Some(&model)),
        &nodes,
    );
    let (_, shown) = check(&model, &text.join("\n"));
    assert_eq!(shown, "", "{}\n{pdsl}", text.join("\n"));
    let case = Case {
        schema: rc_configuration::schema("C", PERIOD, &[], Some(&model)),
        instances: vec![(json_of(&text.join("\n")), true)],
    };
    let mut property = Property {
        model,
        pdsl,
        faults: 0,
        case,
    };
    property.updates(&text, "");
    for (at, line) in lines.iter().enumerate() {
        property.faults_of(&text, line, lines.get(at + 1));
        let before = lines[..at].iter().rev().find(|other| {
            let list = |line: &Line<'_>| {
                line.within
                    .rfind('[')
                    .map(|at| line.within[..at].to_owned())
            };
            matches!(other.node.kind, Kind::Id) && list(other) == list(line)
        });
        if let (Kind::Id, Some(before)) = (&line.node.kind, before) {
            let mut toml = text.clone();
            toml[line.at].clone_from(&text[before.at]);
            property.refuses(&toml, "rule-broken", &format!("{}id", line.within), line.at);
        }
    }
    Ok(property)
}

/// Values of the tables of the framework.
fn framework() -> Case {
    let slots = ["Laser", "Laser1", "lasers"].map(|name| rc_configuration::Slot {
        is_array: name == "lasers",
        name,
        what: "requires `Laser`".to_owned(),
    });
    let instances = [
        ("", true),
        ("[component]\nperiod = '20ms'\nlog = 'warn'", true),
        ("[component]\nperiod = '1.5 s'", true),
        ("[component]\nperiod = 0.5", true),
        ("[bindings]\nlasers.front = 'a/b'\nLaser = 'a/c'", true),
        ("[bindings]\n\"lasers.front\" = 'a/b'", true),
        ("[bindings]\nlasers.front = 'a b'", false),
        ("[component]\nperiod = 0.01", false),
        ("[component]\nperiod = '20 parsecs'", false),
        ("[component]\nlog = 'loud'", false),
        ("[component]\nlogs = 'warn'", false),
        ("[bindings]\nLaser = 'house/simulator/Laser'", true),
        ("[bindings]\nLaser = 'no address'", false),
        ("[bindings]\nLasr = 'house/Laser'", false),
        ("[middleware.iceoryx2]\nsegment = 5", false),
        ("[middleware.iceoryx2]", true),
        ("[middleware.dds]\ndomain = 232\nlease = '100ms'", true),
        (
            "[middleware.dds]\ninterfaces = ['eth0']\npeers = []\nmulticast = false",
            true,
        ),
        ("[middleware.dds]\ndomain = 233", false),
        ("[middleware.dds]\nlease = 99", false),
        ("[middleware.dds]\nlease = 500", true),
        ("[middleware.dds]\npeers = '10.0.0.2'", false),
        ("[middleware.ros2]\nnamespace = '/'\nnode = 'n'", true),
        ("[middleware.ros2]\nremap = ['A/b:=~/c', '/d:=e']", true),
        ("[middleware.ros2.remap]\nA = '/b'", true),
        ("[middleware.ros2]\nservice_mapping = 'cyclone'", false),
        ("[middleware.ros2]\nnamespace = 'robot'", false),
        ("[middleware.ros2]\nnode = 'a/b'", false),
        ("[middleware.ros2]\nremap = ['A/b=/c']", false),
        (
            "[middleware.ros2]\nqos = ['A.depth:=5', 'A/b.deadline:=none']",
            true,
        ),
        (
            "[middleware.ros2.qos.A]\ndepth = 5\ndeadline = 'none'\nliveliness = 500\nreliability = 'reliable'",
            true,
        ),
        ("[middleware.ros2]\nqos = ['A.depth=5']", false),
        ("[middleware.ros2.qos.A]\ndepth = 0", false),
        ("[middleware.ros2.qos.A]\ndepth = '5'", false),
        ("[middleware.ros2.qos.A]\ndeadline = true", false),
        ("[middleware.ros2.qos.A]\nhistory = 'keep_all'", false),
        ("[middleware.ros2.qos]\nA = 5", false),
        ("[middleware.ddds]", false),
        ("middleware = 5", false),
        ("[parameters]", true),
        ("[parameters]\nx = 1", false),
        ("[parametres]", false),
    ];
    Case {
        schema: rc_configuration::schema("C", PERIOD, &slots, None),
        instances: instances
            .map(|(toml, allowed)| (json_of(toml), allowed))
            .into(),
    }
}

#[test]
fn defaults_are_accepted_and_every_fault_is_rejected() {
    let (mut faults, mut cases) = (0, vec![framework()]);
    // Numbered seeds make each run identical. The lower half of a seed is the number of random
    // bytes.
    for n in 1..=400_u64 {
        arbtest(|u| {
            let property = property(u)?;
            faults += property.faults;
            // The validator is slow, so it gets only every eighth case.
            if n % 8 == 0 {
                cases.push(property.case);
            }
            Ok(())
        })
        .seed(n << 32 | 1024)
        .run();
    }
    assert!(faults > 5000, "only {faults} faults were tried");
    let test = "defaults_are_accepted_and_every_fault_is_rejected";
    if let Some(python) = python::interpreter(schema::PACKAGE, test) {
        schema::judge(python, &cases);
    }
}
