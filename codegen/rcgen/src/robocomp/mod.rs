//! A folder of RoboComp as files of this framework: components with their configurations, and
//! networks. What cannot be taken over is listed.
//!
//! Descriptions are `.cdsl` files, configurations `etc/config…` (lines, or TOML), networks the files
//! of rcmanager and `sub.toml`. Interfaces and state machines are copied.

mod components;
mod deployments;
mod parameters;
mod settings;

use components::{Component, stem_of};
use deployments::{Deployment, Node};
use parameters::identifier;
use rc_codegen::files::Owner;
use rc_codegen::{Files, source_files};
use rc_diagnostics::foreign::clean;
use rc_vocabulary::Role;
use settings::Settings;
use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write;
use std::io;
use std::path::{Path, PathBuf};

/// The new files of a folder, and what stays to be done.
#[derive(Debug, Default)]
pub struct Import {
    /// The files, as a workspace has them.
    pub files: Files,
    /// Remaining work for the user: the component, and sentences.
    pub left: Vec<(String, Vec<String>)>,
    /// The components that a network starts.
    placed: BTreeSet<String>,
}

/// A component of a network.
struct Member<'a> {
    name: String,
    component: &'a Component,
    /// The chosen configuration among its own.
    settings: Option<&'a Settings>,
    at: usize,
    node: &'a Node,
}

impl Import {
    /// Reads a folder.
    ///
    /// # Errors
    /// The folder cannot be read. A file that cannot is listed.
    pub fn of(folder: &Path) -> io::Result<Self> {
        std::fs::read_dir(folder)
            .map_err(|e| io::Error::new(e.kind(), format!("{}: {e}", folder.display())))?;
        let is_wanted = |path: &Path| {
            let ending = path.extension().and_then(|ending| ending.to_str());
            matches!(ending, Some("cdsl" | "idsl" | "xml" | "toml"))
        };
        let files = source_files::files(&[folder.to_owned()], &is_wanted)?;
        let with = |ending: &str| {
            let files = files
                .iter()
                .filter(move |file| file.extension().is_some_and(|e| e == ending));
            files.cloned().collect::<Vec<PathBuf>>()
        };
        let mut import = Self::default();
        let mut components: Vec<Component> = Vec::new();
        let mut others = Vec::new();
        for file in with("cdsl") {
            match Component::read(&file, folder) {
                Ok(new) => match components
                    .iter()
                    .find(|known| known.name.eq_ignore_ascii_case(&new.name))
                {
                    Some(known) => others.push(clean(&format!(
                        "{} is left out: the component of {} has its name, too",
                        file.display(),
                        known.folder.display()
                    ))),
                    None => components.push(new),
                },
                Err(reason) => others.push(reason),
            }
        }
        import.take_interfaces(&with("idsl"), &mut others);
        for component in &mut components {
            for (file, text) in std::mem::take(&mut component.files) {
                let path = Path::new("components").join(&component.name).join(file);
                import.files.add(path, Owner::Specific, text);
            }
            let left = std::mem::take(&mut component.left);
            import.left.push((component.name.clone(), left));
        }
        for file in with("toml").into_iter().chain(with("xml")) {
            let text = rc_files::read(&file).unwrap_or_default();
            match Deployment::read(&file, &text) {
                Some(Ok(deployment)) => import.take_network(&deployment, &components),
                Some(Err(reason)) => others.push(reason),
                None => {}
            }
        }
        import.take_unreachable(&components);
        if !others.is_empty() {
            import.left.push(("Other files".to_owned(), others));
        }
        Ok(import)
    }

    /// Whether nothing of RoboComp was found.
    pub fn is_empty(&self) -> bool {
        self.files.iter().next().is_none() && self.left.is_empty()
    }

    /// Remaining work for the user, as a page.
    pub fn report(&self) -> String {
        let mut out = String::from("# What stays to be done\n");
        for (of, left) in self.left.iter().filter(|(_, left)| !left.is_empty()) {
            let _ = write!(out, "\n## {of}\n\n");
            for line in left {
                let _ = writeln!(out, "- {line}");
            }
        }
        out.push_str(
            "\n## All components\n\n\
             - `rcgen check` lists what their descriptions say otherwise. `rcgen generate` makes the code around the worker.\n\
             - Programs that speak Ice cannot be reached. An `external` slot waits for a component that serves it.\n",
        );
        out
    }

