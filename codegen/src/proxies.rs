//! The components of proxies, which represent groups outside of them.
//!
//! A proxy has no files. Its component is made here of the exports of its group: a slot for each,
//! then their opposites, in the order that `rc_ddsl` expects.

use crate::project::Project;
use rc_cdsl::model::{Reaction, Role, Slot, Step};
use rc_ddsl::model::{Array, Deployment, Instance};
use rc_ddsl::{Endpoint, proxied};
use rc_diagnostics::{Diagnostic, Diagnostics, Severity, SourceMap, Span};
use rc_idsl::Library;
use rc_idsl::model::InterfaceId;
use rc_syntax::{Loader, Name};
use rc_vocabulary::qos::Policies;
use rc_vocabulary::{Middleware, member};
use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::rc::Rc;
use std::time::Duration;

/// The period of a proxy, whose `compute` does nothing.
const PERIOD: Duration = Duration::from_secs(1);

/// The components of proxies, by their instances: with slot arrays as they are, not with members.
pub type Proxies = BTreeMap<usize, Rc<Project>>;

/// Makes the component of each proxy, those of groups inside first.
pub fn make(
    deployment: &mut Deployment,
    projects: &mut [Option<Rc<Project>>],
    (sources, loader): (&mut SourceMap, &dyn Loader),
    found: &mut Diagnostics,
) -> Proxies {
    let mut made = Proxies::new();
    for group in (0..deployment.groups.len()).rev() {
        let Some(proxy) = &deployment.groups[group].proxy else {
            continue;
        };
        let at = proxy.instance;
        let components: Vec<_> = projects
            .iter()
            .map(|project| project.as_ref().map(|project| &project.component))
            .collect();
        let behind = proxied(deployment, &components, group);
        let place = deployment.groups[group].name.span;
        let exported = match exported(deployment, projects, &behind) {
            Ok(exported) => exported,
            Err(differ) => {
                let error = Diagnostic::error("proxy-interfaces", place, differ);
                found.push(error.help("rename one of the arrays with `as NAME`"));
                continue;
            }
        };
        if exported.is_empty() {
            continue;
        }
        let instance = &deployment.instances[at];
        let project = component(deployment, instance, &exported, (sources, loader), found);
        let Some(project) = project else { continue };
        let arrays = arrays(&exported, &project.component.slots, place);
        let network = deployment.name.text.clone();
        let instance = &mut deployment.instances[at];
        instance.arrays = arrays;
        let mut whole = project.clone();
        let expanded = rc_ddsl::expand(&network, instance, &project.component, found);
        whole.component = expanded.unwrap_or(whole.component);
        projects[at] = Some(Rc::new(whole));
        made.insert(at, Rc::new(project));
    }
    made
}

/// An exported slot, or all members of an exported array.
struct Exported<'p> {
    /// Outside, without the member.
    name: String,
    /// The component inside, and its slot; of an array, that of its first member.
    of: &'p Project,
    instance: &'p Instance,
    slot: &'p Slot,
    members: Vec<String>,
}

/// The slots of a proxy. The error is a message on members of one array that differ: they may be of
/// several components.
fn exported<'p>(
    deployment: &'p Deployment,
    projects: &'p [Option<Rc<Project>>],
    behind: &[(String, Endpoint)],
) -> Result<Vec<Exported<'p>>, String> {
    let mut all: Vec<Exported<'p>> = Vec::new();
    for (name, end) in behind {
        let Some(of) = projects[end.instance].as_deref() else {
            continue;
        };
        let (name, member) = match member::split(name) {
            Some((array, member)) => (array, Some(member.to_owned())),
            None => (name.as_str(), None),
        };
        let instance = &deployment.instances[end.instance];
        let slot = &of.component.slots[end.slot];
        let kind = |of: &Project, slot: &Slot| {
            let interface = of.component.library.interface_path(slot.interface);
            (slot.role, interface)
        };
        if let Some(known) = all.iter_mut().find(|known| known.name == name) {
            if kind(known.of, known.slot) != kind(of, slot) {
                return Err(format!(
                    "`{}.{}` and `{}.{}` have different interfaces or roles, and cannot be members of one array of a proxy",
                    known.instance.path, known.slot.name, instance.path, slot.name
                ));
            }
            known.members.extend(member);
            continue;
        }
        all.push(Exported {
            name: name.to_owned(),
            of,
            instance,
            slot,
            members: member.into_iter().collect(),
        });
    }
    Ok(all)
}

