//! One component: its slots, its middlewares, its sources.

use super::library::{self, Module};
use super::machine::{self, Machine};
use super::parameters::{self, Parameters};
use super::world::{self, AnyWorld, World};
use crate::note::Note;
use crate::project::Project;
use crate::{ros, viewer};
use rc_cdsl::model::{self, Middleware, Role};
use rc_diagnostics::Diagnostics;
use rc_idsl::Library;
use rc_idsl::model::Operation;
use rc_kinematics::Cell;
use rc_prototypes::model::Library as Prototypes;
use rc_syntax::Name;
use rc_vocabulary::Middlewares;
use rc_vocabulary::qos::{Policies, Policy, PolicyName, PolicyValue};
use serde::{Serialize, Serializer};
use std::sync::Arc;
use std::time::Duration;

/// A component.
#[derive(Debug, Serialize)]
pub struct Component {
    /// The name after `Component`.
    pub name: String,
    /// The name of the `.cdsl` file, in one line of a comment in every language.
    pub file: String,
    /// Lines of documentation.
    pub doc: Vec<String>,
    /// The hash of all description files, sixteen hexadecimal digits.
    pub hash: String,
    /// The middleware of every slot that does not choose one.
    pub middleware: Middleware,
    /// All middlewares of the component, this one first.
    pub middlewares: Vec<Middleware>,
    /// Note for tools in the executable, as the content of a string of bytes.
    pub note: String,
    /// The default period.
    pub period: Time,
    /// The topics whose samples one handler gets together.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub collects: Vec<Collect>,
    /// The reactions, if the file declares them.
    pub reactions: Option<Vec<Reaction>>,
    /// Whether the worker can advance the time of its network.
    pub simulates_time: bool,
    /// Whether it has the life cycle of a managed component.
    pub managed: bool,
    /// The class of Qt that the worker is, if it is a window.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub window: Option<&'static str>,
    /// Whether it holds a tree of InnerModel, which a window shows.
    pub viewer: bool,
    /// The slots, in the order of the text.
    pub slots: Vec<Slot>,
    /// Definitions of the messages and services in ROS 2 that are not part of ROS 2 itself.
    pub ros_types: Vec<String>,
    /// The modules that the imports reach, each after those that it imports.
    pub modules: Vec<Module>,
    /// Meanings of the values of its types: the data prototypes that it imports.
    #[serde(skip_serializing_if = "is_empty", serialize_with = "of_arc")]
    pub prototypes: Arc<Prototypes>,
    /// The parameters, if the component has some.
    pub parameters: Option<Parameters>,
    /// The solvers of robots that the component has.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub kinematics: Vec<Kinematics>,
    /// The graph that the component shares with others.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub world: Option<World>,
    /// The same, if it is that of any network, with slots of the worker.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub any_world: Option<AnyWorld>,
    /// The state machine, if the component has one.
    pub machine: Option<Machine>,
    /// The JSON Schema of a configuration.
    #[serde(skip)]
    pub schema: String,
    /// The `python` clause, if the component has one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub python: Option<Python>,
    /// The packages of other people that the component uses.
    pub dependencies: Vec<Dependency>,
}

fn of_arc<S: Serializer>(prototypes: &Arc<Prototypes>, to: S) -> Result<S::Ok, S::Error> {
    prototypes.as_ref().serialize(to)
}

fn is_empty(prototypes: &Prototypes) -> bool {
    prototypes.prototypes.is_empty()
}

/// The solvers of a robot.
#[derive(Debug, Serialize)]
pub struct Kinematics {
    /// Its name in the worker.
    pub name: String,
    /// The name of the solvers in their file.
    pub cell: String,
    /// The robot.
    pub robot: String,
    /// The functions.
    pub solvers: Vec<String>,
    /// The functions in Rust, as a module.
    #[serde(skip)]
    pub rust: String,
    /// The functions in Python, as a module.
    #[serde(skip)]
    pub python: String,
    /// The functions in C++, as a header with a namespace of this name.
    #[serde(skip)]
    pub cpp: String,
}

impl Kinematics {
    fn of((name, cell): &(Name, Cell)) -> Self {
        let solvers = cell.solvers.iter().map(|solver| &solver.name);
        let inverses = cell.inverses.iter().map(|inverse| &inverse.name);
        Self {
            name: name.text.clone(),
            cell: cell.name.clone(),
            robot: in_a_comment(&cell.robot.name),
            solvers: solvers.chain(inverses).cloned().collect(),
            rust: rc_kinematics::rust_methods(cell),
            python: rc_kinematics::python(cell),
            cpp: rc_kinematics::cpp(&Cell {
                name: name.text.clone(),
                ..cell.clone()
            }),
        }
    }
}

