//! The components of a folder of RoboComp.

use super::parameters::{Parameters, duration};
use super::settings::{Settings, name};
use rc_cdsl::ast::Clause;
use rc_diagnostics::foreign::clean;
use rc_diagnostics::{SourceMap, Span};
use rc_vocabulary::Role;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// A component, with its configurations.
pub(super) struct Component {
    pub(super) name: String,
    /// The folder that it comes from.
    pub(super) folder: PathBuf,
    /// The configurations; the first one is the usual one.
    pub(super) settings: Vec<Settings>,
    /// The interfaces by role, each with the name of its slot.
    pub(super) slots: Vec<(Role, String)>,
    /// Its new files, by their names in its folder.
    pub(super) files: Vec<(PathBuf, String)>,
    /// Remaining work for the user, in sentences.
    pub(super) left: Vec<String>,
}

impl Component {
    /// Reads a component by its `.cdsl`, which is in a folder of RoboComp.
    pub(super) fn read(file: &Path, within: &Path) -> Result<Self, String> {
        let wrong = |reason: &dyn std::fmt::Display| {
            clean(&format!("{} is left out: {reason}", file.display()))
        };
        let text = rc_files::read(file).map_err(|error| wrong(&error))?;
        let mut sources = SourceMap::new();
        let source = sources.add(file, &text);
        let (parsed, _) = rc_cdsl::parse(&sources, source);
        let description = "it is not a description of a component; `rcgen check` says why";
        let tree = parsed.component.ok_or_else(|| wrong(&description))?;
        let folder = file.parent().unwrap_or(Path::new("")).to_owned();
        let mut left = Vec::new();
        let mut component = Self {
            name: tree.name.text.clone(),
            settings: settings(&folder, &mut left),
            folder,
            slots: Vec::new(),
            files: Vec::new(),
            left,
        };
        // An absolute path leads to an installation of RoboComp.
        let mut edits: Vec<(Span, String)> = Vec::new();
        for import in &parsed.imports {
            let file = Path::new(&import.text).file_name().unwrap_or_default();
            let file = file.to_string_lossy();
            if file != import.text {
                edits.push((import.span, format!("\"{file}\"")));
            }
        }
        let (mut has_parameters, mut has_period) = (false, false);
        for (_, clause) in &tree.clauses {
            match clause {
                Clause::Communications(all) => component.take_slots(all),
                Clause::Parameters(_) => has_parameters = true,
                Clause::Period(_) => has_period = true,
                Clause::StateMachine(machine, ..) => {
                    let name = component.take_machine(&machine.text, within);
                    let name = name.filter(|name| *name != machine.text);
                    edits.extend(name.map(|name| (machine.span, format!("\"{name}\""))));
                }
                _ => {}
            }
        }
        let parameters = Parameters::of(&component.settings);
        let mut clauses = String::new();
        if !parameters.is_empty() && !has_parameters {
            let file = format!("{}.pdsl", component.name);
            clauses.push_str(&format!("    parameters \"{file}\";\n"));
            component
                .files
                .push((file.into(), parameters.pdsl(&component.name)));
        }
        let period = component
            .settings
            .first()
            .and_then(|settings| settings.period);
        if let Some(period) = period.filter(|_| !has_period) {
            clauses.push_str(&format!("    period {};\n", duration(period)));
        }
        for (at, settings) in component.settings.iter().enumerate() {
            let text = parameters.toml(settings);
            component.files.push((component.configuration(at), text));
        }
        component.left.extend(parameters.notes);
        component.take_notes();
        component.files.push((
            format!("{}.cdsl", component.name).into(),
            edited(&text, edits, &clauses),
        ));
        Ok(component)
    }

    /// The new place of a configuration, in the folder of the component.
    pub(super) fn configuration(&self, at: usize) -> PathBuf {
        match at {
            0 => "etc/config.toml".into(),
            _ => format!("etc/{}.toml", stem_of(&self.settings[at].file)).into(),
        }
    }

    fn take_slots(&mut self, all: &[rc_cdsl::ast::Communication]) {
        for communication in all {
            let keyword = communication.keyword.text.as_str();
            let mut roles = Role::ALL.into_iter();
            let Some(role) = roles.find(|role| role.word().eq_ignore_ascii_case(keyword)) else {
                continue;
            };
            for slot in &communication.slots {
                let name = slot.name.as_ref().unwrap_or(&slot.interface);
                let name = name.text.rsplit("::").next().unwrap_or_default();
                self.slots.push((role, name.to_owned()));
            }
        }
    }

