//! A component that can be edited randomly and printed in many layouts.

use std::fs;
use std::path::Path;

/// Deterministic random numbers (xorshift64).
pub(crate) struct Random(u64);

impl Random {
    pub(crate) fn new(seed: u64) -> Self {
        Self(seed)
    }

    /// A number below `end`.
    pub(crate) fn below(&mut self, end: usize) -> usize {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        usize::try_from(self.0 >> 33).expect("31 bits") % end
    }

    pub(crate) fn one_in(&mut self, count: usize) -> bool {
        self.below(count) == 0
    }

    fn of<T: Clone>(&mut self, all: &[T]) -> T {
        all[self.below(all.len())].clone()
    }

    fn shuffle<T>(&mut self, all: &mut [T]) {
        for end in (1..all.len()).rev() {
            all.swap(end, self.below(end + 1));
        }
    }
}

const ROLES: [&str; 4] = ["implements", "requires", "publishes", "subscribesTo"];
/// Each interface with its file and whether it is for topics; `None` allows both.
const INTERFACES: [(&str, &str, Option<bool>); 10] = [
    ("Laser", "Laser", Some(false)),
    ("LaserPub", "LaserPub", None),
    ("DifferentialRobot", "DifferentialRobot", Some(false)),
    ("Speech", "Speech", Some(false)),
    ("GenericBase", "GenericBase", Some(false)),
    ("CommonBehavior", "CommonBehavior", Some(false)),
    ("FullPoseEstimationPub", "FullPoseEstimationPub", None),
    ("Mine", "Own", Some(false)),
    ("News", "Own", Some(true)),
    ("Tiny", "Own", None),
];
const OPERATIONS: [&str; 12] = [
    "int count();",
    "command turn(@unit(\"rad/s\") float speed);",
    "query waits(int a);",
    "Points path(Point from, out string<5> name, @optional out Kind kind);",
    "void mayFail(int x) throws Failed;",
    "Table table(Table table) throws Failed, Worse;",
    "idempotent bool isConnected();",
    "void type(int match, out int self);",
    "/** Says it. */ void publish(string command);",
    "sequence<string> gather(out sequence<string> aRatherLongName, out sequence<float> another);",
    "void compute(@range(min=0, max=1) double share);",
    "query initialize(out bool done);",
];
const TOPICS: [&str; 5] = [
    "void moved(Point to);",
    "publish many(Points points, @optional Kind kind);",
    "publish void empty();",
    "/// Everything.\n void tables(Table table);",
    "idempotent void state(Kind kind);",
];
const NAMES: [&str; 10] = [
    "front", "Rear", "type", "match", "State", "worker", "my_own", "Context", "left2", "request_",
];

#[derive(Clone)]
struct Slot {
    role: usize,
    interface: usize,
    name: Option<&'static str>,
    backend: Option<&'static str>,
    qos: Vec<&'static str>,
}

/// A valid component.
#[derive(Clone)]
pub(crate) struct Model {
    slots: Vec<Slot>,
    period: Option<&'static str>,
    parameters: Vec<&'static str>,
    more: Vec<&'static str>,
    operations: Vec<&'static str>,
    topics: Vec<&'static str>,
    unused_import: bool,
}

impl Model {
    /// One slot of each kind.
    pub(crate) fn new() -> Self {
        let slot = |role, interface| Slot {
            role,
            interface,
            name: None,
            backend: None,
            qos: Vec::new(),
        };
        Self {
            slots: vec![slot(0, 7), slot(1, 0), slot(2, 1), slot(3, 8)],
            period: None,
            parameters: Vec::new(),
            more: Vec::new(),
            operations: OPERATIONS[..4].to_vec(),
            topics: TOPICS[..2].to_vec(),
            unused_import: false,
        }
    }

    /// Makes one change that keeps it valid.
    pub(crate) fn edit(&mut self, random: &mut Random) {
        match random.below(10) {
            0..=2 if self.slots.len() < 12 => self.add_slot(random),
            0..=3 if !self.slots.is_empty() => {
                let at = random.below(self.slots.len());
                self.slots.remove(at);
            }
            4 => random.shuffle(&mut self.slots),
            5 => self.edit_slot(random),
            6 => toggle(&mut self.operations, random.of(&OPERATIONS)),
            7 => toggle(&mut self.topics, random.of(&TOPICS)),
            8 => {
                let periods = ["20ms", "5", "1.5s", "1min", "100us", "0.1s"];
                self.period = (!random.one_in(4)).then(|| random.of(&periods));
                let parameters = [
                    "speed float 0.5 0:1 T;",
                    "name string \"x\";",
                    "list motors 0:4 { id int 0:9; };",
                ];
                toggle(&mut self.parameters, random.of(&parameters));
            }
            _ => {
                let clauses = [
                    "gui egui;",
                    "options agmagent;",
                    "statemachine \"a.smdsl\";",
                    "dependencies { };",
                ];
                toggle(&mut self.more, random.of(&clauses));
                self.unused_import = random.one_in(2);
            }
        }
    }

