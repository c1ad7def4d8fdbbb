//! The processes that run several components: which components are in one, and the fields that they
//! share.

use super::{Resolver, scope_of};
use crate::ast::{self, Field};
use crate::duplicates::check_unique;
use crate::fields::{BlockContext, References, priority, processors, restart};
use crate::model::{Instance, Process, Restart};
use rc_diagnostics::{Diagnostic, Span};
use rc_syntax::Name;
use std::collections::HashMap;

/// `Process NAME { … };`, before its names are resolved.
pub(super) struct Block<'a> {
    tree: &'a ast::Process,
    group: Option<usize>,
    /// The full name.
    path: String,
    /// `restart`, and its location.
    restart: Option<(Restart, Span)>,
    cpu: Vec<u16>,
    cpu_span: Option<Span>,
    priority: Option<(u8, Span)>,
}

impl<'a> Resolver<'a> {
    /// Declares a process and the components in its block, which are in the scope around it.
    pub(super) fn process(&mut self, tree: &'a ast::Process, context: &BlockContext<'_>) {
        self.reserved(&tree.name, context);
        check_unique(
            tree.fields.iter().map(|(word, _)| word),
            "field",
            &mut self.found,
        );
        let mut block = Block {
            tree,
            group: context.group,
            path: format!("{}{}", context.prefix, tree.name.text),
            restart: None,
            cpu: Vec::new(),
            cpu_span: None,
            priority: None,
        };
        for (word, field) in &tree.fields {
            match field {
                Field::Restart(tree) => {
                    block.restart = Some((restart(tree, &mut self.found), word.span));
                }
                Field::Cpu(literals) => {
                    block.cpu = processors(literals, &mut self.found);
                    block.cpu_span = Some(word.span);
                }
                Field::Priority(literal) => {
                    let number = priority(literal, &mut self.found);
                    block.priority = number.map(|number| (number, word.span));
                }
                // The grammar has no further field but `host`, whose name is resolved later.
                _ => {}
            }
        }
        let names = &mut self.scopes[scope_of(context.group)].processes;
        names.declare(&tree.name, self.processes.len(), &mut self.found);
        self.processes.push(block);
        let inside = BlockContext {
            process: Some(tree.name.clone()),
            ..context.clone()
        };
        for tree in &tree.components {
            self.component(tree, &inside);
        }
    }

    /// Gives each component its process, and the fields that it has from there. `references` has an
    /// entry for each component; hosts are resolved.
    pub(super) fn resolve_processes(&mut self, references: &[References]) {
        let blocks = std::mem::take(&mut self.processes);
        for block in &blocks {
            self.deployment.processes.push(Process {
                name: block.tree.name.clone(),
                path: block.path.clone(),
                doc: block.tree.doc.clone(),
                group: block.group,
                instances: Vec::new(),
            });
        }
        for (at, references) in references.iter().enumerate() {
            if let Some(name) = &references.process {
                let process = self.process_named(name, self.deployment.instances[at].group);
                let known = &mut self.deployment.processes[process];
                known.instances.push(at);
                self.deployment.instances[at].process = Some(Name {
                    text: known.path.clone(),
                    span: name.span,
                });
            }
        }
        for at in 0..self.deployment.processes.len() {
            self.check_process_name(at);
            let block = blocks.get(at);
            if self.deployment.processes[at].instances.is_empty() {
                let tree = block.map(|block| block.tree);
                if let Some(tree) = tree.filter(|tree| !tree.incomplete) {
                    let message = format!("process `{}` has no components", tree.name.text);
                    let warning = Diagnostic::warning("empty-process", tree.name.span, message);
                    self.found.push(warning);
                }
                continue;
            }
            self.share_host(at, block, references);
            self.share_restart(at, block, references);
            self.share_processors(at, block);
            self.check_programs(at);
        }
    }

    /// The process of this name in `group` or around it; a block of `Process` declares one for all
    /// blocks inside. Without such a block, the name is of a process of the block that contains it.
    fn process_named(&mut self, name: &Name, group: Option<usize>) -> usize {
        let known = self
            .visible(group)
            .find_map(|scope| scope.processes.known.get(&name.text).copied());
        if let Some(known) = known {
            return known;
        }
        let prefix = group.map(|group| format!("{}.", self.deployment.groups[group].path));
        let number = self.deployment.processes.len();
        let names = &mut self.scopes[scope_of(group)].processes;
        names.declare(name, number, &mut self.found);
        self.deployment.processes.push(Process {
            name: name.clone(),
            path: format!("{}{}", prefix.unwrap_or_default(), name.text),
            doc: Vec::new(),
            group,
            instances: Vec::new(),
        });
        number
    }

    /// A process is stopped and restarted by its name, so no component and no group may have it.
    fn check_process_name(&mut self, at: usize) {
        let process = &self.deployment.processes[at];
        let (name, path, group) = (process.name.clone(), process.path.clone(), process.group);
        self.length("process", &path, name.span);
        let names = &self.scopes[scope_of(group)].places.by_lowercase;
        if let Some(first) = names.get(&name.text.to_lowercase()) {
            let message = format!("duplicate name `{}`", name.text);
            let error = Diagnostic::error("duplicate-name", name.span, message)
                .label(*first, "the name of a component or a group")
                .help("choose another name for the process");
            self.found.push(error);
        }
    }

