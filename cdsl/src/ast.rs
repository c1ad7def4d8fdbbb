//! The syntax tree of a `.cdsl` file. Names are not resolved.

use rc_diagnostics::Span;
use rc_syntax::{Literal, Name};

/// A file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct File {
    /// The imported paths as written.
    pub imports: Vec<Name>,
    /// The component. `None` after a syntax error.
    pub component: Option<Component>,
}

/// `Component NAME { … };`
#[derive(Clone, Debug, PartialEq)]
pub struct Component {
    /// The name as declared.
    pub name: Name,
    /// The lines of its documentation.
    pub doc: Vec<String>,
    /// Clauses, each with its keyword.
    pub clauses: Vec<(Name, Clause)>,
}

/// One clause of a component.
#[derive(Clone, Debug, PartialEq)]
pub enum Clause {
    /// `Communications { … }`
    Communications(Vec<Communication>),
    /// `language rust;`
    Language(Name),
    /// `gui Qt (QWidget);`
    Gui(Name, Option<Name>),
    /// `options dsr, agmagent;`
    Options(Vec<Name>),
    /// `statemachine "file.smdsl" visual { external go; }`: the file, whether `visual` is there,
    /// and the `external` clauses, each with its keyword.
    StateMachine(Name, bool, Vec<(Name, Vec<Name>)>),
    /// `parameters "file.pdsl";`
    Parameters(Name),
    /// `kinematics "file.kdsl" as arm;`
    Kinematics(Name, Name),
    /// `world "cortex.gdsl" as g { reads room; }`, `world any as g;`
    World(World),
    /// `dependencies { rand "0.9"; }`
    Dependencies(Vec<Dependency>),
    /// `python "3.12" venv;`: the version, and whether `venv` is there.
    Python(Name, bool),
    /// `period 50ms;`
    Period(Literal),
    /// `collect LaserPub.newScan, pose.newFullPose within 20ms as view;`
    Collect(Collect),
    /// `reactions { compute -> newPose budget 1ms; }`
    Reactions(Vec<Reaction>),
    /// `simulates time;`
    SimulatesTime,
    /// `lifecycle managed;`
    Lifecycle(Name),
}

/// `world "cortex.gdsl" as g { writes door, door.pose stream; reads room; }`
#[derive(Clone, Debug, PartialEq)]
pub struct World {
    /// The path of its schema, as written. `None` for `any`.
    pub schema: Option<Name>,
    /// The location of the path, or of `any`.
    pub span: Span,
    /// Its name in the worker.
    pub name: Name,
    /// `writes` and `reads`, each with what follows. `None` without a block.
    pub access: Option<Vec<(Name, Vec<Access>)>>,
}

/// `door.pose stream 50ms shared`
#[derive(Clone, Debug, PartialEq)]
pub struct Access {
    /// The type.
    pub kind: Name,
    /// One of its attributes.
    pub attribute: Option<Name>,
    /// The words `stream`, each with the least time between two values.
    pub stream: Vec<(Name, Option<Literal>)>,
    /// The words `shared`.
    pub shared: Vec<Name>,
}

/// One crate of a `dependencies` clause.
#[derive(Clone, Debug, PartialEq)]
pub struct Dependency {
    /// The name of the package.
    pub package: Name,
    /// `"0.9"`, a version or a path. `None` if there is a block.
    pub short: Option<Name>,
    /// `{ version "1"; features "a", "b"; }`
    pub fields: Vec<(Name, Vec<Literal>)>,
}

/// `collect LaserPub.newScan, pose.newFullPose within 20ms as view;`
#[derive(Clone, Debug, PartialEq)]
pub struct Collect {
    /// The topics.
    pub topics: Vec<OperationPath>,
    /// The most time between two of them. `None` for `exact`.
    pub within: Option<Literal>,
    /// What the worker calls it.
    pub name: Name,
}

/// `scan, base.bumped -> setSpeed budget 3ms;`
#[derive(Clone, Debug, PartialEq)]
pub struct Reaction {
    /// Its cause.
    pub causes: Vec<OperationPath>,
    /// Its effects.
    pub effects: Vec<OperationPath>,
    /// `budget 3ms`
    pub budget: Option<Literal>,
}

/// `scan`, or `SLOT.scan`.
#[derive(Clone, Debug, PartialEq)]
pub struct OperationPath {
    /// The slot.
    pub slot: Option<Name>,
    /// The operation, or `compute`.
    pub operation: Name,
}

impl OperationPath {
    /// The location of the whole path.
    pub fn span(&self) -> Span {
        let first = self.slot.as_ref().unwrap_or(&self.operation);
        first.span.to(self.operation.span)
    }
}

/// `requires A, B as front;`
#[derive(Clone, Debug, PartialEq)]
pub struct Communication {
    /// The keyword as written.
    pub keyword: Name,
    /// The interfaces.
    pub slots: Vec<SlotDecl>,
}

/// One interface in a communication clause.
#[derive(Clone, Debug, PartialEq)]
pub struct SlotDecl {
    /// The interface.
    pub interface: Name,
    /// `[]`
    pub array: Option<Span>,
    /// `(dds)`
    pub backend: Option<Name>,
    /// `as front`
    pub name: Option<Name>,
    /// The keyword `optional`.
    pub optional: Option<Name>,
    /// `{ depth 5; }`
    pub qos: Vec<Setting>,
    /// `{ available moving, holding; }`, each with its keyword.
    pub available: Vec<(Name, Vec<Name>)>,
    /// The location of the whole declaration.
    pub span: Span,
}

/// `depth 5`, `wake spin 50us`, `serve latest 200ms`
#[derive(Clone, Debug, PartialEq)]
pub struct Setting {
    /// The name of the setting.
    pub name: Name,
    /// The value.
    pub value: Literal,
    /// The word before the value: `spin` or `latest`.
    pub mode: Option<String>,
}
