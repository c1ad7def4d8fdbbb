//! Merges the files of a deployment and resolves their names into the model.

mod chains;
mod processes;
mod references;
mod rules;
mod world;

use crate::ast::HostField;
use crate::ast::{self, Decl};
use crate::check::check;
use crate::duplicates::{check_unique, report_duplicate};
use crate::fields::{BlockContext, References, duration, instance, proxy};
use crate::host_address::{LOCALHOST, wrong_address};
use crate::host_build;
use crate::imports::{File, files};
use crate::link;
use crate::model::{
    Bind, Deployment, External, Group, Host, HostBuild, Instance, InstanceOrGroup, LONGEST_NAME,
    NODE, Peer, Proxy, Setting,
};
use crate::settings::{Block, Choice};
use rc_diagnostics::{Diagnostic, Diagnostics, SourceId, SourceMap, Span};
use rc_syntax::{Literal, Loader, Name};
use std::collections::HashMap;
use std::path::PathBuf;

/// Loads a `.ddsl` text with its imports.
///
/// Returns no deployment if the text cannot be parsed at all. Use the deployment only if no
/// diagnostic is an error.
pub fn load(
    sources: &mut SourceMap,
    loader: &dyn Loader,
    source: SourceId,
) -> (Option<Deployment>, Diagnostics) {
    let mut found = Diagnostics::new();
    let (imported, main, imports) = files(sources, loader, source, &mut found);
    let Some(main) = main else {
        return (None, found);
    };
    let mut resolver = Resolver {
        deployment: Deployment {
            name: main.tree.name.clone(),
            doc: main.tree.doc.clone(),
            end: main.tree.end,
            hosts: Vec::new(),
            instances: Vec::new(),
            processes: Vec::new(),
            groups: Vec::new(),
            binds: Vec::new(),
            time: None,
            ring: None,
            externals: Vec::new(),
            references: Vec::new(),
            imports,
            chains: Vec::new(),
            world: None,
            rules: Vec::new(),
        },
        scopes: vec![Scope::default()],
        references: Vec::new(),
        processes: Vec::new(),
        binds: Vec::new(),
        time: None,
        record: None,
        externals: Vec::new(),
        chains: Vec::new(),
        rules: Vec::new(),
        comparisons: 0,
        found,
    };
    resolver.declare(&imported, &main);
    resolver.resolve_references();
    let Resolver {
        deployment,
        mut found,
        ..
    } = resolver;
    check(&deployment, source, &mut found);
    (Some(deployment), found)
}

/// The names declared in one block: the deployment or a group.
#[derive(Debug, Default)]
struct Scope {
    places: Names<InstanceOrGroup>,
    hosts: Names<usize>,
    /// Indices into [`Resolver::processes`].
    processes: Names<usize>,
}

#[derive(Debug)]
struct Names<T> {
    known: HashMap<String, T>,
    /// The location of the first of the names that differ only in case.
    by_lowercase: HashMap<String, Span>,
}

impl<T> Default for Names<T> {
    fn default() -> Self {
        Self {
            known: HashMap::new(),
            by_lowercase: HashMap::new(),
        }
    }
}

impl<T> Names<T> {
    /// Declares a name. Of two equal names, the first one counts.
    fn declare(&mut self, name: &Name, what: T, found: &mut Diagnostics) {
        if let Some(first) = self.by_lowercase.get(&name.text.to_lowercase()) {
            let message = format!("duplicate name `{}`", name.text);
            let diagnostic = Diagnostic::error("duplicate-name", name.span, message)
                .label(*first, "first declared here");
            found.push(if self.known.contains_key(&name.text) {
                diagnostic
            } else {
                diagnostic.help("choose names that differ in more than case")
            });
            self.known.entry(name.text.clone()).or_insert(what);
            return;
        }
        self.by_lowercase
            .insert(name.text.to_lowercase(), name.span);
        self.known.insert(name.text.clone(), what);
    }
}