    fn add_slot(&mut self, random: &mut Random) {
        let interface = random.below(INTERFACES.len());
        let role = match INTERFACES[interface].2 {
            Some(topic) => random.below(2) + if topic { 2 } else { 0 },
            None => random.below(4),
        };
        self.slots.push(Slot {
            role,
            interface,
            name: None,
            backend: None,
            qos: Vec::new(),
        });
    }

    fn edit_slot(&mut self, random: &mut Random) {
        if self.slots.is_empty() {
            return;
        }
        let at = random.below(self.slots.len());
        let name = random.of(&NAMES);
        let free = self.slots.iter().all(|s| s.name != Some(name));
        let slot = &mut self.slots[at];
        match random.below(3) {
            0 => slot.name = free.then_some(name),
            1 => {
                let backends = [None, Some("iceoryx2"), Some("ice"), Some("Iceoryx2")];
                slot.backend = random.of(&backends);
            }
            _ if slot.role < 2 => toggle(&mut slot.qos, "timeout 250ms;"),
            _ => {
                let settings = [
                    "reliability best_effort;",
                    "depth 3;",
                    "durability transient_local;",
                    "deadline 1s;",
                ];
                toggle(&mut slot.qos, random.of(&settings));
            }
        }
    }

    /// Its files, in a random layout.
    pub(crate) fn print(&self, name: &str, random: &mut Random) -> Vec<(&'static str, String)> {
        let mut imports: Vec<&str> = self
            .slots
            .iter()
            .map(|s| INTERFACES[s.interface].1)
            .collect();
        if self.unused_import {
            imports.push("Speech");
        }
        imports.sort_unstable();
        imports.dedup();
        random.shuffle(&mut imports);
        let mut text = Text {
            out: String::new(),
            random,
        };
        for import in imports {
            let form = text.random.below(4);
            text.words("import");
            text.words(&match form {
                0 => format!("\"{import}\";"),
                1 => format!("\"/nowhere//{import}.idsl\";"),
                2 => format!("\"../{import}.idsl\";"),
                _ => format!("\"{import}.idsl\";"),
            });
        }
        text.out.push_str("\n/// A component.\n");
        text.keyword("Component");
        text.words(name);
        text.words("{");
        let mut clauses: Vec<String> = self.more.iter().map(|c| (*c).to_owned()).collect();
        clauses.extend(["Communications", "language"].map(str::to_owned));
        clauses.extend(self.period.map(|p| format!("period {p};")));
        if !self.parameters.is_empty() {
            clauses.push("parameters \"edited.pdsl\";".to_owned());
        }
        text.random.shuffle(&mut clauses);
        for clause in clauses {
            match clause.as_str() {
                "Communications" => self.communications(&mut text),
                "language" => {
                    text.keyword("language");
                    text.words("Rust ;");
                }
                other => text.words(other),
            }
        }
        text.words("}");
        if text.random.one_in(2) {
            text.words(";");
        }
        let pdsl = format!(
            "ComponentParams {name} {{ {} }};\n",
            self.parameters.join("\n")
        );
        let idsl = format!(
            "module Own {{ struct Point {{ float x; }}; sequence<Point> Points; enum Kind {{ None, Some = 4 }};\n\
             dictionary<string, Points> Table; exception Failed {{ string why; }}; exception Worse extends Failed {{ }};\n\
             interface Mine {{ {} }};\ninterface News {{ {} }};\ninterface Tiny {{ void go(); }};\n}};\n",
            self.operations.join("\n"),
            self.topics.join("\n")
        );
        vec![
            ("edited.cdsl", text.out),
            ("edited.pdsl", pdsl),
            ("Own.idsl", idsl),
            ("a.smdsl", "a { initial_state start; };\n".to_owned()),
        ]
    }