/// Topics whose samples one handler gets together.
#[derive(Debug, Serialize)]
pub struct Collect {
    /// Its name in the worker.
    pub name: String,
    /// The topics.
    pub topics: Vec<CollectedTopic>,
    /// The most time between the first and the last sample; zero for equal times.
    pub within: Time,
}

/// A topic of a [`Collect`].
#[derive(Debug, Serialize)]
pub struct CollectedTopic {
    /// `SLOT.OPERATION`
    pub topic: String,
    /// The number of the slot.
    #[serde(skip)]
    pub slot: usize,
    /// The number of the operation in its interface.
    #[serde(skip)]
    pub operation: usize,
}

impl Collect {
    fn of(component: &model::Component, collect: &model::Collect) -> Self {
        let topic = |(slot, operation): &(String, String)| {
            let mut slots = component.slots.iter();
            let number = slots.position(|of| of.name == *slot)?;
            let interface = component
                .library
                .interface(component.slots[number].interface);
            let mut operations = interface.operations.iter();
            Some(CollectedTopic {
                topic: format!("{slot}.{operation}"),
                slot: number,
                operation: operations.position(|of| of.name.text == *operation)?,
            })
        };
        Self {
            name: collect.name.text.clone(),
            topics: collect.topics.iter().filter_map(topic).collect(),
            within: collect.within.into(),
        }
    }
}

/// The effects of one cause.
#[derive(Debug, Serialize)]
pub struct Reaction {
    /// `compute`, or `SLOT.OPERATION` of a received message.
    pub cause: String,
    /// `SLOT.OPERATION` of each message that is sent; `compute` for what the next period sends.
    pub effects: Vec<String>,
    /// The longest run, if the file says it.
    pub budget: Option<Time>,
}

impl Reaction {
    fn of(reaction: &model::Reaction) -> Self {
        Self {
            cause: reaction.cause.to_string(),
            effects: reaction.effects.iter().map(ToString::to_string).collect(),
            budget: reaction.budget.map(Time::from),
        }
    }
}

/// Interpreter of a component in Python.
#[derive(Debug, Serialize)]
pub struct Python {
    /// The oldest version of Python that it runs on, as `3.12`.
    pub oldest: String,
    /// Whether it has a virtual environment of its own.
    pub venv: bool,
}

/// A package from outside the framework.
#[derive(Debug, Serialize)]
pub struct Dependency {
    /// Name of the package.
    pub package: String,
    /// Version, if one is given.
    pub version: Option<String>,
    /// Path from the folder of the `.cdsl`, if one is given.
    pub path: Option<String>,
    /// Cargo features.
    pub features: Vec<String>,
    /// Whether its default features are on.
    pub default_features: bool,
    /// Components of a package of cmake.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub components: Vec<String>,
}

/// A length of time.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Time {
    /// Whole seconds.
    pub seconds: u64,
    /// The rest, below one second.
    pub nanoseconds: u32,
}

impl From<Duration> for Time {
    fn from(time: Duration) -> Self {
        Self {
            seconds: time.as_secs(),
            nanoseconds: time.subsec_nanos(),
        }
    }
}

/// One end of a connection.
#[derive(Debug, Serialize)]
pub struct Slot {
    /// The name, unique in the component.
    pub name: String,
    /// `implements`, `requires`, `publishes` or `subscribesTo`.
    pub role: Role,
    /// Whether handlers of the worker serve it.
    pub receives: bool,
    /// Whether the worker calls or publishes through it.
    pub sends: bool,
    /// Whether it is an array, whose members the worker opens.
    pub is_array: bool,
    /// Whether the component works without a peer.
    pub optional: bool,
    /// The name of the interface.
    pub interface: String,
    /// The module of the interface.
    pub module: String,
    /// The hash of the whole interface, sixteen hexadecimal digits.
    pub type_hash: String,
    /// The middleware, if it differs from the component's.
    pub middleware: Option<Middleware>,
    /// Where the quality of service differs from the role's default.
    pub qos: Qos,
    /// The states of the machine in which requests are served; in all states if there is none.
    pub available: Vec<String>,
    /// Whether samples or replies travel in place.
    pub in_place: bool,
    /// Whether queries can also be started, and end later.
    pub asynchronous: bool,
    /// Whether it is one by which the replicas of a world meet: the worker has nothing to do with it.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub of_world: bool,
    /// The names that the middleware has for the types of the operations, if it has its own.
    pub external_types: Vec<String>,
}