    /// Lists the endpoints that no component serves, of components that no network starts.
    fn take_unreachable(&mut self, components: &[Component]) {
        let all = components.iter().flat_map(|component| &component.settings);
        let served: BTreeSet<(&str, u16)> = all
            .flat_map(|settings| &settings.endpoints)
            .map(|(slot, port)| (slot.as_str(), *port))
            .collect();
        let alone = components.iter().zip(&mut self.left);
        for (component, (_, left)) in alone {
            let name = &component.name;
            let proxies = component
                .settings
                .first()
                .map_or(&[][..], |s| &s.proxies[..]);
            for (slot, address) in proxies.iter().filter(|_| !self.placed.contains(name)) {
                if !served.contains(&(slot.as_str(), address.port)) {
                    let (host, port) = (clean(&address.host), address.port);
                    let slot = clean(slot);
                    left.push(format!(
                        "`{slot}`: no component of the folder serves {host}:{port}"
                    ));
                }
            }
        }
    }

    /// Copies the interfaces, each file name once.
    fn take_interfaces(&mut self, files: &[PathBuf], others: &mut Vec<String>) {
        for file in files {
            let path = Path::new("interfaces").join(file.file_name().unwrap_or_default());
            match (rc_files::read(file), self.files.text(&path)) {
                (Ok(text), None) => self.files.add(path, Owner::Specific, text),
                (Ok(text), Some(known)) if text == known => {}
                (Ok(_), Some(_)) => others.push(clean(&format!(
                    "{} is left out: another file with its name has other contents",
                    file.display()
                ))),
                (Err(error), _) => others.push(clean(&format!("{}: {error}", file.display()))),
            }
        }
    }

    fn take_network(&mut self, deployment: &Deployment, components: &[Component]) {
        let stem = deployment
            .file
            .file_stem()
            .unwrap_or_default()
            .to_string_lossy();
        let mut name = identifier(&stem);
        let place = |name: &str| Path::new("deployments").join(format!("{name}.ddsl"));
        for number in 2.. {
            if self.files.text(&place(&name)).is_none() {
                break;
            }
            name = format!("{}_{number}", identifier(&stem));
        }
        let mut left = Vec::new();
        let mut members: Vec<Member<'_>> = Vec::new();
        let mut missing = Vec::new();
        // The names of members, and how often each alias was there: a file may repeat one without limit.
        let mut names: BTreeSet<String> = BTreeSet::new();
        let mut numbers: BTreeMap<String, u32> = BTreeMap::new();
        for node in &deployment.nodes {
            let Some(component) = component_of(node, components) else {
                let alias = clean(&node.alias);
                let command = clean(&node.words.join(" "));
                left.push(format!(
                    "`{alias}` is left out: no component of the folder is that of `{command}`"
                ));
                missing.push(format!("{alias}: {command}"));
                continue;
            };
            let is_named = |settings: &Settings| {
                let own = stem_of(&settings.file);
                let mut words = node.words.iter();
                words.any(|word| stem_of(Path::new(word)) == own)
            };
            let at = component.settings.iter().position(is_named);
            let words = &node.words;
            if let Some(word) = words
                .iter()
                .find(|word| word.contains("etc/"))
                .filter(|_| at.is_none())
            {
                let (alias, word) = (clean(&node.alias), clean(word));
                left.push(format!(
                    "`{alias}` has the usual configuration: there is no `{word}`"
                ));
            }
            let own = identifier(&node.alias);
            let number = numbers.entry(own.to_ascii_lowercase()).or_insert(0);
            let name = loop {
                *number += 1;
                let name = match *number {
                    1 => own.clone(),
                    number => format!("{own}_{number}"),
                };
                if names.insert(name.to_ascii_lowercase()) {
                    break name;
                }
            };
            let at = at.unwrap_or(0);
            self.placed.insert(component.name.clone());
            members.push(Member {
                name,
                component,
                settings: component.settings.get(at),
                at,
                node,
            });
        }
        let text = network(&name, &deployment.file, &members, &missing, &mut left);
        self.files.add(place(&name), Owner::Specific, text);
        self.left.push((format!("The network {name}"), left));
    }
}