struct Resolver<'a> {
    deployment: Deployment,
    /// The scope of the deployment, then those of the groups in order.
    scopes: Vec<Scope>,
    /// The unresolved names of each instance.
    references: Vec<References>,
    /// The blocks of processes.
    processes: Vec<processes::Block<'a>>,
    /// The binds, each with the enclosing group.
    binds: Vec<(Option<usize>, &'a ast::Bind)>,
    /// The clause `time`: its keyword and its path.
    time: Option<(&'a Name, &'a [Name])>,
    /// The location of the clause `record`.
    record: Option<Span>,
    /// The `external` declarations, each with the enclosing group and the folder of its file.
    externals: Vec<(Option<usize>, PathBuf, &'a ast::External)>,
    /// The chains, each with the enclosing group.
    chains: Vec<(Option<usize>, &'a ast::Chain)>,
    /// The rules, each with the enclosing group.
    rules: Vec<(Option<usize>, &'a rc_pdsl::ast::Rule)>,
    comparisons: usize,
    found: Diagnostics,
}

fn scope_of(group: Option<usize>) -> usize {
    group.map_or(0, |group| group + 1)
}

impl<'a> Resolver<'a> {
    fn declare(&mut self, imported: &'a [File], main: &'a File) {
        self.length("network", &main.tree.name.text, main.tree.name.span);
        let context = BlockContext {
            folder: &main.folder,
            prefix: String::new(),
            group: None,
            process: None,
            choice: Choice::default(),
        };
        let network = self.settings(&main.tree.decls, &context);
        for file in imported {
            let context = BlockContext {
                folder: &file.folder,
                ..network.clone()
            };
            let context = self.settings(&file.tree.decls, &context);
            self.block(&file.tree.decls, &context);
        }
        self.block(&main.tree.decls, &network);
    }

    /// The context inside a block: that of the enclosing block with the block's own settings.
    fn settings<'b>(&mut self, decls: &[Decl], context: &BlockContext<'b>) -> BlockContext<'b> {
        let mut block = Block::new(&context.choice, &mut self.found);
        for decl in decls {
            match decl {
                Decl::Middleware(tree) => block.middleware(tree),
                Decl::Domain(word, literal) => block.domain(word, literal),
                Decl::Host(_)
                | Decl::Component(_)
                | Decl::Process(_)
                | Decl::Group(_)
                | Decl::Bind(_)
                | Decl::External(_)
                | Decl::Time(..)
                | Decl::Record(..)
                | Decl::Chain(_)
                | Decl::World(_)
                | Decl::Require(_) => {}
            }
        }
        BlockContext {
            choice: block.end(),
            ..context.clone()
        }
    }

    fn block(&mut self, decls: &'a [Decl], context: &BlockContext<'_>) {
        let scope = scope_of(context.group);
        for decl in decls {
            match decl {
                Decl::Host(tree) => self.host(tree, scope),
                Decl::Component(tree) => self.component(tree, context),
                Decl::Process(tree) => self.process(tree, context),
                Decl::Group(tree) => self.group(tree, context),
                Decl::Bind(tree) => self.binds.push((context.group, tree)),
                Decl::Time(word, path) => self.time(word, path, context),
                Decl::Record(word, fields) => self.record(word, fields, context),
                Decl::External(tree) => {
                    let folder = context.folder.to_path_buf();
                    self.externals.push((context.group, folder, tree));
                }
                Decl::World(tree) => self.world(tree, context),
                Decl::Chain(tree) => self.chains.push((context.group, tree)),
                Decl::Require(tree) => self.rules.push((context.group, tree)),
                Decl::Middleware(_) | Decl::Domain(..) => {}
            }
        }
    }

    fn component(&mut self, tree: &ast::Component, context: &BlockContext<'_>) {
        self.reserved(&tree.name, context);
        let (instance, references) = instance(tree, context, &mut self.found);
        self.length("component", &instance.path, instance.name.span);
        let place = InstanceOrGroup::Instance(self.deployment.instances.len());
        let names = &mut self.scopes[scope_of(context.group)].places;
        names.declare(&tree.name, place, &mut self.found);
        self.deployment.instances.push(instance);
        self.references.push(references);
    }

    fn group(&mut self, tree: &'a ast::Group, context: &BlockContext<'_>) {
        self.reserved(&tree.name, context);
        let number = self.deployment.groups.len();
        let place = InstanceOrGroup::Group(number);
        let names = &mut self.scopes[scope_of(context.group)].places;
        names.declare(&tree.name, place, &mut self.found);
        self.scopes.push(Scope::default());
        check_unique(
            tree.exports.iter().map(|(word, _)| word),
            "clause",
            &mut self.found,
        );
        let exports: Vec<Name> = tree.exports.iter().flat_map(|(_, e)| e).cloned().collect();
        let mut seen: HashMap<&str, Span> = HashMap::new();
        for name in &exports {
            if let Some(first) = seen.insert(&name.text, name.span) {
                let message = format!("duplicate export `{}`", name.text);
                let diagnostic = Diagnostic::error("duplicate-name", name.span, message);
                self.found
                    .push(diagnostic.label(first, "first exported here"));
            }
        }
        let proxy = self.proxy(tree, number, context);
        let first = self.deployment.instances.len();
        let path = format!("{}{}", context.prefix, tree.name.text);
        let mut inside = self.settings(&tree.decls, context);
        inside.prefix = format!("{path}.");
        inside.group = Some(number);
        self.deployment.groups.push(Group {
            name: tree.name.clone(),
            path,
            doc: tree.doc.clone(),
            parent: context.group,
            instances: first..first,
            exports,
            proxy,
            end: tree.end,
        });
        if let Some(proxy) = self.deployment.groups[number].proxy.as_ref() {
            let settings = &mut self.deployment.instances[proxy.instance].settings;
            for set in &inside.choice.settings {
                let known = |own: &Setting| (own.middleware, own.key) == (set.middleware, set.key);
                if set.key != NODE && !settings.iter().any(known) {
                    settings.push(set.clone());
                }
            }
        }
        self.block(&tree.decls, &inside);
        let end = self.deployment.instances.len();
        self.deployment.groups[number].instances.end = end;
        if first == end && !tree.incomplete {
            let message = format!("group `{}` has no components", tree.name.text);
            let warning = Diagnostic::warning("empty-group", tree.name.span, message);
            self.found.push(warning);
        }
    }

    /// Declares the proxy of a group, which is before its components.
    fn proxy(
        &mut self,
        tree: &ast::Group,
        group: usize,
        context: &BlockContext<'_>,
    ) -> Option<Proxy> {
        check_unique(
            tree.proxies.iter().map(|(word, _)| word),
            "clause",
            &mut self.found,
        );
        let (word, clause) = tree.proxies.first()?;
        if tree.exports.is_empty() && !tree.incomplete {
            let message = format!("group `{}` has a proxy and exports nothing", tree.name.text);
            let error = Diagnostic::error("proxy-without-exports", word.span, message);
            self.found.push(error.help(
                "name the slots that are visible outside: `export NAME, NAME;`, or remove `proxy`",
            ));
        }
        let instance = self.deployment.instances.len();
        let made = proxy(tree, clause.as_ref(), context, &mut self.found);
        self.length("component", &made.path, made.name.span);
        self.deployment.instances.push(Instance {
            proxy: Some(group),
            ..made
        });
        self.references.push(References::default());
        Some(Proxy {
            instance,
            span: word.span,
        })
    }

    fn time(&mut self, word: &'a Name, path: &'a [Name], context: &BlockContext<'_>) {
        if let Some(group) = context.group {
            let message = "`time` holds for the whole network, not for a group";
            let error = Diagnostic::error("misplaced-time", word.span, message)
                .label(self.deployment.groups[group].name.span, "the group")
                .help("move it into the block of the deployment");
            return self.found.push(error);
        }
        match &self.time {
            Some((first, _)) => report_duplicate(word, "clause", first.span, &mut self.found),
            None => self.time = Some((word, path)),
        }
    }

    fn record(
        &mut self,
        word: &Name,
        fields: &[(Name, Option<Literal>)],
        context: &BlockContext<'_>,
    ) {
        if let Some((exact, _)) = fields
            .iter()
            .find(|(word, _)| word.text.eq_ignore_ascii_case("exact"))
        {
            let message =
                "`record` with `exact` records a component, not a network, a group or a proxy";
            let error = Diagnostic::error("misplaced-record", exact.span, message);
            return self.found.push(error.help(
                "write `record { exact; };` in each component to record; behind a proxy, in those inside",
            ));
        }
        if let Some(group) = context.group {
            let message = "`record` with `ring` holds for the whole network, not for a group";
            let error = Diagnostic::error("misplaced-record", word.span, message)
                .label(self.deployment.groups[group].name.span, "the group")
                .help("move it into the block of the deployment");
            return self.found.push(error);
        }
        if let Some(first) = self.record {
            return report_duplicate(word, "clause", first, &mut self.found);
        }
        self.record = Some(word.span);
        check_unique(
            fields.iter().map(|(word, _)| word),
            "field",
            &mut self.found,
        );
        if let Some((word, Some(time))) = fields.first() {
            self.deployment.ring = duration(time, word, &mut self.found);
        }
    }

    fn host(&mut self, tree: &ast::Host, scope: usize) {
        if tree.name.text.eq_ignore_ascii_case(LOCALHOST) {
            let message = "the host name `localhost` is reserved for this machine";
            let error = Diagnostic::error("reserved-name", tree.name.span, message);
            self.found.push(error);
        }
        check_unique(
            tree.fields.iter().map(|(word, _)| word),
            "field",
            &mut self.found,
        );
        let field = |wanted: &str| {
            let mut fields = tree.fields.iter();
            fields.find_map(|(word, field)| match field {
                HostField::Text(text) if word.text.eq_ignore_ascii_case(wanted) => {
                    Some(text.clone())
                }
                _ => None,
            })
        };
        let mut arch = None;
        let mut build = HostBuild::default();
        for (_, field) in &tree.fields {
            match field {
                HostField::Arch(name) => arch = host_build::arch(name, &mut self.found),
                HostField::Build(tree) => build = host_build::build(tree, &mut self.found),
                HostField::Text(_) => {}
            }
        }
        let address = field("address");
        match &address {
            Some(address) => {
                if let Some(help) = wrong_address(&address.text) {
                    let message = format!("invalid address `{}`", address.text);
                    let error = Diagnostic::error("bad-host-address", address.span, message);
                    self.found.push(error.help(help));
                }
            }
            None if !tree.incomplete => {
                let message = format!("host `{}` has no field `address`", tree.name.text);
                let error = Diagnostic::error("missing-clause", tree.name.span, message);
                self.found.push(error.help("add `address \"10.0.0.2\";`"));
            }
            None => {}
        }
        let link = field("link").and_then(|written| match link::read(&written) {
            Ok(bits) => Some((written, bits)),
            Err(error) => {
                self.found.push(error);
                None
            }
        });
        let number = self.deployment.hosts.len();
        self.scopes[scope]
            .hosts
            .declare(&tree.name, number, &mut self.found);
        self.deployment.hosts.push(Host {
            name: tree.name.clone(),
            doc: tree.doc.clone(),
            address: address.unwrap_or_else(|| Name::new("", tree.name.span)),
            user: field("user"),
            workspace: field("workspace"),
            link,
            arch,
            build,
        });
    }

    /// Reports the name `rcdeploy`. The supervisor's own files are called `rcdeploy` and
    /// `rcdeploy-guard`; those of a component in a group `rcdeploy` could collide with them.
    fn reserved(&mut self, name: &Name, context: &BlockContext<'_>) {
        if context.group.is_none() && name.text.eq_ignore_ascii_case("rcdeploy") {
            let message = "the name `rcdeploy` is reserved for the supervisor";
            let error = Diagnostic::error("reserved-name", name.span, message);
            self.found.push(error);
        }
    }

    fn length(&mut self, what: &str, name: &str, span: Span) {
        if name.len() > LONGEST_NAME {
            let message = format!(
                "the name of {what} `{name}` has {} bytes, but the maximum is {LONGEST_NAME}",
                name.len()
            );
            self.found
                .push(Diagnostic::error("name-too-long", span, message));
        }
    }

    fn resolve_references(&mut self) {
        let references = std::mem::take(&mut self.references);
        for (at, References { host, after, .. }) in references.iter().enumerate() {
            let group = self.deployment.instances[at].group;
            if let Some(name) = host {
                let host = self.host_named(name, group);
                self.deployment.instances[at].host = host.map(|host| (host, name.span));
            }
            let after = after
                .iter()
                .filter_map(|name| Some((self.first(name, group)?, name.span)));
            self.deployment.instances[at].after = after.collect();
        }
        self.resolve_processes(&references);
        // Groups inside come later, and may have the first component of a group.
        for group in self.deployment.groups.iter().rev() {
            if let Some(proxy) = &group.proxy
                && let Some(first) = self.deployment.instances.get(group.instances.start)
            {
                let host = first.host.filter(|_| !group.instances.is_empty());
                self.deployment.instances[proxy.instance].host = host;
            }
        }
        if let Some((_, path)) = self.time.take() {
            self.deployment.time = self.source_of_time(path);
        }
        for (group, bind) in std::mem::take(&mut self.binds) {
            let consumer = self.slot_path(&bind.consumer, group);
            let provider = self.slot_path(&bind.provider, group);
            if let Some(consumer) = consumer {
                let (convert, process) = (bind.convert, bind.process);
                self.deployment.binds.push(Bind {
                    consumer,
                    provider,
                    convert,
                    frames: bind.frames.clone(),
                    process,
                });
            }
        }
        self.resolve_chains();
        self.resolve_rules();
        for (group, folder, tree) in std::mem::take(&mut self.externals) {
            if let Some(address) = &tree.address
                && let Err(reason) = rc_vocabulary::address::check(&address.text)
            {
                let error = Diagnostic::error("bad-address", address.span, reason);
                self.found.push(error);
            }
            for slot in &tree.slots {
                let slot = self.slot_path(slot, group);
                let address = tree.address.clone();
                let peer = tree.peer.as_ref().map(|peer| Peer {
                    folder: folder.clone(),
                    cdsl: peer.cdsl.clone(),
                    convert: peer.convert.clone(),
                });
                let external = slot.map(|slot| External {
                    slot,
                    address,
                    peer,
                });
                self.deployment.externals.extend(external);
            }
        }
    }
}
