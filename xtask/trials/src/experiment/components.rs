//! `cargo xtask experiment components`: the tasks over ten components and ten networks of this
//! repository, with the tools, and by hand against the same runtime without the generator.
//!
//! By hand, a person types what the generator writes ([`by_hand`]), and what `rcgen stubs` prints to
//! be pasted. In place of a network, it is a script that starts each component with its arguments.

use super::boxes::{Row, quartiles, svg};
use super::strokes::{Typed, by_hand};
use crate::programs::{Failure, cargo, finish, output, root, target};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Duration;

const LIMIT: Duration = Duration::from_mins(20);

/// The components, all in Rust.
const COMPONENTS: [&str; 10] = [
    "arm_monitor",
    "avoider",
    "camera",
    "image_monitor",
    "inner_model",
    "joint_controller",
    "kinematics",
    "motor_bus",
    "simulator",
    "speech_server",
];
const NETWORKS: [&str; 10] = [
    "arm",
    "camera",
    "detect",
    "home",
    "inner_model",
    "joints",
    "kinematics",
    "mirror",
    "patrol",
    "speech",
];
const TASKS: [&str; 5] = [
    "1. deploy a component network",
    "2. include a library and a class",
    "3. a new method of an interface",
    "4. provide a new interface",
    "5. a new proxy for an interface",
];
/// A class that uses the library, and the line that makes it a part of the component.
const CLASS: &str = "//! An average.\n\n#[derive(Default)]\npub struct Average {\n    sum: f64,\n    count: f64,\n}\n\n\
    impl Average {\n    pub fn add(&mut self, value: f64) -> f64 {\n        self.sum += value;\n        self.count += 1.0;\n        \
    libm::round(self.sum / self.count)\n    }\n}\nmod average;\n";

/// Measures all, prints the quartiles, and writes the pictures into `docs/images`, or with `smoke` into
/// a temporary folder.
pub(super) fn run(smoke: bool) -> Result<(), Failure> {
    let folder = tempfile::tempdir()?;
    if !smoke {
        finish(
            cargo(&["build", "--bin", "rcgen", "--bin", "rcdeploy"])?,
            LIMIT,
        )?;
    }
    let copy = Copy {
        root: folder.path().join("copy"),
        tools: target()?.join("debug"),
    };
    copy.fill()?;
    // What a generator of another version would change is no part of a task.
    copy.tool("rcgen", &["generate"])?;
    copy.git(&["add", "--all"])?;
    let base = copy.git(&["write-tree"])?;
    // A short run has two of each.
    let count = if smoke { 2 } else { COMPONENTS.len() };
    let mut measured: Vec<[Vec<Typed>; 2]> = Vec::new();
    for (task, name) in TASKS.iter().enumerate() {
        let mut both: [Vec<Typed>; 2] = Default::default();
        let subjects = if task == 0 { NETWORKS } else { COMPONENTS };
        for subject in subjects.into_iter().take(count) {
            let typed = match task {
                0 => copy.deploy(subject),
                _ => copy.perform(task, subject, base.trim()),
            };
            let [tools, hand] = typed.map_err(|error| format!("{name}, {subject}: {error}"))?;
            both[0].push(tools);
            both[1].push(hand);
        }
        measured.push(both);
    }
    let place = if smoke {
        folder.path().to_owned()
    } else {
        root().join("docs/images")
    };
    let kinds: [(&str, &str, fn(&Typed) -> usize); 2] = [
        ("lines", "lines typed", |typed| typed.lines),
        ("keys", "key strokes", |typed| typed.keys),
    ];
    println!("| task | of what | with the tools | by hand |\n|---|---|---|---|");
    for (file, axis, count) in kinds {
        let values = |of: &[Typed]| {
            of.iter()
                .map(|typed| count(typed) as f64)
                .collect::<Vec<f64>>()
        };
        let mut rows = Vec::new();
        for (task, [tools, hand]) in TASKS.iter().zip(&measured) {
            let [tools, hand] = [values(tools), values(hand)];
            let shown = |values: &[f64]| {
                let [first, median, third] = quartiles(values);
                format!("{median} ({first} to {third})")
            };
            println!("| {task} | {axis} | {} | {} |", shown(&tools), shown(&hand));
            for (way, values, dark) in [("tools", tools, true), ("by hand", hand, false)] {
                rows.push(Row {
                    name: format!("{task}: {way}"),
                    values,
                    dark,
                });
            }
        }
        let title = format!("Five tasks over ten components: {axis}");
        fs::write(
            place.join(format!("experiment-{file}.svg")),
            svg(&title, axis, &rows),
        )?;
    }
    Ok(())
}