impl Slot {
    /// Whether the context has its newest samples.
    pub(crate) fn keeps_newest(&self) -> bool {
        self.role == Role::SubscribesTo && self.qos.0.get(PolicyName::Fresh).is_some()
    }

    /// Whether the context has its last results, which answer queries.
    pub(crate) fn serves_latest(&self) -> bool {
        self.role == Role::Implements && self.qos.0.get(PolicyName::Latest).is_some()
    }
}

/// Deviations from a role's default quality of service. As JSON, every policy by its name: a word,
/// a number, a [`Time`], or `null` where it is the default.
#[derive(Debug, Default)]
pub struct Qos(pub Policies);

impl Serialize for Qos {
    fn serialize<S: Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
        #[derive(Serialize)]
        #[serde(untagged)]
        enum Value {
            Word(&'static str),
            Number(u32),
            Time(Option<Time>),
        }
        let value = |policy: Policy| match policy.kind() {
            PolicyValue::Word(word) => Value::Word(word),
            PolicyValue::Count(count) => Value::Number(count),
            PolicyValue::Limit(limit) => Value::Time(limit.map(Time::from)),
            PolicyValue::Time(time) => Value::Time(Some(time.into())),
        };
        let all = PolicyName::ALL.into_iter();
        to.collect_map(all.map(|name| (name.word(), self.0.get(name).map(value))))
    }
}

/// The view of a project that has no errors, for middlewares.
pub fn of(project: &Project, generated_for: impl Into<Middlewares>) -> (Component, Diagnostics) {
    let generated_for = generated_for.into();
    let middleware = generated_for.main();
    let mut found = Diagnostics::new();
    let component = &project.component;
    let library = &component.library;
    // Slots that choose ROS 2 were checked when the component was read.
    if generated_for.iter().any(|one| one.can().has_nodes) {
        found.extend(ros::refused(library));
    }
    let mut middlewares: Vec<Middleware> = generated_for.iter().collect();
    for backend in component.slots.iter().filter_map(|slot| slot.backend) {
        if !middlewares.contains(&backend) {
            middlewares.push(backend);
        }
    }
    let note = Note {
        component: component.name.text.clone(),
        model: format!("{:016x}", project.hash),
        middleware: generated_for.to_string(),
    };
    let slots = component.slots.iter();
    let mut slots: Vec<Slot> = slots
        .map(|slot| one(library, slot, generated_for))
        .collect();
    let collects = component.collects.iter();
    let collects: Vec<Collect> = collects.map(|one| Collect::of(component, one)).collect();
    for (number, slot) in slots.iter_mut().enumerate() {
        let operations = &library
            .interface(component.slots[number].interface)
            .operations;
        let topics = || collects.iter().flat_map(|collect| &collect.topics);
        // A slot whose topics are all collected has no handlers of its own.
        let is_collected = !operations.is_empty()
            && (0..operations.len()).all(|operation| {
                topics().any(|topic| (topic.slot, topic.operation) == (number, operation))
            });
        slot.receives &= !is_collected;
    }
    let external_types: Vec<String> = slots
        .iter()
        .flat_map(|s| s.external_types.clone())
        .collect();
    let dependencies = component.dependencies.iter();
    let file = project.path.file_name().unwrap_or_default();
    let view = Component {
        name: component.name.text.clone(),
        file: in_a_comment(&file.to_string_lossy()),
        doc: component.doc.clone(),
        hash: note.model.clone(),
        middleware,
        middlewares,
        note: note.to_byte_string(),
        period: component.period.into(),
        collects,
        reactions: component
            .reactions
            .as_ref()
            .map(|all| all.iter().map(Reaction::of).collect()),
        simulates_time: component.simulates_time,
        managed: component.managed,
        window: component.window.map(|window| window.widget),
        viewer: viewer::is_on(component, project.parameters.as_ref()),
        ros_types: ros::definitions(library, &external_types),
        slots,
        modules: library::of(library),
        prototypes: Arc::clone(&component.prototypes),
        parameters: project.parameters.as_ref().map(parameters::of),
        kinematics: project.kinematics.iter().map(Kinematics::of).collect(),
        world: world::of(project),
        any_world: world::any(project),
        machine: machine(project, &mut found),
        schema: schema(project),
        python: component.python.map(|python| Python {
            oldest: format!("{}.{}", python.oldest.0, python.oldest.1),
            venv: python.venv,
        }),
        dependencies: dependencies
            .map(|dependency| Dependency {
                package: dependency.package.text.clone(),
                version: dependency.version.as_ref().map(|v| v.text.clone()),
                path: dependency.path.as_ref().map(|p| p.text.clone()),
                features: dependency.features.iter().map(|f| f.text.clone()).collect(),
                default_features: dependency.default_features,
                components: dependency
                    .components
                    .iter()
                    .map(|c| c.text.clone())
                    .collect(),
            })
            .collect(),
    };
    (view, found)
}