    fn communications(&self, text: &mut Text<'_>) {
        text.keyword("Communications");
        text.words("{");
        let mut roles = [0, 1, 2, 3];
        text.random.shuffle(&mut roles);
        for role in roles {
            let mut first = true;
            for slot in self.slots.iter().filter(|s| s.role == role) {
                if first {
                    let request = role == 1 && text.random.one_in(3);
                    text.keyword(if request { "request" } else { ROLES[role] });
                } else {
                    text.words(",");
                }
                first = false;
                text.words(INTERFACES[slot.interface].0);
                if let Some(backend) = slot.backend {
                    text.words(&format!("( {backend} )"));
                }
                if let Some(name) = slot.name {
                    text.keyword("as");
                    text.words(name);
                }
                if !slot.qos.is_empty() {
                    text.words(&format!("{{ {} }}", slot.qos.join(" ")));
                }
            }
            if !first {
                text.words(";");
            }
        }
        text.words("} ;");
    }
}

fn toggle(all: &mut Vec<&'static str>, one: &'static str) {
    let count = all.len();
    all.retain(|other| *other != one);
    if all.len() == count {
        all.push(one);
    }
}

/// Words with random white space and comments between them.
struct Text<'a> {
    out: String,
    random: &'a mut Random,
}

impl Text<'_> {
    /// Appends words unchanged. A word with a quotation mark is not split.
    fn words(&mut self, words: &str) {
        for word in words.split(' ') {
            let gaps = [
                " ",
                " ",
                " ",
                "\n",
                "\r\n",
                "\t",
                " /* { */ ",
                " // }; \"\n",
                "\n\n    ",
            ];
            let gap = self.random.of(&gaps);
            self.out.push_str(word);
            self.out.push_str(gap);
        }
    }

    /// Appends a keyword in random case.
    fn keyword(&mut self, word: &str) {
        let word = match self.random.below(6) {
            0 => word.to_uppercase(),
            1 => word.to_lowercase(),
            _ => word.to_owned(),
        };
        self.words(&word);
    }
}

/// An edit that may make a description invalid.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Spoiled(usize);

impl Spoiled {
    pub(crate) fn new(random: &mut Random) -> Self {
        Self(random.below(14))
    }

    /// Whether the description is valid after the edit; `None` if uncertain.
    pub(crate) fn validity(self) -> Option<bool> {
        (self.0 < 13).then_some(false)
    }

    pub(crate) fn apply(self, folder: &Path, model: &Model, random: &mut Random) {
        let cdsl = folder.join("edited.cdsl");
        let text = fs::read_to_string(&cdsl).expect("a text");
        let end = text.rfind('}').expect("the end of the component");
        let with = |more: &str| format!("{}\n{more} {}", &text[..end], &text[end..]).into_bytes();
        let mut bytes = match self.0 {
            0 => with("period 1s; period 2s;"),
            1 => with("periods 1s;"),
            2 => with("Communications { };"),
            3 => with("language fortran;"),
            4 => text.replacen("Rust", "ada", 1).into_bytes(),
            5 => text.replacen("Rust", "Rsut", 1).into_bytes(),
            6 => format!("import \"Missing.idsl\"; {text}").into_bytes(),
            7 => {
                let end = text[..end].char_indices().nth(random.below(end));
                text.as_bytes()[..end.map_or(0, |(at, _)| at)].to_vec()
            }
            8 => {
                let mut model = model.clone();
                let (role, interface, backend) = random.of(&[
                    (0, 0, Some("dds")),
                    (3, 7, None),
                    (2, 0, None),
                    (1, 8, Some("corba")),
                ]);
                model.operations = OPERATIONS.to_vec();
                model.topics = TOPICS.to_vec();
                model.slots.push(Slot {
                    role,
                    interface,
                    name: None,
                    backend,
                    qos: Vec::new(),
                });
                for (file, text) in model.print("edited", random) {
                    fs::write(folder.join(file), text).expect("a file");
                }
                return;
            }
            9 => {
                let mut model = model.clone();
                model.slots.extend(["same", "SAME"].map(|name| Slot {
                    role: 1,
                    interface: 9,
                    name: Some(name),
                    backend: None,
                    qos: vec![],
                }));
                model.print("edited", random).remove(0).1.into_bytes()
            }
            10 => {
                let mut model = model.clone();
                model.slots.push(Slot {
                    role: 1,
                    interface: 9,
                    name: None,
                    backend: None,
                    qos: vec!["depth 3;"],
                });
                model.print("edited", random).remove(0).1.into_bytes()
            }
            11 => {
                let mut bytes = text.into_bytes();
                bytes[0] = 0xff;
                bytes
            }
            12 => [&text[..end], "\n}; and more"].concat().into_bytes(),
            _ => text.into_bytes(),
        };
        if self.0 == 13 {
            let at = random.below(bytes.len());
            bytes[at] = random.of(b"{};\"/ax0 \n,");
        }
        fs::write(cdsl, bytes).expect("a file");
    }
}