/// The members of all arrays of a proxy.
fn arrays(exported: &[Exported<'_>], slots: &[Slot], place: Span) -> Vec<Array> {
    let both = exported.iter().chain(exported);
    let arrays = both.zip(slots).filter(|(_, slot)| slot.is_array);
    let arrays = arrays.map(|(of, slot)| Array {
        name: Name::new(slot.name.as_str(), place),
        members: of
            .members
            .iter()
            .map(|name| Name::new(name.as_str(), place))
            .collect(),
    });
    arrays.collect()
}

/// The opposite of a role.
fn opposite(role: Role) -> Role {
    match role {
        Role::Implements => Role::Requires,
        Role::Requires => Role::Implements,
        Role::Publishes => Role::SubscribesTo,
        Role::SubscribesTo => Role::Publishes,
    }
}

/// The component of a proxy, with slot arrays as they are.
fn component(
    deployment: &Deployment,
    instance: &Instance,
    exported: &[Exported<'_>],
    (sources, loader): (&mut SourceMap, &dyn Loader),
    found: &mut Diagnostics,
) -> Option<Project> {
    let path = instance
        .folder
        .join(format!("{}.proxy.cdsl", instance.name.text));
    let text = text(exported, loader);
    let (project, more) = Project::of_text(&path, text, sources, loader);
    let errors = more.iter().filter(|d| d.severity == Severity::Error);
    let errors: Vec<String> = errors.map(|error| error.message.clone()).collect();
    if !errors.is_empty() {
        let message = format!(
            "the proxy of group `{}` cannot have the interfaces of its exports together: {}",
            instance.path,
            errors.join("; ")
        );
        let error = Diagnostic::error("proxy-interfaces", instance.name.span, message);
        found.push(error.help("all files that define a module have to be the same"));
        return None;
    }
    let mut project = project?;
    let component = &mut project.component;
    component.name = Name::new("rcforward", instance.name.span);
    component.doc.clone_from(&instance.doc);
    component.period = PERIOD;
    let mut outer = Vec::new();
    let mut inner = Vec::new();
    for of in exported {
        let interface = same_interface(&component.library, of)?;
        // The components inside and outside keep values; what passes on keeps none.
        let passed = of
            .slot
            .qos
            .iter()
            .filter(|policy| !policy.name().is_of_ages());
        let mut qos = Policies::default();
        qos.extend(passed);
        let slot = Slot {
            name: of.name.clone(),
            interface,
            is_array: !of.members.is_empty(),
            backend: None,
            in_place: false,
            asynchronous: false,
            available: Vec::new(),
            qos,
            span: of.instance.name.span,
            interface_span: of.instance.name.span,
            name_span: None,
            ..of.slot.clone()
        };
        let role = opposite(slot.role);
        let mut qos = Policies::default();
        qos.extend(slot.qos.iter().filter(|policy| policy.name().is_of(role)));
        inner.push(Slot {
            name: inner_name(&of.name, exported),
            role,
            qos,
            optional: false,
            backend: backend_inside(deployment, instance, of),
            ..slot.clone()
        });
        outer.push(slot);
    }
    component.reactions = Some(reactions(&component.library, &outer, &inner));
    component.slots = outer.into_iter().chain(inner).collect();
    Some(project)
}

/// A name for the opposite of an exported slot.
fn inner_name(name: &str, exported: &[Exported<'_>]) -> String {
    let mut own = format!("inside_{name}");
    while exported.iter().any(|other| other.name == own) {
        own.insert_str(0, "inside_");
    }
    own
}

/// A text with everything that the exported slots import.
fn text(exported: &[Exported<'_>], loader: &dyn Loader) -> String {
    let mut imports: BTreeSet<PathBuf> = BTreeSet::new();
    for of in exported {
        let library = &of.of.component.library;
        let module = library.interface(of.slot.interface).module;
        let origin = of.of.origins.get(module.0);
        imports.extend(origin.map(|origin| whole(&origin.path)));
        // A file that is not found is reported where the component imports it.
        let prototypes = of.of.component.prototype_imports.iter();
        let prototypes =
            prototypes.filter_map(|file| loader.find(&of.of.path, &file.text, "dproto").ok());
        imports.extend(prototypes.map(|file| whole(&file.path)));
    }
    let mut text = String::new();
    for file in imports {
        let file = file.display().to_string();
        let file = file.replace('\\', "\\\\").replace('"', "\\\"");
        let _ = writeln!(text, "import \"{file}\";");
    }
    // The name makes no difference: that of the group may be no name of a component.
    text.push_str("Component rcforward { Communications { }; language Rust; };\n");
    text
}

/// An absolute path; one that is not a file keeps its name.
fn whole(path: &Path) -> PathBuf {
    match path.canonicalize() {
        Ok(path) => path,
        Err(_) => path.file_name().map_or_else(PathBuf::new, PathBuf::from),
    }
}

/// The interface of an exported slot in the library of its proxy.
fn same_interface(library: &Library, of: &Exported<'_>) -> Option<InterfaceId> {
    let wanted = of.of.component.library.interface_path(of.slot.interface);
    let mut ids = (0..library.interfaces.len()).map(InterfaceId);
    ids.find(|id| library.interface_path(*id) == wanted)
}

/// The middleware of the connection to a slot inside, if it does not choose one itself.
fn backend_inside(
    deployment: &Deployment,
    proxy: &Instance,
    of: &Exported<'_>,
) -> Option<Middleware> {
    let inside = of.instance;
    let chosen = inside.auto.is_none().then_some(inside.middleware);
    let chosen = of.slot.backend.or(chosen);
    if chosen.is_none() && proxy.auto.is_none() {
        return Some(deployment.fastest(inside, proxy));
    }
    chosen
}

/// The reactions: each message leads to its opposite.
fn reactions(library: &Library, outer: &[Slot], inner: &[Slot]) -> Vec<Reaction> {
    let pairs = outer.iter().zip(inner);
    let pairs = pairs.map(|(one, other)| match one.role {
        Role::Implements | Role::SubscribesTo => (one, other),
        Role::Requires | Role::Publishes => (other, one),
    });
    let reactions = pairs.flat_map(|(from, to)| {
        let operations = library.interface(from.interface).operations.iter();
        operations.map(|operation| {
            let step = |slot: &Slot| Step::Operation {
                slot: slot.name.clone(),
                operation: operation.name.text.clone(),
            };
            Reaction {
                cause: step(from),
                effects: vec![step(to)],
                budget: None,
            }
        })
    });
    reactions.collect()
}