    /// Takes a state machine of the folder of RoboComp. Returns its new name, beside the description.
    fn take_machine(&mut self, file: &str, within: &Path) -> Option<String> {
        let mut take = || {
            let path = self.folder.join(file).canonicalize().ok()?;
            let is_machine = path.extension().is_some_and(|ending| ending == "smdsl");
            if !is_machine || !path.starts_with(within.canonicalize().ok()?) {
                return None;
            }
            let name = Path::new(file).file_name()?.to_str()?.to_owned();
            let text = rc_files::read(&path).ok()?;
            self.files.push((name.clone().into(), text));
            Some(name)
        };
        let name = take();
        if name.is_none() {
            let why = if self.folder.join(file).exists() {
                "no .smdsl of the imported folder"
            } else {
                "missing"
            };
            self.left
                .push(clean(&format!("its state machine `{file}` is {why}")));
        }
        name
    }

    /// Remaining work from the configurations, each sentence once, and from the code of the worker.
    fn take_notes(&mut self) {
        for settings in &self.settings {
            for note in &settings.left {
                if !self.left.contains(note) {
                    self.left.push(note.clone());
                }
            }
            for (topic, prefix) in &settings.prefixes {
                self.left.push(clean(&format!(
                    "{}: the topic `{topic}` has the prefix `{prefix}`; a network connects it by `bind`",
                    name(&settings.file)
                )));
            }
        }
        let is_code = |path: &Path| {
            let is_generated = ["genericworker", "ui_", "main."].iter();
            let name = name(path).to_lowercase();
            let mut own = is_generated.filter(|word| name.starts_with(**word));
            own.next().is_none()
                && [".cpp", ".h", ".hpp", ".py"]
                    .iter()
                    .any(|end| name.ends_with(end))
        };
        let source = self.folder.join("src");
        let entries = std::fs::read_dir(&source).into_iter().flatten().flatten();
        let files: Vec<PathBuf> = entries
            .map(|entry| entry.path())
            .filter(|path| is_code(path))
            .collect();
        if !files.is_empty() {
            let lines = files.iter().filter_map(|file| rc_files::read(file).ok());
            let lines: usize = lines.map(|text| text.lines().count()).sum();
            self.left.push(clean(&format!(
                "{} lines of code in {} stay; move them into the worker that `rcgen generate` makes (docs/from-robocomp.md)",
                lines,
                source.display()
            )));
        }
    }
}

/// The name of a configuration. `config.toml` and `config` are two forms of one.
pub(super) fn stem_of(file: &Path) -> String {
    let name = file.file_name().unwrap_or_default().to_string_lossy();
    name.strip_suffix(".toml").unwrap_or(&name).to_owned()
}

/// The configurations of a component: `etc/config.toml`, else `etc/config`, then others by name.
fn settings(folder: &Path, left: &mut Vec<String>) -> Vec<Settings> {
    let entries = std::fs::read_dir(folder.join("etc"))
        .into_iter()
        .flatten()
        .flatten();
    let is_configuration = |path: &PathBuf| name(path).starts_with("config") && path.is_file();
    let mut files: Vec<PathBuf> = entries
        .map(|entry| entry.path())
        .filter(is_configuration)
        .collect();
    files.sort_by_key(|path| {
        let (stem, is_toml) = (stem_of(path), path.extension().is_some_and(|e| e == "toml"));
        (stem != "config", stem, !is_toml)
    });
    // Of two forms of one configuration, TOML is the newer one.
    let mut stems = BTreeSet::new();
    files.retain(|path| stems.insert(stem_of(path)));
    let read = |file: PathBuf| {
        // The name is a part of a description.
        let is_plain = |c: char| c.is_ascii_alphanumeric() || "_-.+".contains(c);
        let text = if stem_of(&file).chars().all(is_plain) {
            rc_files::read(&file).map_err(|error| error.to_string())
        } else {
            Err("its name has other characters than letters, digits and `_-.+`".to_owned())
        };
        match text {
            Ok(text) => Some(Settings::parse(&file, &text)),
            Err(reason) => {
                let name = name(&file);
                left.push(clean(&format!("etc/{name} is left out: {reason}")));
                None
            }
        }
    };
    files.into_iter().filter_map(read).collect()
}

/// The description with further clauses at the end of its block.
fn edited(text: &str, mut edits: Vec<(Span, String)>, clauses: &str) -> String {
    let mut out = text.to_owned();
    edits.sort_by_key(|(span, _)| std::cmp::Reverse(span.start));
    // A comment behind the block may have a `}`, too.
    let mut tokens = rc_syntax::tokens(text).into_iter().rev();
    let close = tokens.find(|token| token.text == "}");
    let end = close.map_or(text.len(), |token| token.start);
    let line = text[..end].rfind('\n').map_or(0, |feed| feed + 1);
    let at = if text[line..end].trim().is_empty() {
        line
    } else {
        end
    };
    out.insert_str(at, clauses);
    for (span, new) in edits {
        out.replace_range(span.start..span.end, &new);
    }
    out
}