/// A copy of this repository.
struct Copy {
    root: PathBuf,
    tools: PathBuf,
}

impl Copy {
    /// Copies the sources, as a repository of git of their own: they may be those of an archive.
    fn fill(&self) -> Result<(), Failure> {
        fs::create_dir(&self.root)?;
        self.git(&["init", "--quiet"])?;
        let mut add = Command::new("git");
        add.arg("--git-dir")
            .arg(self.root.join(".git"))
            .arg("--work-tree")
            .arg(root())
            .args(["add", "--all"])
            .current_dir(root());
        output(add, LIMIT)?;
        self.git(&["checkout-index", "--all"]).map(drop)
    }

    fn git(&self, words: &[&str]) -> Result<String, Failure> {
        let mut command = Command::new("git");
        command.args(words).current_dir(&self.root);
        output(command, LIMIT)
    }

    fn tool(&self, tool: &str, words: &[&str]) -> Result<String, Failure> {
        let mut command = Command::new(self.tools.join(tool));
        command.args(words).current_dir(&self.root);
        output(command, LIMIT)
    }

    /// A network as a file of DDSL with its command, and as a script.
    fn deploy(&self, network: &str) -> Result<[Typed; 2], Failure> {
        let file = format!("components/networks/{network}.ddsl");
        let plan = self.tool(
            "rcdeploy",
            &["plan", "--unbuilt", "--format", "json", &file],
        )?;
        let plan: serde_json::Value = serde_json::from_str(&plan)?;
        let text = fs::read_to_string(self.root.join(&file))?;
        let code = text.lines().filter(|line| !line.trim().starts_with("//"));
        let code: String = code.map(|line| format!("{line}\n")).collect();
        let tools = Typed::of(&code).and(&format!("rcdeploy up {file}"));
        let mut script = "#!/bin/sh\ntrap 'kill 0' INT TERM\n".to_owned();
        let root = format!("{}/", self.root.display());
        for component in plan["components"].as_array().ok_or("no components")? {
            let word =
                |value: &serde_json::Value| value.as_str().unwrap_or_default().replace(&root, "");
            let program = Path::new(&word(&component["executable"]))
                .file_name()
                .map(|name| name.to_string_lossy().into_owned());
            let arguments = component["arguments"].as_array().ok_or("no arguments")?;
            let arguments: Vec<String> = arguments.iter().map(word).collect();
            script.push_str(&format!(
                "{} {} &\n",
                program.unwrap_or_default(),
                arguments.join(" ")
            ));
        }
        let hand = Typed::of(&script)
            .and("wait")
            .and(&format!("sh components/networks/{network}.sh"));
        Ok([tools, hand])
    }

    /// One of the other tasks, at a component. `base` is the tree before it.
    fn perform(&self, task: usize, component: &str, base: &str) -> Result<[Typed; 2], Failure> {
        let cdsl = format!("components/{component}/{component}.cdsl");
        let path = self.root.join(&cdsl);
        let before = fs::read_to_string(&path)?;
        let (descriptions, code) = match task {
            1 => (Self::library(&path, &before)?, CLASS),
            // One line that calls an operation, or answers one.
            2 => (self.method(&before)?, "ctx.device.added(1)?;"),
            3 => (
                add_slot(&path, &before, "implements", "TouchSensor")?,
                "self.touched()",
            ),
            _ => (
                add_slot(&path, &before, "requires", "Ultrasound")?,
                "let sensors = ctx.added.get_all_sensor_distances()?;",
            ),
        };
        self.tool("rcgen", &["generate", &cdsl])?;
        let stubs = self.tool("rcgen", &["stubs", &cdsl])?;
        let mut tools = Typed::of(&descriptions).and(code).and("rcgen generate");
        if !stubs.is_empty() {
            tools = tools.and(&format!("rcgen stubs {cdsl}"));
        }
        self.git(&["add", "--all"])?;
        let diff = self.git(&["diff", "--cached", "--unified=0", "--no-color", base])?;
        let hand = Typed::of(code).and(&pasted(&stubs)).and(&by_hand(&diff));
        self.git(&["read-tree", "--reset", "-u", base])?;
        Ok([tools, hand])
    }