    /// All components of a process run on one host: that of the process, or the one that some of
    /// them name.
    fn share_host(&mut self, at: usize, block: Option<&Block<'_>>, references: &[References]) {
        let (group, members, path) = self.shared(at);
        let fields = block.map_or(&[][..], |block| &block.tree.fields);
        let own = fields.iter().find_map(|(_, field)| match field {
            Field::Host(name) => Some(name.clone()),
            _ => None,
        });
        let own = own.map(|name| (self.host_named(&name, group), name.span));
        let named = members.iter().filter_map(|member| {
            let name = references[*member].host.as_ref()?;
            let host = self.deployment.instances[*member].host;
            Some((host.map(|(host, _)| host), name.span))
        });
        let mut named: Vec<(Option<usize>, Span)> = own.into_iter().chain(named).collect();
        if named.is_empty() {
            return;
        }
        let (host, first) = named.remove(0);
        let hosts = &self.deployment.hosts;
        let same = |other: Option<usize>| match (host, other) {
            (Some(one), Some(other)) => one == other || hosts[one].is_same(&hosts[other]),
            (None, None) => true,
            (Some(one), None) | (None, Some(one)) => hosts[one].is_local(),
        };
        let other = named.into_iter().find(|(other, _)| !same(*other));
        if let Some((_, span)) = other {
            let message = format!("process `{path}` cannot run on two hosts");
            let error = Diagnostic::error("process-on-two-hosts", span, message)
                .label(first, "the other host")
                .help("give its components one host, or run one of them in another process");
            self.found.push(error);
        }
        for member in members {
            if references[member].host.is_none() {
                self.deployment.instances[member].host = host.map(|host| (host, first));
            }
        }
    }

    /// A process restarts as a whole, so its components have one policy.
    fn share_restart(&mut self, at: usize, block: Option<&Block<'_>>, references: &[References]) {
        let (_, members, path) = self.shared(at);
        let own = block.and_then(|block| block.restart);
        let given = members.iter().filter_map(|member| {
            let span = references[*member].restart?;
            Some((self.deployment.instances[*member].restart, span))
        });
        let given: Vec<(Restart, Span)> = own.into_iter().chain(given).collect();
        let Some((policy, first)) = given.first().copied() else {
            return;
        };
        if let Some((_, span)) = given.iter().find(|(other, _)| *other != policy) {
            let message = format!("process `{path}` restarts as a whole, and has two policies");
            let error = Diagnostic::error("process-restarts-twice", *span, message)
                .label(first, "the other policy")
                .help("write `restart` once, in the block of the process");
            self.found.push(error);
        }
        for member in members {
            self.deployment.instances[member].restart = policy;
        }
    }

    /// A thread has the processors and the priority of its component, or those of the process.
    /// Different priorities in one process are meant only where the process has one as well.
    fn share_processors(&mut self, at: usize, block: Option<&Block<'_>>) {
        let (_, members, path) = self.shared(at);
        let own = block.and_then(|block| block.priority);
        let given = members.iter();
        let given = given.filter_map(|at| self.deployment.instances[*at].priority);
        let given: Vec<(u8, Span)> = given.collect();
        if let Some((priority, first)) = given.first().copied()
            && own.is_none()
            && let Some((other, span)) = given.iter().find(|(other, _)| *other != priority)
        {
            let message = format!(
                "components of process `{path}` have different priorities, {priority} and {other}"
            );
            let higher = priority.max(*other);
            let error = Diagnostic::error("process-priorities", *span, message)
                .label(first, "the other priority")
                .help(format!(
                    "if that is meant, write `priority {higher};` into `Process {}`, for its threads that say none",
                    self.deployment.processes[at].name.text
                ));
            self.found.push(error);
        }
        for member in members {
            let instance = &mut self.deployment.instances[member];
            instance.priority = instance.priority.or(own);
            if let Some(block) = block
                && instance.cpu_span.is_none()
            {
                instance.cpu.clone_from(&block.cpu);
                instance.cpu_span = block.cpu_span;
            }
        }
    }

    /// The program of a process is built from its components, and it has one environment.
    fn check_programs(&mut self, at: usize) {
        let (_, members, path) = self.shared(at);
        let mut variables: HashMap<&str, &(Name, Name)> = HashMap::new();
        let mut folders: Option<&Instance> = None;
        for member in members {
            let instance = &self.deployment.instances[member];
            let first = folders.get_or_insert(instance);
            if first.folder != instance.folder {
                let message = format!(
                    "process `{path}` has one working directory, and components of files in two folders"
                );
                let error = Diagnostic::error("process-directory", instance.name.span, message)
                    .label(first.name.span, "a component of the other folder");
                let help = "declare its components in files of one folder, or run one of them in another process";
                self.found.push(error.help(help));
            }
            if let Some(executable) = &instance.executable {
                let message = format!(
                    "`{}` has an executable of its own, and cannot be a thread of process `{path}`",
                    instance.path
                );
                let error = Diagnostic::error("process-executable", executable.span, message);
                let help = "leave `executable` out: the program of a process is built from the crates of its components";
                self.found.push(error.help(help));
            }
            for variable in &instance.env {
                let (name, value) = variable;
                let (first, other) = variables.entry(&name.text).or_insert(variable);
                if value.text != other.text {
                    let message = format!(
                        "process `{path}` has one environment, and two values of `{}`",
                        name.text
                    );
                    let error = Diagnostic::error("process-environment", name.span, message);
                    self.found.push(error.label(first.span, "the other value"));
                }
            }
        }
    }

    /// The group of a process, its components and its full name.
    fn shared(&self, at: usize) -> (Option<usize>, Vec<usize>, String) {
        let process = &self.deployment.processes[at];
        (
            process.group,
            process.instances.clone(),
            process.path.clone(),
        )
    }
}