/// The name of a file as generated files cite it: without line ends, and without the end of a
/// Markdown comment.
fn in_a_comment(file: &str) -> String {
    rc_diagnostics::foreign::clean(file).replace('>', "&gt;")
}

fn machine(project: &Project, found: &mut Diagnostics) -> Option<Machine> {
    let named = project.component.state_machine.as_ref()?;
    machine::of(project.state_machine.as_ref()?, named, found)
}

impl Component {
    /// Whether a slot is an array.
    pub fn has_arrays(&self) -> bool {
        self.slots.iter().any(|slot| slot.is_array)
    }

    /// Whether values of a slot have ages.
    pub(crate) fn has_ages(&self) -> bool {
        let settings = [PolicyName::Fresh, PolicyName::Cache, PolicyName::Latest];
        let mut slots = self.slots.iter();
        let has_ages = slots.any(|slot| settings.iter().any(|of| slot.qos.0.get(*of).is_some()));
        has_ages || !self.collects.is_empty()
    }

    /// Whether queries of a slot can also be started.
    pub fn has_asynchronous(&self) -> bool {
        self.slots.iter().any(|slot| slot.asynchronous)
    }

    /// The interface of a slot.
    pub fn interface(&self, slot: &Slot) -> Option<&library::Interface> {
        let module = self.modules.iter().find(|m| m.name == slot.module)?;
        module.interfaces.iter().find(|i| i.name == slot.interface)
    }
}

fn one(library: &Library, slot: &model::Slot, generated_for: Middlewares) -> Slot {
    let middleware = generated_for.main();
    let interface = library.interface(slot.interface);
    // An interface without operations is a connection, but there is nothing to handle or publish.
    let any = !interface.operations.is_empty() && !slot.of_world;
    let backend = slot.backend.unwrap_or(middleware);
    Slot {
        name: slot.name.clone(),
        role: slot.role,
        receives: any && matches!(slot.role, Role::Implements | Role::SubscribesTo),
        sends: slot.role == Role::Requires || (any && slot.role == Role::Publishes),
        is_array: slot.is_array,
        optional: slot.optional,
        interface: interface.name.text.clone(),
        module: library.module(interface.module).name.text.clone(),
        type_hash: format!(
            "{:016x}",
            rc_idsl::canonical::interface_hash(library, slot.interface)
        ),
        middleware: (backend != middleware).then_some(backend),
        qos: Qos(slot.qos.clone()),
        available: slot.available.iter().map(|s| s.text.clone()).collect(),
        in_place: slot.in_place,
        asynchronous: slot.asynchronous,
        of_world: slot.of_world,
        external_types: if backend.can().has_nodes
            || slot.backend.is_none() && generated_for.iter().any(|one| one.can().has_nodes)
        {
            external_types(library, slot)
        } else {
            Vec::new()
        },
    }
}

/// The types of the operations of a slot in ROS 2.
fn external_types(library: &Library, slot: &model::Slot) -> Vec<String> {
    let name = |operation: &Operation| {
        if slot.role.is_topic() {
            ros::names::topic_type(library, slot.interface, operation)
        } else {
            ros::names::service_type(library, slot.interface, operation)
        }
    };
    let operations = &library.interface(slot.interface).operations;
    operations.iter().map(|o| name(o).to_string()).collect()
}

fn schema(project: &Project) -> String {
    let component = &project.component;
    let library = &component.library;
    let slots = component.slots.iter().map(|slot| {
        let interface = library.interface(slot.interface);
        let module = &library.module(interface.module).name.text;
        let word = slot.role.word();
        let what = format!("{word} `{module}::{}`", interface.name.text);
        rc_configuration::Slot {
            name: &slot.name,
            is_array: slot.is_array,
            what,
        }
    });
    rc_configuration::schema(
        &component.name.text,
        component.period,
        &slots.collect::<Vec<_>>(),
        project.parameters.as_ref(),
    )
}
