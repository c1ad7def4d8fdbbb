//! `cargo xtask experiment components`: the tasks over ten components and ten networks of this
//! repository, with the tools, and by hand against the same runtime without the generator.
//!
//! By hand, a person writes what the generator writes: all code that changes in `generated/`, without
//! comments, documentation, schemas and what only tools read, and the signatures that `rcgen stubs` prints. In place of a
//! network, it is a script that starts each component with its arguments.

use super::boxes::{Row, quartiles, svg};
use crate::programs::{Failure, cargo, finish, output, root, target};
use std::collections::HashMap;
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

/// Typed text.
#[derive(Clone, Copy, Default)]
struct Typed {
    lines: usize,
    /// Without the blanks that an editor indents with; the end of a line counts.
    keys: usize,
}

impl Typed {
    fn add(&mut self, text: &str) {
        for line in text.lines().map(str::trim).filter(|line| !line.is_empty()) {
            self.lines += 1;
            self.keys += line.chars().count() + 1;
        }
    }

    fn of(text: &str) -> Self {
        let mut typed = Self::default();
        typed.add(text);
        typed
    }

    fn and(mut self, text: &str) -> Self {
        self.add(text);
        self
    }
}

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
    let mut clone = Command::new("git");
    clone
        .args(["clone", "--quiet", "--shared"])
        .arg(root())
        .arg(&copy.root);
    output(clone, LIMIT)?;
    // What a generator of other versions would change is no part of a task.
    copy.tool("rcgen", &["generate"])?;
    copy.git(&["add", "--all"])?;
    let mut measured: Vec<[Vec<Typed>; 2]> = vec![Default::default()];
    // A short run has two of each.
    let count = if smoke { 2 } else { COMPONENTS.len() };
    for network in NETWORKS.into_iter().take(count) {
        let [tools, hand] = copy.deploy(network)?;
        measured[0][0].push(tools);
        measured[0][1].push(hand);
    }
    for (task, name) in TASKS.iter().enumerate().skip(1) {
        let mut both: [Vec<Typed>; 2] = Default::default();
        for component in COMPONENTS.into_iter().take(count) {
            let failed = |error: Failure| format!("{name}, {component}: {error}");
            let [tools, hand] = copy.perform(task, component).map_err(failed)?;
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
        let tools = Typed::of(&code).and(&format!("rcdeploy up {network}.ddsl"));
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
            .and(&format!("sh {network}.sh"));
        Ok([tools, hand])
    }

    /// One of the other tasks, at a component.
    fn perform(&self, task: usize, component: &str) -> Result<[Typed; 2], Failure> {
        let cdsl = format!("components/{component}/{component}.cdsl");
        let path = self.root.join(&cdsl);
        let before = fs::read_to_string(&path)?;
        let (descriptions, code) = match task {
            1 => (Self::library(&path, &before)?, CLASS.to_owned()),
            2 => {
                let line = self.method(&before)?;
                (line, "ctx.device.added(1)?;\n".to_owned())
            }
            3 => {
                let lines = add_slot(&path, &before, "implements", "TouchSensor")?;
                (lines, "self.touched()\n".to_owned())
            }
            _ => {
                let lines = add_slot(&path, &before, "requires", "Ultrasound")?;
                (
                    lines,
                    "let sensors = ctx.added.get_all_sensor_distances()?;\n".to_owned(),
                )
            }
        };
        self.tool("rcgen", &["generate", &cdsl])?;
        let tools = Typed::of(&descriptions)
            .and(&code)
            .and("rcgen generate")
            .and(&format!("rcgen stubs {component}"));
        let mut hand = Typed::of(&code);
        hand.add(&self.stubs(&cdsl)?);
        hand.add(&generated(&self.git(&[
            "diff",
            "--unified=0",
            "--no-color",
        ])?));
        hand.add(&generated(&self.new_files()?));
        self.git(&["checkout", "--quiet", "--", "."])?;
        self.git(&["clean", "--quiet", "--force", "-d"])?;
        Ok([tools, hand])
    }

    /// The texts of files that the task has added, as a diff.
    fn new_files(&self) -> Result<String, Failure> {
        let names = self.git(&["ls-files", "--others", "--exclude-standard"])?;
        let mut out = String::new();
        for name in names.lines() {
            out.push_str(&format!("+++ b/{name}\n"));
            let text = fs::read_to_string(self.root.join(name))?;
            text.lines()
                .for_each(|line| out.push_str(&format!("+{line}\n")));
        }
        Ok(out)
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

    /// Adds an operation to the first interface that the component imports; to another one, if it
    /// imports none.
    fn method(&self, cdsl: &str) -> Result<String, Failure> {
        let imports = cdsl
            .lines()
            .filter_map(|line| line.trim().strip_prefix("import \""));
        let mut files = imports.filter_map(|rest| rest.strip_suffix(".idsl\";"));
        let name = files.next().unwrap_or("Bumper");
        let path = self.root.join(format!("components/interfaces/{name}.idsl"));
        let text = fs::read_to_string(&path)?;
        let at = text
            .find("    interface ")
            .ok_or("a module has an interface")?;
        let open = at + text[at..].find('{').ok_or("an interface has a body")? + 1;
        let is_topic = text[open..].trim_start().starts_with("void ") && name.ends_with("Pub");
        let line = if is_topic || name == "Camera" {
            "        void added(int amount);\n"
        } else {
            "        int added(int amount);\n"
        };
        let end = open
            + text[open..]
                .find("    };")
                .ok_or("an interface has an end")?;
        fs::write(&path, format!("{}{line}{}", &text[..end], &text[end..]))?;
        Ok(line.to_owned())
    }

    /// What `rcgen stubs` prints to be pasted.
    fn stubs(&self, cdsl: &str) -> Result<String, Failure> {
        let printed = self.tool("rcgen", &["stubs", cdsl])?;
        let code = printed
            .lines()
            .filter(|line| !line.trim_start().starts_with("//"));
        Ok(code.map(|line| format!("{line}\n")).collect())
    }
}

/// Adds a slot to a component, and the import of its interface.
fn add_slot(path: &Path, before: &str, role: &str, interface: &str) -> Result<String, Failure> {
    let import = format!("import \"{interface}.idsl\";\n");
    let first = before.find("Component ").ok_or("a component has a name")?;
    let known = format!(" {role} ");
    let (at, slot) = if let Some(at) = before.find(&known) {
        (at + known.len(), format!("{interface} as added, "))
    } else {
        let at = before.find("Communications");
        let at = at.ok_or("a component communicates")?;
        let open = at + before[at..].find('{').ok_or("a block begins")? + 1;
        (open, format!("\n        {role} {interface} as added;\n"))
    };
    let text = format!(
        "{}{import}{}{slot}{}",
        &before[..first],
        &before[first..at],
        &before[at..]
    );
    fs::write(path, text)?;
    Ok(import + &slot)
}

/// Whether a person without the generator types a line: no comment, and nothing that only tools read,
/// as hashes of types and descriptions in JSON.
fn is_code(line: &str) -> bool {
    let is_for_tools =
        line.contains("hash") || line.contains("const NOTE") || line.starts_with("{\"");
    !is_for_tools && !line.starts_with("//") && !line.starts_with('#')
}

/// The code in `generated/` that a diff adds, without comments.
fn generated(diff: &str) -> String {
    let mut counts = false;
    let mut out = String::new();
    // A line that only moves is not typed.
    let mut removed: HashMap<&str, usize> = HashMap::new();
    for line in diff.lines() {
        if let Some(name) = line.strip_prefix("+++ b/") {
            let is_code = [".rs", ".toml"].iter().any(|end| name.ends_with(end));
            counts = is_code && name.contains("/generated/");
        } else if let Some(text) = line.strip_prefix('-').filter(|_| counts) {
            *removed.entry(text.trim()).or_default() += 1;
        }
    }
    for line in diff.lines() {
        if let Some(name) = line.strip_prefix("+++ b/") {
            let is_code = [".rs", ".toml"].iter().any(|end| name.ends_with(end));
            counts = is_code && name.contains("/generated/");
            continue;
        }
        let Some(text) = line.strip_prefix('+').filter(|_| counts) else {
            continue;
        };
        let text = text.trim();
        if let Some(count) = removed.get_mut(text).filter(|count| **count > 0) {
            *count -= 1;
        } else if is_code(text) {
            out.push_str(text);
            out.push('\n');
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_code_of_generated_files_counts() {
        let diff = "\
--- a/components/a/generated/src/slots.rs
+++ b/components/a/generated/src/slots.rs
@@ -1 +1,4 @@
-moved();
+// A comment.
+    model_hash: 0x1,
+{\"name\":\"x\"}
+let x = 1;

+moved();
+let y = 2;
--- a/components/a/a.cdsl
+++ b/components/a/a.cdsl
+requires Laser;
+++ b/components/a/generated/operations.md
+# Text
";
        assert_eq!(generated(diff), "let x = 1;\nlet y = 2;\n");
        let typed = Typed::of("  ab\n\n c\n");
        assert_eq!((typed.lines, typed.keys), (2, 5));
    }
}