/// The component that a node starts: its folder is the longest one at the end of a path of the node,
/// or its program has its name.
fn component_of<'a>(node: &Node, components: &'a [Component]) -> Option<&'a Component> {
    let parts = |path: &Path| -> Vec<String> {
        let parts = path.components();
        parts
            .map(|part| part.as_os_str().to_string_lossy().into_owned())
            .collect()
    };
    let mut best: Option<(usize, &Component)> = None;
    for component in components {
        let own = parts(&rc_codegen::paths::absolute(&component.folder).unwrap_or_default());
        for path in std::iter::once(&node.folder).chain(&node.words) {
            // A path leads into the folder, or to its `bin`, `src` or `etc`.
            for above in Path::new(path).ancestors().take(3) {
                let given = parts(above);
                let pairs = own.iter().rev().zip(given.iter().rev());
                let equal = pairs.take_while(|(a, b)| a == b).count();
                if equal > best.map_or(0, |(most, _)| most) {
                    best = Some((equal, component));
                }
            }
        }
    }
    best.map(|(_, component)| component).or_else(|| {
        let programs = node
            .words
            .iter()
            .filter_map(|word| Path::new(word).file_stem()?.to_str());
        let mut found = components.iter().filter(|component| {
            let mut programs = programs.clone();
            programs.any(|program| program.eq_ignore_ascii_case(&component.name))
        });
        found.next().filter(|_| found.next().is_none())
    })
}

/// The `.ddsl`.
fn network(
    name: &str,
    file: &Path,
    members: &[Member<'_>],
    missing: &[String],
    left: &mut Vec<String>,
) -> String {
    let mut out = format!("// From {}.\n", settings::name(file));
    for line in missing {
        let _ = writeln!(out, "// Left out: {line}");
    }
    let _ = write!(out, "\nDeployment {name}\n{{\n");
    let hosts: BTreeSet<&str> = members
        .iter()
        .filter_map(|member| member.node.host.as_deref())
        .collect();
    for host in &hosts {
        let address = clean(host).replace('"', "");
        let _ = write!(
            out,
            "    Host {}\n    {{\n        address \"{address}\";\n    }};\n\n",
            identifier(host)
        );
        left.push(format!("host `{address}`: `rcdeploy up` reaches it by ssh; a `user` may be missing (docs/several-machines.md)"));
    }
    for member in members {
        let component = &member.component.name;
        let folder = format!("../components/{component}");
        let _ = write!(
            out,
            "    Component {}\n    {{\n        cdsl \"{folder}/{component}.cdsl\";\n",
            member.name
        );
        if member.at > 0 {
            let file = member.component.configuration(member.at);
            let _ = writeln!(out, "        config \"{folder}/{}\";", file.display());
        }
        if let Some(host) = &member.node.host {
            let _ = writeln!(out, "        host {};", identifier(host));
        }
        let after = members
            .iter()
            .filter(|other| member.node.after.contains(&other.node.alias));
        let after: Vec<&str> = after.map(|other| other.name.as_str()).collect();
        if !after.is_empty() {
            let _ = writeln!(out, "        after {};", after.join(", "));
        }
        let is_there = |alias: &&String| members.iter().any(|other| other.node.alias == **alias);
        for alias in member.node.after.iter().filter(|alias| !is_there(alias)) {
            let (name, alias) = (&member.name, clean(alias));
            left.push(format!(
                "`{name}` does not wait for `{alias}`: the network has no such component"
            ));
        }
        out.push_str("    };\n\n");
    }
    for member in members {
        let needs = member
            .component
            .slots
            .iter()
            .filter(|(role, _)| *role == Role::Requires);
        for (_, slot) in needs {
            out.push_str(&connection(member, slot, members, left));
        }
    }
    out.push_str("};\n");
    out
}

/// The line that connects a required slot, by the ports of the configurations.
fn connection(
    member: &Member<'_>,
    slot: &str,
    members: &[Member<'_>],
    left: &mut Vec<String>,
) -> String {
    let Member { name, settings, .. } = member;
    let proxies = settings.map_or(&[][..], |settings| &settings.proxies[..]);
    let address = proxies
        .iter()
        .find(|(proxy, _)| proxy == slot)
        .map(|(_, address)| address);
    let serves = |other: &&Member<'_>| {
        let endpoints = other
            .settings
            .map_or(&[][..], |settings| &settings.endpoints[..]);
        endpoints
            .iter()
            .any(|(served, port)| served == slot && Some(*port) == address.map(|a| a.port))
    };
    let mut servers = members.iter().filter(serves);
    match (servers.next(), servers.next()) {
        (Some(server), None) => format!("    bind {name}.{slot} -> {}.{slot};\n", server.name),
        (found, _) => {
            let place = address.map_or_else(
                || "its configuration names no endpoint".to_owned(),
                |address| {
                    let (host, port) = (clean(&address.host), address.port);
                    let who = if found.is_some() {
                        "several components serve"
                    } else {
                        "no component of the network serves"
                    };
                    format!("{who} {host}:{port}")
                },
            );
            left.push(format!("`{name}.{slot}` is external: {place}"));
            format!("    external {name}.{slot};\n")
        }
    }
}