    /// Adds a library to the dependencies of a component.
    fn library(path: &Path, before: &str) -> Result<String, Failure> {
        let (at, text) = if let Some(at) = before.find("    dependencies") {
            let open = before[at..].find('{').ok_or("a block begins")?;
            (at + open + 1, "\n        libm \"0.2\";")
        } else {
            let end = before.rfind("};").ok_or("a component has an end")?;
            (end, "    dependencies { libm \"0.2\"; };\n")
        };
        fs::write(path, format!("{}{text}{}", &before[..at], &before[at..]))?;
        Ok(text.to_owned())
    }

    /// Adds an operation to the first interface that the component imports.
    fn method(&self, cdsl: &str) -> Result<String, Failure> {
        let imports = cdsl
            .lines()
            .filter_map(|line| line.trim().strip_prefix("import \""));
        let mut files = imports.filter_map(|rest| rest.strip_suffix(".idsl\";"));
        let name = files.next().ok_or("a component imports an interface")?;
        let path = self.root.join(format!("components/interfaces/{name}.idsl"));
        // The operations of a topic have no result.
        let result = if name.ends_with("Pub") { "void" } else { "int" };
        let line = format!("        {result} added(int amount);\n");
        insert(&path, "interface ", &line)?;
        Ok(line)
    }
}

/// Adds a slot to a component as the last one of its role, and the import of its interface.
fn add_slot(path: &Path, before: &str, role: &str, interface: &str) -> Result<String, Failure> {
    let import = format!("import \"{interface}.idsl\";\n");
    let imported = before.replacen("Component ", &format!("{import}Component "), 1);
    fs::write(path, &imported)?;
    let Some(clause) = imported.find(&format!("\n        {role} ")) else {
        let slot = format!("        {role} {interface} as added;\n");
        insert(path, "Communications", &slot)?;
        return Ok(import + &slot);
    };
    let mut depth = 0_i32;
    let end = imported[clause..].find(|c| {
        depth += i32::from(c == '{') - i32::from(c == '}');
        c == ';' && depth == 0
    });
    let (head, rest) = imported.split_at(clause + end.ok_or("a clause has an end")?);
    let slot = format!(", {interface} as added");
    fs::write(path, format!("{head}{slot}{rest}"))?;
    Ok(import + &slot)
}

/// Adds a line at the end of the first block that begins with `    BLOCK`.
fn insert(path: &Path, block: &str, line: &str) -> Result<(), Failure> {
    let text = fs::read_to_string(path)?;
    let begin = text.find(&format!("\n    {block}"));
    let end = begin.and_then(|at| Some(at + text[at..].find("\n    }")? + 1));
    let end = end.ok_or_else(|| format!("{}: no block {block}", path.display()))?;
    Ok(fs::write(
        path,
        format!("{}{line}{}", &text[..end], &text[end..]),
    )?)
}

/// What a person types of the output of `rcgen stubs`: without its headings, and without the bodies,
/// which the code of the task replaces.
fn pasted(stubs: &str) -> String {
    let is_typed = |line: &&str| {
        let line = line.trim_start();
        !["//", "let _ =", "Default::default()"]
            .iter()
            .any(|start| line.starts_with(start))
    };
    let lines = stubs.lines().filter(is_typed);
    lines.map(|line| format!("{line}\n")).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_is_added_at_the_end_of_its_block() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("a.cdsl");
        let before = "Component a\n{\n    Communications\n    {\n        requires B { depth 1; };\n    };\n};\n";
        let typed = add_slot(&path, before, "requires", "C").expect("a slot");
        assert_eq!(typed, "import \"C.idsl\";\n, C as added");
        let text = fs::read_to_string(&path).expect("the file");
        let expected = "import \"C.idsl\";\nComponent a\n{\n    Communications\n    {\n        requires B { depth 1; }, C as added;\n    };\n};\n";
        assert_eq!(text, expected);
    }

    #[test]
    fn bodies_of_stubs_are_replaced() {
        let stubs = "// a.rs: at the end\nimpl Added {\n    fn f(&mut self) {\n        let _ = ctx;\n        Default::default()\n    }\n}\n";
        assert_eq!(
            pasted(stubs),
            "impl Added {\n    fn f(&mut self) {\n    }\n}\n"
        );
    }
}
